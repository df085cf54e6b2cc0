"""A typed client of the service's HTTP API, which needs none of the service's own parts.

>>> from service.client import Client
>>> Client("http://127.0.0.1:8000")
Client('http://127.0.0.1:8000')
"""

from service.client.answers import (
    Action,
    Attempt,
    ComparedRun,
    Explanation,
    PlanDiff,
    Progress,
    SatelliteTimeline,
    TargetOutcome,
    Timeline,
    Totals,
    Violation,
)
from service.client.client import Client
from service.client.comparisons import Comparison
from service.client.errors import (
    ClientError,
    JobFailed,
    ServiceError,
    UnexpectedAnswer,
    Unreachable,
    WaitTimedOut,
)
from service.client.jobs import Job
from service.client.shapes import (
    Fault,
    GroundStation,
    Import,
    Opportunity,
    Satellite,
    Scenario,
    Solver,
    Target,
    TargetCatalog,
)
from service.client.webhooks import Delivery, Webhook

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
]
