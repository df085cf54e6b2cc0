"""All tables on one page.

Ids are UUIDv7 strings, instants are UTC. A scenario stores its whole content, so later
changes of its inputs do not affect it.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from service.db.columns import Json, Kept, Made, Owned, Reported, Row


class SatelliteRow(Kept):
    """A satellite; its element sets are in their own table, the newest epoch in force."""

    name: Mapped[str]
    norad_cat_id: Mapped[int] = mapped_column(sa.BigInteger, index=True)
    agility: Mapped[Json]
    sensor: Mapped[Json]
    resources: Mapped[Any] = mapped_column(sa.JSON)
    spacecraft: Mapped[str | None] = mapped_column(sa.String(200))


class SpacecraftRow(Kept):
    """A type of spacecraft; ``body`` holds its agility, sensor and resources."""

    name: Mapped[str]
    body: Mapped[Json]


class ElementSetRow(Made):
    """One element set of a satellite, as received (``tle`` or ``omm``), never changed."""

    satellite_id: Mapped[str] = mapped_column(sa.ForeignKey("satellite.id"), index=True)
    epoch: Mapped[datetime]
    orbit: Mapped[Json]


class GroundStationRow(Kept):
    """A ground station; ``body`` is the body of its POST with defaults filled in."""

    name: Mapped[str]
    body: Mapped[Json]


class OutageRow(Kept):
    """A time span in which a satellite or a ground station is unavailable."""

    __table_args__ = (sa.Index("ix_outage_end", "end"),)

    satellite_id: Mapped[str | None] = mapped_column(sa.ForeignKey("satellite.id"))
    station_id: Mapped[str | None] = mapped_column(sa.ForeignKey("ground_station.id"))
    start: Mapped[datetime]
    end: Mapped[datetime]
    modes: Mapped[list[str]] = mapped_column(sa.JSON)
    reason: Mapped[str | None]


class TargetCatalogRow(Kept):
    """A catalogue of targets."""

    name: Mapped[str]
    num_targets: Mapped[int]
    changed_at: Mapped[datetime | None]


class TargetRow(Row):
    """One target of a catalogue, in the order of its file."""

    catalog_id: Mapped[str] = mapped_column(sa.ForeignKey("target_catalog.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    target_id: Mapped[str]
    body: Mapped[Json]


class OrderRow(Owned):
    """An order placed through STAPI; its id is that of its target.

    ``target`` is the target as ordered, ``sent`` the content of the order.
    """

    __tablename__ = "stapi_order"
    __table_args__ = (sa.Index("ix_stapi_order_owner_id", "owner", "id"),)

    product_id: Mapped[str] = mapped_column(sa.String(36))
    catalog_id: Mapped[str] = mapped_column(sa.ForeignKey("target_catalog.id"))
    target: Mapped[Json]
    sent: Mapped[Json]


class ScenarioRow(Made):
    """A frozen scenario. ``content`` is the self-contained scenario file; ``sha256`` its hash."""

    sha256: Mapped[str] = mapped_column(sa.String(64), unique=True)
    name: Mapped[str | None]
    summary: Mapped[Json]
    content: Mapped[str] = mapped_column(sa.Text, deferred=True)


class ScenarioOwnerRow(Row):
    """An owner who may see a scenario sent with a job; without any row, everybody may."""

    scenario_id: Mapped[str] = mapped_column(sa.ForeignKey("scenario.id"), primary_key=True)
    owner: Mapped[str] = mapped_column(sa.String(64), primary_key=True)


class ScenarioPartRow(Row):
    """A satellite or a ground station of a scenario, by which lists are filtered."""

    part_id: Mapped[str] = mapped_column(primary_key=True)
    scenario_id: Mapped[str] = mapped_column(
        sa.ForeignKey("scenario.id"), primary_key=True, index=True
    )
    kind: Mapped[str] = mapped_column(sa.String(16), primary_key=True)


class ForecastRow(Owned):
    """A forecast of clear skies; ``block`` has its values, compressed (`forecasts.fields`).

    ``summary`` tells readers its size and how it was read.
    """

    owner: Mapped[str] = mapped_column(sa.String(64), index=True)
    name: Mapped[str]
    sha256: Mapped[str] = mapped_column(sa.String(64))
    first_at: Mapped[datetime]
    last_at: Mapped[datetime]
    default_clear_probability: Mapped[float | None] = mapped_column(sa.Double)
    summary: Mapped[Json]
    block: Mapped[bytes] = mapped_column(sa.LargeBinary, deferred=True)


class OpportunitySetRow(Row):
    """The opportunities of a scenario, computed once, as a compressed columnar block."""

    scenario_sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    version: Mapped[str]
    block: Mapped[bytes] = mapped_column(sa.LargeBinary)
    created_at: Mapped[datetime]


class BoundRow(Row):
    """The best proven bound for a scenario so far, whichever job found it."""

    __tablename__ = "scenario_bound"

    scenario_sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    version: Mapped[str]
    value: Mapped[float] = mapped_column(sa.Double)
    proof: Mapped[str]
    created_at: Mapped[datetime]


class JobRow(Made):
    """A job: the truth about one piece of queue work (DBOS only dispatches it).

    ``dispatch`` counts how often it was handed to the queue; ``run`` counts starts and
    is the fencing token: only the holder of the current run may renew or finish.
    ``lost_runs`` counts the runs whose worker died.
    ``what_if_of`` is the job that this one varies, ``change`` the variation.
    ``request_id`` is the request that submitted it, for the logs of its worker.
    ``traceparent`` is the trace in which the job was queued, if there is one (W3C).
    ``version`` grows with every visible change and is the job's ETag.
    ``validity`` and ``warnings`` repeat those in the head of its timeline.
    """

    # Lets a filtered list be read in order of ids, and only up to the end of its page.
    __table_args__ = tuple(
        sa.Index(f"ix_job_{column}_id", column, "id")
        for column in ("scenario_id", "tenant", "state", "label")
    )

    scenario_id: Mapped[str] = mapped_column(sa.ForeignKey("scenario.id"))
    tenant: Mapped[str] = mapped_column(sa.String(64), default="local")
    state: Mapped[str] = mapped_column(sa.String(16))
    solver: Mapped[str] = mapped_column(sa.String(64))
    params: Mapped[Json]
    seed: Mapped[int] = mapped_column(sa.BigInteger)
    limits: Mapped[Json]
    priority: Mapped[int]
    label: Mapped[str | None]
    rerun_of: Mapped[str | None] = mapped_column(sa.String(36))
    what_if_of: Mapped[str | None] = mapped_column(sa.String(36))
    change: Mapped[Json | None]
    request_id: Mapped[str | None] = mapped_column(sa.String(64))
    traceparent: Mapped[str | None] = mapped_column(sa.String(55))
    progress: Mapped[Json | None]
    termination: Mapped[str | None] = mapped_column(sa.String(32))
    error: Mapped[Json | None]
    validity: Mapped[str | None] = mapped_column(sa.String(16))
    warnings: Mapped[list[str] | None] = mapped_column(sa.JSON(none_as_null=True))
    dispatch: Mapped[int] = mapped_column(default=1)
    run: Mapped[int] = mapped_column(default=0)
    lost_runs: Mapped[int] = mapped_column(default=0)
    lease_until: Mapped[datetime | None]
    dispatched_at: Mapped[datetime]
    cancel_requested: Mapped[bool] = mapped_column(default=False)
    version: Mapped[int] = mapped_column(default=1)
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]


class JobResultRow(Row):
    """Marks that a job has an answer; written with all its chunks as the job ends.

    ``figures`` repeats the timeline's numbers for tables.
    """

    job_id: Mapped[str] = mapped_column(sa.ForeignKey("job.id"), primary_key=True)
    figures: Mapped[Json | None]
    created_at: Mapped[datetime]


class JobChunkRow(Row):
    """A piece of a job's answer (``service.answers.chunks``), which never changes.

    ``size`` counts the characters of ``text``.
    """

    __tablename__ = "job_block"

    job_id: Mapped[str] = mapped_column(sa.ForeignKey("job_result.job_id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str] = mapped_column(sa.String(16))
    first: Mapped[int]
    num_items: Mapped[int]
    size: Mapped[int]
    tally: Mapped[Json | None] = mapped_column(sa.JSON(none_as_null=True))
    text: Mapped[str]


class ComparisonRow(Made):
    """Several solvers on one scenario, side by side."""

    scenario_id: Mapped[str] = mapped_column(sa.ForeignKey("scenario.id"))
    tenant: Mapped[str] = mapped_column(sa.String(64), default="local")
    label: Mapped[str | None]


class ComparisonRunRow(Row):
    """One line of a comparison, in the order of its request: a job like any other."""

    comparison_id: Mapped[str] = mapped_column(sa.ForeignKey("comparison.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    job_id: Mapped[str] = mapped_column(sa.ForeignKey("job.id"))


class IdempotencyKeyRow(Row):
    """The stored answer for a caller's ``Idempotency-Key``, for as long as it is kept.

    ``request_sha256`` distinguishes a repeat of the request from another one. ``answer`` is
    status, headers and body, set in the transaction that stores what the request created.
    """

    tenant: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    key: Mapped[str] = mapped_column(sa.String(255), primary_key=True)
    request_sha256: Mapped[str] = mapped_column(sa.String(64))
    answer: Mapped[Json | None]
    created_at: Mapped[datetime] = mapped_column(index=True)


class OwnerUsageRow(Row):
    """How much is stored for an owner: what it has sent, and what its jobs have found."""

    owner: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    num_rows: Mapped[int] = mapped_column(sa.BigInteger)
    num_bytes: Mapped[int] = mapped_column(sa.BigInteger)


class WorkerRow(Row):
    """A worker's heartbeat; the service is ready if there is a recent one."""

    id: Mapped[str] = mapped_column(sa.String(128), primary_key=True)
    started_at: Mapped[datetime]
    seen_at: Mapped[datetime]


