"""Why a target is not in a plan: first what geometry and pins prove, then what the plan blocks.

For each target left out, each of its opportunities is forced into the final plan: what it
displaces, which limit would break and when, and what that does to the reward. All targets are
done at once, with the arithmetic of ``planner_core.track``; ``planner_core.explanation`` goes
through one target's opportunities with the referee itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.forcing import (
    AT_END,
    BATTERY,
    FITS,
    RECORDER,
    Displaced,
    Forced,
    PlannedSatellite,
    displace_each,
    force_each,
)
from planner_core.model import Guidance, Model, State
from planner_core.plan import Plan
from planner_core.problem import (
    ACCESS_TOO_SHORT,
    COLLECT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    Floats,
    Ints,
    Longs,
    Problem,
)
from planner_core.timeline import Timeline
from planner_core.track import NO_TASK

Outcome = Literal["downlinked", "collected", "unscheduled", "excluded"]
ReasonCode = Literal[
    "no_access", "excluded", "slew_conflict", "displaced_by", "battery", "recorder",
    "not_considered", "solver_limit",
]  # fmt: skip
Certainty = Literal["proven", "verified", "heuristic"]

NO_ACCESS: Final = {
    NEVER_VISIBLE: "No satellite rises above its horizon during the planning horizon.",
    OUTSIDE_LIMITS: "It is visible, but never within the limits of the sensor and its own.",
    ACCESS_TOO_SHORT: "Every access is shorter than its collect.",
}
_EXCLUDED: Final = "A pin forbids it."
_BLOCKED: Final = "Pins rule all its opportunities out."
_ROUNDED: Final = 1e4  # fractions of capacity are stated to as many parts
_SURE: Final = 2e-9  # of capacity: a stated limit is not touched

_LIMITS: Final[dict[int, Literal["battery", "recorder"]]] = {
    BATTERY: "battery", RECORDER: "recorder",
}  # fmt: skip


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
    """

    is_optimal: bool = False
    breadth: int | None = None


UNKNOWN_SEARCH: Final = Search()


def explain(
    problem: Problem, plan: Plan, timeline: Timeline, search: Search = UNKNOWN_SEARCH
) -> tuple[TargetOutcome, ...]:
    """Return every target exactly once, with its outcome and, if left out, a true reason."""
    reasons = _settled_reasons(problem, plan, timeline)
    left = [
        target
        for target in range(len(problem.target_ids))
        if target not in timeline.collected and target not in reasons
    ]
    reasons |= _forced_reasons(problem, plan, timeline, search, np.array(left, dtype=np.int64))
    outcomes = []
    for target in range(len(problem.target_ids)):
        collected, reason = timeline.collected.get(target), reasons.get(target)
        outcome: Outcome = "unscheduled"
        if collected is not None:
            outcome = "downlinked" if collected.is_downlinked else "collected"
        elif reason is not None and reason.code == "excluded":
            outcome = "excluded"
        outcomes.append(
            TargetOutcome(
                target=target,
                outcome=outcome,
                position=None if collected is None else collected.position,
                satellite=None if collected is None else collected.satellite,
                reason=None if collected is not None else reason,
            )
        )
    return tuple(outcomes)


def _settled_reasons(problem: Problem, plan: Plan, timeline: Timeline) -> dict[int, Reason]:
    """Return the reasons that need no trial: pins, geometry, and collects that do not count."""
    reasons: dict[int, Reason] = {}
    positions = {action.opportunity: p for p, action in enumerate(plan.actions)}
    for target in np.flatnonzero(np.diff(problem.target_opportunities[1]) == 0).tolist():
        reasons[target] = _without_opportunity(problem, positions, target)
    blamed = {
        position: violation.code for violation in timeline.violations
        for position in violation.blamed
    }  # fmt: skip
    for position, code in blamed.items():
        row = plan.actions[position].opportunity
        target = int(problem.opportunities.place[row])
        if problem.opportunities.kind[row] == COLLECT and target not in timeline.collected:
            reasons[target] = _broken(position, row, code)
    return reasons


