"""Webhooks, the events sent to them, and their deliveries."""

from __future__ import annotations

from typing import Annotated, Final, Literal, get_args

from pydantic import Field, StringConstraints

from service.wire.base import Body, Instant, Name, Open, Stored, Wire
from service.wire.jobs import ErrorOut, JobState
from service.wire.plans import PlanChange
from service.wire.timelines import Validity

LONGEST_URL: Final = 2000
JobEvent = Literal["job.succeeded", "job.failed", "job.cancelled", "job.expired"]
JOB_EVENTS: Final[tuple[JobEvent, ...]] = get_args(JobEvent)
PlanEvent = Literal[
    "plan.draft", "plan.approved", "plan.published", "plan.superseded", "plan.withdrawn"
]
ToldEvent = Literal[JobEvent, PlanEvent]
EVENTS: Final[tuple[ToldEvent, ...]] = get_args(ToldEvent)
Event = Literal[ToldEvent, "test"]
DeliveryState = Literal["pending", "delivered", "failed"]


class WebhookIn(Body):
    """The address of a receiver, and the events to send."""

    url: Annotated[str, StringConstraints(min_length=1, max_length=LONGEST_URL)] = Field(
        description="Receives each event as a POST. Only `https`, unless the server allows more."
    )
    events: list[ToldEvent] = Field(
        default_factory=lambda: list[ToldEvent](JOB_EVENTS),
        min_length=1,
        max_length=len(EVENTS),
        description="Ends of jobs and transitions of plans to send. By default all ends of jobs.",
    )
    name: Name | None = None


class WebhookOut(Stored):
    """A webhook, without the secret that signs its messages."""

    id: str
    url: str
    events: tuple[Open[ToldEvent], ...]
    name: str | None
    owner: str = Field(description="Owner of the jobs and plans it reports.")
    created_at: Instant
    disabled_at: Instant | None = Field(
        description="Since when nothing has been sent, as the receiver answered 410."
    )
    disabled_because: str | None
    links: dict[str, str]


class CreatedWebhook(WebhookOut):
    """A new webhook with its secret, which is shown only once."""

    secret: str | None = Field(
        description="The receiver verifies `webhook-signature` with it. Null in an answer that is "
        "repeated for the same `Idempotency-Key`."
    )


class DeliveryOut(Wire):
    """One message, and the state of its delivery."""

    id: str = Field(description="The `webhook-id` of each of its attempts.")
    event: Open[Event]
    job_id: str | None
    state: Open[DeliveryState]
    attempts: int
    due_at: Instant | None = Field(description="When it is next tried.")
    last_status: int | None = Field(description="HTTP status of the receiver's last answer.")
    last_error: str | None
    created_at: Instant
    ended_at: Instant | None


class JobEnd(Wire):
    """The data of an event about a job."""

    job_id: str
    state: Open[JobState]
    termination: str | None
    error: ErrorOut | None
    validity: Open[Validity] | None = Field(None, description="Null without a plan.")
    warnings: tuple[str, ...] = ()
    solver: str
    label: str | None
    scenario_id: str
    links: dict[str, str]


class TestData(Wire):
    """The data of an event of type `test`."""

    message: str
    webhook_id: str


class EventOut(Wire):
    """A message to a webhook."""

    type: Open[Event]
    timestamp: Instant
    data: JobEnd | PlanChange | TestData