class ApiKeyRow(Row):
    """An API key without its token, of which only a digest is kept."""

    id: Mapped[str] = mapped_column(sa.String(12), primary_key=True)
    name: Mapped[str] = mapped_column(sa.String(64))
    owner: Mapped[str] = mapped_column(sa.String(64))
    scope: Mapped[str] = mapped_column(sa.String(16))
    token_sha256: Mapped[str] = mapped_column(sa.String(64))
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]


class AuditEventRow(Row):
    """One change of one object. Database triggers prevent changing or deleting a row."""

    id: Mapped[str] = mapped_column(sa.String(36), primary_key=True)
    at: Mapped[datetime]
    owner: Mapped[str] = mapped_column(sa.String(64))
    key_id: Mapped[str | None]
    key_name: Mapped[str | None] = mapped_column(sa.String(64))
    request_id: Mapped[str | None] = mapped_column(sa.String(64))
    action: Mapped[str] = mapped_column(sa.String(32))
    kind: Mapped[str] = mapped_column(sa.String(32))
    object_id: Mapped[str] = mapped_column(sa.String(64), index=True)


class WebhookRow(Owned):
    """An address notified of an owner's events. ``secret`` signs, so it is stored in clear."""

    owner: Mapped[str] = mapped_column(sa.String(64), index=True)
    name: Mapped[str | None]
    url: Mapped[str]
    events: Mapped[list[str]] = mapped_column(sa.JSON)
    secret: Mapped[str]
    disabled_at: Mapped[datetime | None]
    disabled_because: Mapped[str | None]


