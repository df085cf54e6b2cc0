"""What became of each target, and why."""

from __future__ import annotations

from pydantic import Field

from service.wire.base import Instant, Json, Open, Wire
from service.wire.timelines import Outcome, ViolationOut


class ReasonOut(Wire):
    """Why a target is not collected."""

    code: str
    certainty: str = Field(description="`proven`, `verified` or `heuristic`; more may be added.")
    blocking_actions: tuple[str, ...] = Field((), description="Ids of the actions in its way.")
    opportunity_id: str | None = Field(None, description="The one that comes closest.")
    at: Instant | None = None
    reward_delta: float | None = Field(
        None, description="What the plan would earn more with it in place of those actions."
    )
    change: Json | None = Field(
        None, description="The cheapest that would let it in, as `relax` of a what-if takes it."
    )
    detail: str = ""


class TargetItem(Wire):
    """What became of one target."""

    target_id: str
    target_name: str | None = None
    target_catalog_id: str | None = None
    outcome: Open[Outcome]
    action_id: str | None = None
    satellite_id: str | None = None
    satellite_name: str | None = None
    worth: float | None = Field(None, description="What the plan earns for it.")
    reason: ReasonOut | None = Field(None, description="Why it is not collected.")


class AttemptOut(Wire):
    """One opportunity of the target, tried in the plan by the referee."""

    opportunity_id: str
    satellite_id: str
    satellite_name: str | None = None
    start: Instant
    end: Instant
    violations: tuple[ViolationOut, ...] = Field(
        description="What the plan with it breaks, and did not break before."
    )
    displaces: tuple[str, ...] = Field(
        description="Ids of the actions that have to go for it; of a pinned opportunity's rivals "
        "where `ruled_out`."
    )
    fits_instead: bool = Field(description="The plan with it and without those is valid.")
    reward_delta: float | None = Field(description="What that plan earns more.")
    ruled_out: bool = Field(description="A pin or an outage rules it out.")


class ExplanationOut(TargetItem):
    """What became of a target, and what of each of its opportunities."""

    opportunities: tuple[AttemptOut, ...] = Field(
        description="In order of time; none of a target that is collected."
    )
    access_changes: tuple[Json, ...] = Field(
        description="For a target without access: changes that would give it one, each by itself "
        "and in the form that `relax` of a what-if takes."
    )
