"""What may be said of a target: its outcome, and the reason where it is left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

Outcome = Literal["downlinked", "collected", "unscheduled", "excluded"]
ReasonCode = Literal[
    "no_access", "excluded", "outage", "slew_conflict", "displaced_by", "battery", "recorder",
    "not_considered", "solver_limit",
]  # fmt: skip
Certainty = Literal["proven", "verified", "heuristic"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A change with which a target would be in the plan; it has been tried.

    Attributes
    ----------
    opportunity
        What could then be taken.
    satellite, settings
        Settings of that satellite (``slew_rate_deg_s``, ``settle_s``,
        ``battery_min_fraction``, ``recorder_max_fraction``) and values that just suffice.
        None and none where actions have to be dropped.
    drop
        Positions in ``plan.actions`` of the actions that have to go.
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
        The opportunity that the reason speaks of, where it is one.
    at_s
        When the limit would break, where one would.
    reward_delta
        What the plan would earn more with it and without the blocking actions.
    change
        The smallest change that lets it in, among those tried.
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
    """What is known of the search that made a plan.

    Attributes
    ----------
    is_optimal
        Whether no plan earns more.
    breadth
        How many tasks it looked at in each state at most; None for all.
    contact_above
        How full the recorder was before contacts were among them.
    """

    is_optimal: bool = False
    breadth: int | None = None
    contact_above: float = 0.0


UNKNOWN_SEARCH: Final = Search()