def _without_opportunity(problem: Problem, positions: Mapping[int, int], target: int) -> Reason:
    if target in problem.pinned.forbidden:
        return Reason(code="excluded", certainty="proven", detail=_EXCLUDED)
    detail = NO_ACCESS.get(int(problem.target_access[target]))
    if detail is not None:
        return Reason(code="no_access", certainty="proven", detail=detail)
    kept = {row for struck in problem.pinned.struck.get(target, ()) for row in struck.kept}
    if not kept:
        return Reason(code="excluded", certainty="proven", detail=_BLOCKED)
    return Reason(
        code="slew_conflict",
        certainty="proven",
        detail="Each of its opportunities lies too close to an action that a pin keeps, or in "
        "an interval that one blocks.",
        blocking=tuple(sorted(positions[row] for row in kept if row in positions)),
    )


def _broken(position: int, opportunity: int, code: str) -> Reason:
    """Return the reason of a collect that is in the plan but earns nothing."""
    known: Mapping[str, ReasonCode] = {
        "battery": "battery", "recorder": "recorder", "slew": "slew_conflict",
        "overlap": "slew_conflict",
    }  # fmt: skip
    return Reason(
        code=known.get(code, "solver_limit"),
        certainty="verified",
        detail=f"Its collect is in the plan but does not count: {code} violation.",
        blocking=(position,),
        opportunity=opportunity,
    )


def earned_by(problem: Problem, plan: Plan, timeline: Timeline) -> Floats:
    """Return what the plan loses with each of its actions."""
    table = problem.opportunities
    earned = np.zeros(len(plan.actions))
    images = [
        int(table.place[a.opportunity])
        for a in plan.actions
        if table.kind[a.opportunity] == COLLECT
    ]
    times = np.bincount(images, minlength=len(problem.target_ids))
    for target, collected in timeline.collected.items():
        # Another image of it would count instead.
        if times[target] == 1:
            earned[collected.position] = problem.target_reward[target]
    return earned


class _Tried(NamedTuple):
    """All opportunities of the targets at hand, target after target; shape ``(n,)``."""

    rows: Ints
    first: Longs
    satellite: Ints
    forced: Forced


def _forced_reasons(
    problem: Problem, plan: Plan, timeline: Timeline, search: Search, targets: Longs
) -> dict[int, Reason]:
    if len(targets) == 0:
        return {}
    earned = earned_by(problem, plan, timeline)
    planned = [
        PlannedSatellite.of(problem, plan, index, earned)
        for index in range(len(problem.satellites))
    ]
    tried = _try_all(problem, planned, targets)
    chosen = _chosen(tried)
    changes = _Changes.of(problem, tried)
    satellite = tried.satellite[chosen]
    reasons: dict[int, Reason] = {}
    for one in planned:
        own = np.flatnonzero(satellite == one.index)
        if len(own) == 0:
            continue
        picked = chosen[own]
        forced = Forced._make(column[picked] for column in tried.forced)
        rows = problem.local_row[tried.rows[picked]]
        displaced = displace_each(one, rows, forced)
        teller = _Teller(problem, one, forced, displaced, search)
        for c, at in enumerate(own):
            target = int(targets[at])
            row = int(tried.rows[picked[c]])
            reasons[target] = teller.reason(c, target, row, changes.smallest(int(at)))
    return reasons


def _try_all(problem: Problem, planned: list[PlannedSatellite], targets: Longs) -> _Tried:
    collects, offsets = problem.target_opportunities
    counts = offsets[targets + 1] - offsets[targets]
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    within = np.arange(first[-1]) - np.repeat(first[:-1], counts)
    rows = collects[np.repeat(offsets[targets], counts) + within]
    satellite = problem.opportunities.satellite[rows]
    parts = []
    order = np.argsort(satellite, kind="stable")
    for one in planned:
        own = rows[satellite == one.index]
        parts.append(force_each(problem, one, problem.local_row[own]))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    back = np.empty(len(order), dtype=np.int64)
    back[order] = np.arange(len(order))
    return _Tried(rows, first, satellite, Forced._make(column[back] for column in columns))


