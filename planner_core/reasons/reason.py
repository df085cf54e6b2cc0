"""The outcome of a target, and the reason if it is left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

Outcome = Literal["downlinked", "collected", "unscheduled", "excluded"]
ReasonCode = Literal[
    "no_access", "excluded", "outage", "slew_conflict", "displaced_by", "battery", "recorder",
    "not_considered", "not_delivered", "solver_limit",
]  # fmt: skip
Certainty = Literal["proven", "verified", "heuristic"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A change with which a target would be in the plan; it has been tried.

    Attributes
    ----------
    opportunity
        The opportunity that could then be taken.
    satellite, settings
        Settings of that satellite (``slew_rate_deg_s``, ``settle_s``,
        ``battery_min_fraction``, ``recorder_max_fraction``) and values that just suffice.
        None and empty if actions have to be dropped instead.
    drop
        Positions in ``plan.actions`` of the actions that have to be dropped.
    """

    opportunity: int
    satellite: int | None = None
    settings: Mapping[str, float] = field(default_factory=dict)
    drop: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason:
    """Why a target is left out.

    Attributes
    ----------
    blocking
        Positions in ``plan.actions`` of the actions in its way.
    opportunity
        The opportunity that the reason is about, if it is about one.
    at_s
        When a limit would break, if one would.
    reward_delta
        How much more the plan would earn with the target and without the blocking actions.
    change
        The smallest change that lets the target in, among those tried.
    """

    code: ReasonCode
    certainty: Certainty
    detail: str
    blocking: tuple[int, ...] = ()
    opportunity: int | None = None
    at_s: float | None = None
    reward_delta: float | None = None
    change: Change | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetOutcome:
    """What became of one target; ``position`` is that of the action that collected it."""

    target: int
    outcome: Outcome
    position: int | None
    satellite: int | None
    reason: Reason | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """What is known about the search that made a plan.

    Attributes
    ----------
    is_optimal
        Whether it is proven that no plan earns more.
    breadth
        The most tasks that it considered in each state; None for all.
    contact_above
        How full the recorder had to be for contacts to be considered.
    """

    is_optimal: bool = False
    breadth: int | None = None
    contact_above: float = 0.0


UNKNOWN_SEARCH: Final = Search()
