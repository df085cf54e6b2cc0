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
    """What happened to a plan, and how to continue. The plan itself does not change."""

    now: Instant | None = Field(None, description="Defaults to the service's clock.")
    freeze_until: Instant | None = Field(
        None, description="Actions that start before it do not change; `now` by default."
    )
    horizon_end: Instant | None = Field(None, description="Defaults to that of the plan.")
    outages: list[OutageIn] = Field(
        [], max_length=1000, description="For this replan only; stored outages apply as well."
    )
    states: list[StateIn] = Field(
        [],
        max_length=10_000,
        description="Telemetry for this replan only; the newest state of each satellite that was "
        "sent before applies as well. With any state, or a report of a failed or partial action "
        "or with `mbit`, the new plan begins at `now`.",
    )
    elements: Literal["same", "newest"] = Field(
        "same",
        description="`newest`: use the elements of each satellite that are in force today. Frozen "
        "actions keep their times; later ones are matched to the new accesses.",
    )
    executions: list[ExecutionIn] = Field(
        [], max_length=MAX_REPORTED, description="Reports to store first, as `executions` does."
    )
    promises: list[PromiseIn] = Field(
        [], max_length=10_000, description="Promises of the plan itself remain as well."
    )
    add_targets: list[TargetIn] = Field([], max_length=10_000)
    add_target_catalog_ids: list[Id] = Field([], max_length=1000)
    drop_targets: list[Id] = Field([], max_length=10_000)
    keep: list[PinnedActionIn] = Field(
        [],
        max_length=10_000,
        description="Actions that the new plan must hold, as in `pins.keep`. "
        "Those of the plan itself remain, except those that `skip` names.",
    )
    skip: list[PinnedActionIn] = Field(
        [], max_length=10_000, description="Single actions it may not hold, as in `pins.skip`."
    )
    rewards: dict[Id, NonNegative] = Field(
        {}, max_length=10_000, description="By target: what an image of it earns from now on."
    )
    objective: AnyObjective | None = Field(
        None, description="What images earn from now on; defaults to that of the plan."
    )
    stability: StabilityIn = StabilityIn()
    name: Name | None = Field(None, description="Name of the new plan.")
    solver: Id = Field("certified", description="Searches for a better plan, and for a bound.")
    params: Free[dict[str, Any]] = Field({}, description="Parameters of that solver.")
    seed: int = Field(0, ge=0, lt=2**63)
    limits: LimitsIn = LimitsIn()
    priority: int = Field(9, ge=0, le=9, description="9 is the most urgent.")
    label: Name | None = None


class PlanChangeItem(Wire):
    """One action that differs from the previous plan."""

    change: Open[Literal["removed", "moved", "added"]]
    action: PlanActionOut | None = Field(description="As it is now; null if it was removed.")
    parent_action: PlanActionOut | None = Field(description="As it was; null if it is new.")
    cause: Open[Literal["lost", "displaced_by", "resource", "gain"]] = Field(
        description="`lost`: an outage or a failure ruled it out, or its target was dropped. "
        "`displaced_by`: another action took its time. `resource`: because of battery, recorder "
        "or an antenna. `gain`: because of what it earns."
    )
    because_of: tuple[str, ...] = Field(
        description="Ids of the new plan's actions that took its time."
    )


class PlanChangesOut(Wire):
    """The changes that a replan makes after its freeze."""

    parent_id: str | None = Field(description="Null if the plan is not a replan.")
    freeze_until: Instant | None
    changed_share: float = Field(
        description="Share of the parent's actions after the freeze that were moved or removed."
    )
    forced_share: float = Field(description="Share of the same actions: lost in any plan.")
    items: tuple[PlanChangeItem, ...]
