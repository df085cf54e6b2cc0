"""A typed client of the service's HTTP API, independent of the service's own modules.

>>> from service.client import Client
>>> Client("http://127.0.0.1:8000")
Client('http://127.0.0.1:8000')
"""

from service.client.client import Client
from service.client.errors import (
    ClientError,
    JobFailed,
    ServiceError,
    UnexpectedAnswer,
    Unreachable,
    WaitTimedOut,
)
from service.client.jobs import Job
from service.client.webhooks import Webhook
from service.wire.forecasts import ForecastOut as Forecast
from service.wire.imports import Imported as Import
from service.wire.jobs import ComparedRun
from service.wire.jobs import ComparisonOut as Comparison
from service.wire.jobs import ProgressOut as Progress
from service.wire.operations import FaultOut as Fault
from service.wire.operations import SolverOut as Solver
from service.wire.outcomes import AttemptOut as Attempt
from service.wire.outcomes import ExplanationOut as Explanation
from service.wire.outcomes import TargetItem as TargetOutcome
from service.wire.passes import PassOut as Pass
from service.wire.pins import OutageOut as Outage
from service.wire.plan_diffs import DiffOut as PlanDiff
from service.wire.plans import ExecutionOut as Execution
from service.wire.plans import PlanActionOut as PlanAction
from service.wire.plans import PlanEventOut as PlanEvent
from service.wire.plans import PlanOut as Plan
from service.wire.replans import PlanChangesOut as PlanChanges
from service.wire.satellites import SatelliteOut as Satellite
from service.wire.scenarios import OpportunityOut as Opportunity
from service.wire.scenarios import ScenarioOut as Scenario
from service.wire.scenarios import ScenarioSummary
from service.wire.sites import GroundStationOut as GroundStation
from service.wire.sites import TargetCatalogOut as TargetCatalog
from service.wire.sites import TargetIn as Target
from service.wire.target_lives import TargetLifeOut as TargetLife
from service.wire.timelines import ActionOut as Action
from service.wire.timelines import SatelliteTimelineOut as SatelliteTimeline
from service.wire.timelines import TimelineOut as Timeline
from service.wire.timelines import TotalsOut as Totals
from service.wire.timelines import ViolationOut as Violation
from service.wire.webhooks import DeliveryOut as Delivery

__all__ = [
    "Action", "Attempt", "Client", "ClientError", "ComparedRun", "Comparison", "Delivery",
    "Execution", "Explanation", "Fault", "Forecast", "GroundStation", "Import", "Job", "JobFailed",
    "Opportunity", "Outage", "Pass", "Plan", "PlanAction", "PlanChanges", "PlanDiff", "PlanEvent",
    "Progress", "Satellite", "SatelliteTimeline", "Scenario", "ScenarioSummary", "ServiceError",
    "Solver", "Target", "TargetCatalog", "TargetLife", "TargetOutcome", "Timeline", "Totals",
    "UnexpectedAnswer", "Unreachable", "Violation", "WaitTimedOut", "Webhook",
]  # fmt: skip
