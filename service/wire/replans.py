"""Replans: a plan that follows another one, and what it changes."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from service.wire.base import Body, Free, Id, Instant, Name, NonNegative, Open, Wire
from service.wire.jobs import LimitsIn
from service.wire.pins import OutageIn, PinnedActionIn, StateIn
from service.wire.plan_before import PromiseIn, StabilityIn
from service.wire.plans import MAX_REPORTED, ExecutionIn, PlanActionOut
from service.wire.scenarios import AnyObjective
from service.wire.sites import TargetIn


class ReplanIn(Body):
    """What happened to a plan, and how it is to go on. The plan itself stays as it is."""

    now: Instant | None = Field(None, description="By default the time at the service.")
    freeze_until: Instant | None = Field(
        None, description="What starts before it is not touched; `now` by default."
    )
    horizon_end: Instant | None = Field(None, description="That of the plan by default.")
    outages: list[OutageIn] = Field(
        [], max_length=1000, description="Of this replan alone; those stored are taken along."
    )
    states: list[StateIn] = Field(
        [],
        max_length=10_000,
        description="Telemetry of this replan alone; of what was sent before the newest of each "
        "satellite is taken along. With any, or where a report says that something failed, the "
        "new plan begins at `now`.",
    )
    elements: Literal["same", "newest"] = Field(
        "same",
        description="`newest`: the elements of each satellite that are in force today. What is "
        "frozen stays at its instants; what comes later is matched to the accesses of now.",
    )
    executions: list[ExecutionIn] = Field(
        [], max_length=MAX_REPORTED, description="Reports to take down first, as by `executions`."
    )
    promises: list[PromiseIn] = Field(
        [], max_length=10_000, description="Those of the plan itself stay as well."
    )
    add_targets: list[TargetIn] = Field([], max_length=10_000)
    add_target_catalog_ids: list[Id] = Field([], max_length=1000)
    drop_targets: list[Id] = Field([], max_length=10_000)
    keep: list[PinnedActionIn] = Field(
        [],
        max_length=10_000,
        description="Actions that the new plan must hold, as in `pins.keep`. "
        "Those of the plan itself stay, but for what `skip` names.",
    )
    skip: list[PinnedActionIn] = Field(
        [], max_length=10_000, description="Single actions that it may not hold, as in `pins.skip`."
    )
    rewards: dict[Id, NonNegative] = Field(
        {}, max_length=10_000, description="By target: what its image earns from now on."
    )
    objective: AnyObjective | None = Field(
        None, description="What images earn from now on; that of the plan by default."
    )
    stability: StabilityIn = StabilityIn()
    name: Name | None = Field(None, description="Of the new plan.")
    solver: Id = Field("certified", description="Which search proves how good the plan is.")
    params: Free[dict[str, Any]] = Field({}, description="That solver's own.")
    seed: int = Field(0, ge=0, lt=2**63)
    limits: LimitsIn = LimitsIn()
    priority: int = Field(9, ge=0, le=9, description="9 is the most urgent.")
    label: Name | None = None


class PlanChangeItem(Wire):
    """One action that differs from the plan before."""

    change: Open[Literal["removed", "moved", "added"]]
    action: PlanActionOut | None = Field(description="As it is now; null where it is removed.")
    parent_action: PlanActionOut | None = Field(description="As it was; null where it is new.")
    cause: Open[Literal["lost", "displaced_by", "resource", "gain"]] = Field(
        description="`lost`: an outage or a failure took it, or its target was dropped. "
        "`displaced_by`: another action took its time. `resource`: for battery, recorder or an "
        "antenna. `gain`: for what it earns."
    )
    because_of: tuple[str, ...] = Field(
        description="Ids of the new plan's actions that took its time."
    )


class PlanChangesOut(Wire):
    """What a replan has changed after its freeze."""

    parent_id: str | None = Field(description="Null where the plan is no replan.")
    freeze_until: Instant | None
    changed_share: float = Field(
        description="Of the parent's actions after the freeze: moved or removed."
    )
    forced_share: float = Field(description="Of the same: lost whatever is planned.")
    items: tuple[PlanChangeItem, ...]