class WebhookDeliveryRow(Made):
    """One message to one webhook: ``pending``, then ``delivered`` or ``failed``.

    ``attempts`` is also the fencing token: only the newest attempt may record its result.
    """

    __table_args__ = (sa.Index("ix_webhook_delivery_due", "state", "due_at"),)

    webhook_id: Mapped[str] = mapped_column(sa.ForeignKey("webhook.id"), index=True)
    job_id: Mapped[str | None] = mapped_column(sa.String(36))
    event: Mapped[str] = mapped_column(sa.String(32))
    payload: Mapped[str]
    state: Mapped[str] = mapped_column(sa.String(16))
    attempts: Mapped[int] = mapped_column(default=0)
    due_at: Mapped[datetime | None]
    last_status: Mapped[int | None]
    last_error: Mapped[str | None]
    ended_at: Mapped[datetime | None]


class PlanRow(Owned):
    """A plan in operations: a job's answer that is approved, published, and later superseded.

    Its content never changes; a change is a new plan with a ``parent_id``. ``version`` grows with
    each transition. ``violations`` are those that approval must waive.
    """

    __table_args__ = (sa.Index("ix_plan_owner_state_id", "owner", "state", "id"),)

    name: Mapped[str | None]
    job_id: Mapped[str] = mapped_column(sa.ForeignKey("job.id"), index=True)
    parent_id: Mapped[str | None] = mapped_column(sa.ForeignKey("plan.id"), index=True)
    state: Mapped[str] = mapped_column(sa.String(16))
    plan_sha256: Mapped[str] = mapped_column(sa.String(64))
    horizon_start: Mapped[datetime]
    horizon_end: Mapped[datetime]
    validity: Mapped[str] = mapped_column(sa.String(16))
    violations: Mapped[list[Json]] = mapped_column(sa.JSON)
    version: Mapped[int] = mapped_column(default=1)


