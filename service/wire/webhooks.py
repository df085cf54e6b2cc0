"""Webhooks, what is sent to them, and how that fared."""

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
    """Where to send, and what."""

    url: Annotated[str, StringConstraints(min_length=1, max_length=LONGEST_URL)] = Field(
        description="Gets each event as a POST. `https` only, unless the server allows more."
    )
    events: list[ToldEvent] = Field(
        default_factory=lambda: list[ToldEvent](JOB_EVENTS),
        min_length=1,
        max_length=len(EVENTS),
        description="What is told: ends of jobs, and transitions of plans. By default the former.",
    )
    name: Name | None = None


class WebhookOut(Stored):
    """A webhook, without the secret that signs what it sends."""

    id: str
    url: str
    events: tuple[Open[ToldEvent], ...]
    name: str | None
    owner: str = Field(description="Whose jobs and plans it tells of.")
    created_at: Instant
    disabled_at: Instant | None = Field(
        description="Since when nothing is sent any more: the receiver answered 410."
    )
    disabled_because: str | None
    links: dict[str, str]


class CreatedWebhook(WebhookOut):
    """The same with its secret, which is shown this once."""

    secret: str | None = Field(
        description="For the receiver: verify `webhook-signature` with it. Null in an answer that "
        "was given before, under the same `Idempotency-Key`."
    )


class DeliveryOut(Wire):
    """One message and how it fared."""

    id: str = Field(description="The `webhook-id` of each of its attempts.")
    event: Open[Event]
    job_id: str | None
    state: Open[DeliveryState]
    attempts: int
    due_at: Instant | None = Field(description="When it is tried next.")
    last_status: int | None = Field(description="What the receiver answered last.")
    last_error: str | None
    created_at: Instant
    ended_at: Instant | None


class JobEnd(Wire):
    """What an event tells of a job."""

    job_id: str
    state: Open[JobState]
    termination: str | None
    error: ErrorOut | None
    validity: Open[Validity] | None = Field(None, description="Of its plan; null without one.")
    warnings: tuple[str, ...] = ()
    solver: str
    label: str | None
    scenario_id: str
    links: dict[str, str]


class TestData(Wire):
    """What an event of type `test` tells."""

    message: str
    webhook_id: str


class EventOut(Wire):
    """What is sent to a webhook."""

    type: Open[Event]
    timestamp: Instant
    data: JobEnd | PlanChange | TestData
