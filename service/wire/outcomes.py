"""The outcome of each target, and the reasons."""

from __future__ import annotations

from pydantic import Field

from service.wire.base import Instant, Json, Open, Wire
from service.wire.timelines import Outcome, ViolationOut


class ReasonOut(Wire):
    """Why a target is not collected."""

    code: str
    certainty: str = Field(description="`proven`, `verified` or `heuristic`; more may be added.")
    blocking_actions: tuple[str, ...] = Field((), description="Ids of the actions in its way.")
    opportunity_id: str | None = Field(None, description="The opportunity that comes closest.")
    at: Instant | None = None
    reward_delta: float | None = Field(
        None, description="Extra reward if the opportunity replaced those actions."
    )
    change: Json | None = Field(
        None, description="The cheapest change that would allow it, as `relax` of a what-if."
    )
    detail: str = ""


class TargetItem(Wire):
    """The outcome of one target."""

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
        description="Violations that adding it to the plan would cause."
    )
    displaces: tuple[str, ...] = Field(
        description="Ids of the actions that must be removed for it; if `ruled_out`, those of the "
        "pinned actions in its way."
    )
    fits_instead: bool = Field(description="Whether the plan is valid with it instead of those.")
    reward_delta: float | None = Field(description="Extra reward of that plan.")
    ruled_out: bool = Field(description="Whether a pin or an outage rules it out.")


class ExplanationOut(TargetItem):
    """The outcome of a target, and of each of its opportunities."""

    opportunities: tuple[AttemptOut, ...] = Field(
        description="In order of time; empty if the target is collected."
    )
    access_changes: tuple[Json, ...] = Field(
        description="For a target without access: changes that would each give it one, in the "
        "form of `relax` of a what-if."
    )