class PlanSatelliteRow(Row):
    """A satellite of a plan, and the time span in which the plan is in force for it.

    Both ends are null until the plan is published.
    """

    plan_id: Mapped[str] = mapped_column(sa.ForeignKey("plan.id"), primary_key=True)
    satellite_id: Mapped[str] = mapped_column(primary_key=True, index=True)
    satellite_name: Mapped[str]
    in_force_from: Mapped[datetime | None]
    in_force_until: Mapped[datetime | None]


class PlanActionRow(Row):
    """A collect or a contact of a plan. ``action_id`` is its id in the job's timeline.

    ``delivered_at`` of a collect is when the plan has its image downlinked; null for never, and in
    plans of earlier releases. In those, ``station_name`` is null if the station was deleted.
    """

    plan_id: Mapped[str] = mapped_column(sa.ForeignKey("plan.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    action_id: Mapped[str]
    satellite_id: Mapped[str]
    mode: Mapped[str] = mapped_column(sa.String(16))
    start: Mapped[datetime]
    end: Mapped[datetime]
    target_id: Mapped[str | None]
    station_id: Mapped[str | None]
    delivered_at: Mapped[datetime | None]
    satellite_name: Mapped[str | None]
    station_name: Mapped[str | None]
    target_name: Mapped[str | None]


class PlanEventRow(Row):
    """One transition of a plan: who, when and why."""

    id: Mapped[str] = mapped_column(sa.String(36), primary_key=True)
    plan_id: Mapped[str] = mapped_column(sa.ForeignKey("plan.id"), index=True)
    at: Mapped[datetime]
    from_state: Mapped[str | None] = mapped_column(sa.String(16))
    to_state: Mapped[str] = mapped_column(sa.String(16))
    owner: Mapped[str] = mapped_column(sa.String(64))
    key_name: Mapped[str | None] = mapped_column(sa.String(64))
    reason: Mapped[str | None]
    effective_from: Mapped[datetime | None]
    waivers: Mapped[list[Json]] = mapped_column(sa.JSON)


class PlanStateRow(Reported):
    """Telemetry of a satellite of a plan."""

    satellite_id: Mapped[str]
    at: Mapped[datetime]
    body: Mapped[Json]


class PublisherRow(Row):
    """One row per owner, locked while publishing, so that plans are published one by one."""

    owner: Mapped[str] = mapped_column(sa.String(64), primary_key=True)


class ExecutionRow(Reported):
    """The reported outcome of an action."""

    __tablename__ = "plan_execution"

    action_id: Mapped[str]
    outcome: Mapped[str] = mapped_column(sa.String(16))
    at: Mapped[datetime | None]
    mbit: Mapped[float | None] = mapped_column(sa.Double)
    detail: Mapped[str | None]
