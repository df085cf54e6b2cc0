"""Why a target is not in a plan: first what geometry and pins prove, then what the plan blocks.

For each target left out, each of its opportunities is forced into the final plan, to find what it
displaces, which limit would break and when, and how the reward changes. All targets are treated
at once, with the arithmetic of ``planner_core.mdp.track``; ``at_length`` tries one target's
opportunities with the referee itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.problem import (
    ACCESS_TOO_SHORT,
    BETWEEN_STARTS,
    COLLECT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    OUTSIDE_TIMES,
    WRONG_SENSOR_TYPE,
    Floats,
    Ints,
    Longs,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.reasons.as_flown import as_flown, in_rows_of
from planner_core.reasons.delivery import weighed_by_delivery
from planner_core.reasons.displacing import displace_each
from planner_core.reasons.forcing import (
    FITS,
    Forced,
    PlannedSatellite,
    force_each,
)
from planner_core.reasons.reason import (
    UNKNOWN_SEARCH,
    Change,
    Outcome,
    Reason,
    ReasonCode,
    Search,
    TargetOutcome,
)
from planner_core.reasons.reason_text import ReasonRenderer
from planner_core.referee.timeline import Timeline
from planner_core.worth import gain

NO_ACCESS: Final = {
    NEVER_VISIBLE: "No satellite rises above its horizon during the planning horizon.",
    OUTSIDE_LIMITS: "It is visible, but never within the limits of the sensor and the target.",
    ACCESS_TOO_SHORT: "Every access is shorter than its collect.",
    WRONG_SENSOR_TYPE: "Satellites rise above its horizon, but none with its sensor type.",
    OUTSIDE_TIMES: "It has accesses, but none with room for its collect between its release and "
    "due times.",
    BETWEEN_STARTS: "Its accesses have no room for its collect at any start of the grid.",
}
_EXCLUDED: Final = "A pin forbids it."
_BLOCKED: Final = "Pins rule out all its opportunities."
_OUT: Final = "Outages rule out all its opportunities."
_TOO_SOON: Final = (
    "Each of its opportunities begins before a satellite can turn to it from its initial attitude."
)
_ROUNDED: Final = 1e4  # fractions of capacity are stated in steps of one in this many
_SURE: Final = 2e-9  # of capacity: a margin so that a stated limit is not reached


def explain(
    problem: Problem, plan: Plan, timeline: Timeline, search: Search = UNKNOWN_SEARCH
) -> tuple[TargetOutcome, ...]:
    """Return each target's outcome, in order, with a true reason if it is left out."""
    before = {image.target: image for image in timeline.brought_down}
    reasons = _settled_reasons(problem, plan, timeline)
    left = [
        target
        for target in range(len(problem.target_ids))
        if target not in timeline.collected and target not in reasons and target not in before
    ]
    targets = np.array(left, dtype=np.int64)
    if problem.pointing is None:
        reasons |= _forced_reasons(problem, plan, timeline, search, targets)
    elif left:
        made, flown = as_flown(problem, plan, targets)
        found = _forced_reasons(made.problem, flown, timeline, search, targets)
        reasons |= {target: in_rows_of(made.source, reason) for target, reason in found.items()}
    if problem.counts_delivery:
        reasons = weighed_by_delivery(problem, plan, timeline, reasons)
    outcomes = []
    for target in range(len(problem.target_ids)):
        if target in before:
            outcomes.append(_imaged_before(problem, timeline, target))
            continue
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


def _imaged_before(problem: Problem, timeline: Timeline, target: int) -> TargetOutcome:
    """Return the outcome of a target with an image from before the horizon."""
    images = [image for image in timeline.brought_down if image.target == target]
    is_down = problem.use_resources and any(
        image.delivered_s is not None or problem.on_board[image.image].amount == 0.0
        for image in images
    )
    return TargetOutcome(
        target=target,
        outcome="downlinked" if is_down else "collected",
        position=None,
        satellite=images[0].satellite,
        reason=None,
    )


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
        target = int(problem.opportunities.site[row])
        if problem.opportunities.kind[row] == COLLECT and target not in timeline.collected:
            reasons[target] = _broken(position, row, code)
    return reasons


def _without_opportunity(problem: Problem, positions: Mapping[int, int], target: int) -> Reason:
    if target in problem.pinned.forbidden:
        return Reason(code="excluded", certainty="proven", detail=_EXCLUDED)
    detail = NO_ACCESS.get(int(problem.target_access[target]))
    if detail is not None:
        return Reason(code="no_access", certainty="proven", detail=detail)
    ruled_out = problem.pinned.ruled_out.get(target, ())
    if ruled_out and all(each.why == "outage" for each in ruled_out):
        return Reason(code="outage", certainty="proven", detail=_OUT)
    if ruled_out and all(each.why == "heading" for each in ruled_out):
        return Reason(code="slew_conflict", certainty="proven", detail=_TOO_SOON)
    kept = {row for each in ruled_out for row in each.kept}
    if not kept:
        return Reason(code="excluded", certainty="proven", detail=_BLOCKED)
    return Reason(
        code="slew_conflict",
        certainty="proven",
        detail="Each of its opportunities lies too close to an action that a pin keeps, or in an "
        "interval that a pin blocks.",
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
    """Return what the plan would lose without each of its actions."""
    table = problem.opportunities
    earned = np.zeros(len(plan.actions))
    images: dict[int, list[int]] = {}
    for position, action in enumerate(plan.actions):
        if table.kind[action.opportunity] == COLLECT:
            images.setdefault(int(table.site[action.opportunity]), []).append(position)
    for target, collected in timeline.collected.items():
        # Another image of it would count instead.
        others = [p for p in images[target] if p != collected.position]
        rows = [plan.actions[p].opportunity for p in others]
        earned[collected.position] = gain(collected.worth, problem.worth[rows])
    return earned


class _Tried(NamedTuple):
    """All opportunities of the given targets, target after target; shape ``(n,)``.

    Those of target ``i`` begin at ``first[i]``; shape ``(num_targets + 1,)``.
    """

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
    chosen = _chosen(tried, problem.worth)
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
        renderer = ReasonRenderer(problem, one, forced, displaced, search)
        for c, at in enumerate(own):
            target = int(targets[at])
            row = int(tried.rows[picked[c]])
            reasons[target] = renderer.reason(c, target, row, changes.smallest(int(at)))
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


def _chosen(tried: _Tried, worth: Floats) -> Longs:
    """Return for each target the opportunity that comes closest to fitting, for its reason.

    One that fits comes first, then one that only a limit keeps out, then the least loss of reward.
    """
    forced = tried.forced
    is_free = forced.first == forced.last
    rank = np.where(is_free, 0, 2) + (forced.broken != FITS)
    rank[np.isinf(forced.loss)] = 4
    return _first_of_each(tried.first, forced.loss - worth[tried.rows], rank)


def _first_of_each(first: Longs, *keys: npt.NDArray[np.generic]) -> Longs:
    """Return the first of each group, sorted by the last key, then by the one before it."""
    group = np.repeat(np.arange(len(first) - 1), np.diff(first))
    return np.lexsort((*keys, group))[first[:-1]]


class _Changes(NamedTuple):
    """For each target the smallest change of settings that would let it in, if there is any.

    ``size`` is relative, and infinite if there is none; shape ``(num_targets,)``.
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
        # Change the limits together, or the one setting of agility that changes less.
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