def _chosen(tried: _Tried) -> Longs:
    """Return for each target the opportunity that comes closest: the reason speaks of it.

    What fits comes first, then what only a limit keeps out, then what costs least reward.
    """
    forced = tried.forced
    is_free = forced.first == forced.last
    rank = np.where(is_free, 0, 2) + (forced.broken != FITS)
    rank[np.isinf(forced.loss)] = 4
    return _first_of_each(tried.first, forced.loss, rank)


def _first_of_each(first: Longs, *keys: npt.NDArray[np.generic]) -> Longs:
    """Return in each group what comes first by the last key, then the one before it."""
    group = np.repeat(np.arange(len(first) - 1), np.diff(first))
    return np.lexsort((*keys, group))[first[:-1]]


class _Changes(NamedTuple):
    """For each target the smallest change of settings that would let it in, if there is any.

    ``size`` is relative, and infinite where there is none; shape ``(num_targets,)``.
    """

    rows: Ints
    satellite: Ints
    size: Floats
    values: dict[str, Floats]

    @classmethod
    def of(cls, problem: Problem, tried: _Tried) -> _Changes:
        forced, satellite = tried.forced, tried.satellite
        agility = [s.agility for s in problem.satellites]
        resources = [s.resources for s in problem.satellites]
        now = {
            "slew_rate_deg_s": np.array([a.slew_rate_deg_s for a in agility]),
            "settle_s": np.array([a.settle_s for a in agility]),
            "battery_min_fraction": np.array([r.battery_min_fraction for r in resources]),
            "recorder_max_fraction": np.array([r.recorder_max_fraction for r in resources]),
        }
        now = {name: values[satellite] for name, values in now.items()}
        is_free = (forced.first == forced.last) & (forced.broken != FITS)
        lowest = np.floor((forced.lowest - _SURE) * _ROUNDED) / _ROUNDED
        highest = np.ceil((forced.highest + _SURE) * _ROUNDED) / _ROUNDED
        can_be = is_free & (lowest > 0.0) & (highest < 1.0)
        values = {
            "slew_rate_deg_s": forced.rate_deg_s,
            "settle_s": np.floor(forced.settle_s * 1000.0) / 1000.0,
            "battery_min_fraction": np.where(
                can_be & (lowest < now["battery_min_fraction"]), lowest, np.nan
            ),
            "recorder_max_fraction": np.where(
                can_be & (highest > now["recorder_max_fraction"]), highest, np.nan
            ),
        }
        size = {name: np.abs(values[name] / np.maximum(now[name], 1e-9) - 1.0) for name in values}
        # Either agility alone is changed, by the smaller of the two, or the limits together.
        is_settle = np.nan_to_num(size["settle_s"], nan=np.inf) < np.nan_to_num(
            size["slew_rate_deg_s"], nan=np.inf
        )
        values["slew_rate_deg_s"] = np.where(is_settle, np.nan, values["slew_rate_deg_s"])
        values["settle_s"] = np.where(is_settle, values["settle_s"], np.nan)
        stack = np.stack([np.where(np.isnan(values[name]), -np.inf, size[name]) for name in values])
        largest = stack.max(axis=0)
        largest[largest == -np.inf] = np.inf
        best = _first_of_each(tried.first, largest)
        return cls(
            rows=tried.rows[best],
            satellite=satellite[best],
            size=largest[best],
            values={name: column[best] for name, column in values.items()},
        )

    def smallest(self, at: int) -> Change | None:
        """Return the change of one target."""
        if self.size[at] == np.inf:
            return None
        return Change(
            opportunity=int(self.rows[at]),
            satellite=int(self.satellite[at]),
            settings={
                name: float(values[at])
                for name, values in self.values.items()
                if not np.isnan(values[at])
            },
        )


