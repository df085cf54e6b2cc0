"""What a user of Slewline imports: the client here, the planning core in ``slewline.core``.

>>> from slewline import Client
>>> Client("http://127.0.0.1:8000")
Client('http://127.0.0.1:8000')

The client's home is ``service.client``; this package only gives it the product's name.
"""

from planner_core import __version__
from service.client import (
    Action,
    Attempt,
    Client,
    ClientError,
    ComparedRun,
    Comparison,
    Delivery,
    Explanation,
    Fault,
    GroundStation,
    Import,
    Job,
    JobFailed,
    Opportunity,
    PlanDiff,
    Progress,
    Satellite,
    SatelliteTimeline,
    Scenario,
    ServiceError,
    Solver,
    Target,
    TargetCatalog,
    TargetOutcome,
    Timeline,
    Totals,
    UnexpectedAnswer,
    Unreachable,
    Violation,
    WaitTimedOut,
    Webhook,
)

__all__ = [
    "Action",
    "Attempt",
    "Client",
    "ClientError",
    "ComparedRun",
    "Comparison",
    "Delivery",
    "Explanation",
    "Fault",
    "GroundStation",
    "Import",
    "Job",
    "JobFailed",
    "Opportunity",
    "PlanDiff",
    "Progress",
    "Satellite",
    "SatelliteTimeline",
    "Scenario",
    "ServiceError",
    "Solver",
    "Target",
    "TargetCatalog",
    "TargetOutcome",
    "Timeline",
    "Totals",
    "UnexpectedAnswer",
    "Unreachable",
    "Violation",
    "WaitTimedOut",
    "Webhook",
    "__version__",
]