@dataclass(frozen=True, slots=True, kw_only=False, eq=False)
class _Teller:
    """Puts what was tried on one satellite into words."""

    problem: Problem
    planned: PlannedSatellite
    forced: Forced
    displaced: Displaced
    search: Search

    def reason(self, c: int, target: int, opportunity: int, change: Change | None) -> Reason:
        """Return the reason of the target whose opportunity stands at ``c``."""
        sequence = self.planned.sequence
        dropped = np.flatnonzero(self.displaced.dropped[c])
        blocking = tuple(sorted(self.planned.positions[dropped].tolist()))
        limit = _LIMITS.get(int(self.displaced.broken[c]))
        if limit is None and not blocking:
            return self._fitting(c, target, opportunity)
        is_settled = bool(self.displaced.is_settled[c])
        delta = None
        if is_settled:
            delta = float(self.problem.target_reward[target] - sequence.earned[dropped].sum())
            change = change or Change(opportunity=opportunity, drop=blocking)
        return Reason(
            code=self._code(c, limit, delta),
            certainty=self._certainty(delta),
            detail=self._detail(c, limit, delta, len(blocking)),
            blocking=blocking,
            opportunity=opportunity,
            at_s=None if limit is None else self._break_s(c),
            reward_delta=delta,
            change=change,
        )

    def _fitting(self, c: int, target: int, opportunity: int) -> Reason:
        breadth = self.search.breadth
        if self.problem.target_reward[target] == 0.0:
            detail = "The plan has room for it, but it earns nothing."
        elif breadth is not None and not self._is_looked_at(c, opportunity, breadth):
            return Reason(
                code="not_considered",
                certainty="heuristic",
                detail="The plan has room for it, but the search looked at the first "
                f"{breadth} tasks only (breadth), and it was none of those.",
                opportunity=opportunity,
            )
        else:
            detail = "The plan has room for it; the solver did not find this."
        return Reason(
            code="solver_limit", certainty="verified", detail=detail, opportunity=opportunity
        )

    def _is_looked_at(self, c: int, opportunity: int, breadth: int) -> bool:
        """Return whether it is in A(s) after the action of the plan that it would follow."""
        plan, k = self.planned.sequence, int(self.forced.first[c])
        model = Model(
            track=self.planned.track,
            target_reward=self.problem.target_reward,
            guidance=Guidance(1.0, 0.0, 0.0, 0.0),
        )
        last = int(plan.rows[k - 1]) if k else NO_TASK
        images = plan.rows[:k][self.planned.track.is_contact[plan.rows[:k]] == 0]
        state = State(
            cursor=last,
            last=last,
            battery=float(plan.battery[k]),
            recorder=float(plan.recorder[k]),
            collected=frozenset(self.planned.track.place[images].tolist()),
        )
        return int(self.problem.local_row[opportunity]) in model.actions(state, breadth)

    def _code(
        self, c: int, limit: Literal["battery", "recorder"] | None, delta: float | None
    ) -> ReasonCode:
        if delta is not None and delta > 0.0:
            return "solver_limit"
        is_alone = self.forced.first[c] == self.forced.last[c]
        if limit is not None and (is_alone or delta is None):
            return limit
        return "slew_conflict" if delta is None else "displaced_by"

    def _certainty(self, delta: float | None) -> Certainty:
        if not self.planned.is_sound:
            return "heuristic"
        is_weighed = delta is not None and delta <= 0.0
        return "proven" if self.search.is_optimal and is_weighed else "verified"

    def _break_s(self, c: int) -> float:
        row = int(self.displaced.break_row[c])
        track = self.planned.track
        return float(track.data_end_s if row == AT_END else track.start_s[row])

    def _detail(self, c: int, limit: str | None, delta: float | None, num_blocking: int) -> str:
        said = []
        if not self.planned.is_sound:
            said.append("The plan breaks limits of this satellite as it is.")
        if self.forced.first[c] < self.forced.last[c]:
            said.append("The satellite cannot turn in time between it and planned actions.")
        if np.isinf(self.forced.loss[c]):
            said.append("One of those is pinned.")
        if limit is not None:
            said.append(f"With it the {limit} would reach its limit.")
        if delta is not None:
            actions = "1 action" if num_blocking == 1 else f"{num_blocking} actions"
            change = f"changes by {delta:+g}" if delta else "stays the same"
            said.append(f"It fits in place of {actions}; the reward {change}.")
            if self.search.is_optimal and delta <= 0.0:
                said.append("The plan is proven optimal: none with it earns more.")
        return " ".join(said)
