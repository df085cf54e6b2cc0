"""Whether battery and recorder can keep their limits with the pins.

Only contacts can help: an image takes energy and memory and gives none back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.errors import InvalidScenario
from planner_core.jit import inner, kernel
from planner_core.mdp.resource_columns import STRICT, ResourceColumns, take
from planner_core.mdp.track import NO_TASK, Track, compile_track
from planner_core.precedence.relation import (
    Precedence,
    comes_before,
    transitive_closure,
)
from planner_core.problem import (
    Bools,
    Floats,
    Kept,
    Longs,
    Pinned,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.sorting import stable_order

# Kept after each task; of more, neighbours are merged into one that is as good as each.
_MAX_STATES: Final = 200


def check_limits(
    problem: Problem,
    ruled_out: Sequence[tuple[str, Longs]],
    asked: Sequence[tuple[Kept, Longs]],
    frozen: Sequence[Kept],
    facts: Bools,
) -> None:
    """Raise if a satellite cannot keep the limits of battery or recorder with the pins.

    Contacts may help. Sharing of antennas between satellites is ignored, except for kept contacts.
    If no plan keeps the limits without pins either, because of outages or frozen actions, pins are
    not to blame.

    Parameters
    ----------
    problem
        The problem with all its opportunities.
    ruled_out
        Pins, and the opportunities that each rules out.
    asked
        Actions that pins keep, and the opportunities that conflict with each.
    frozen
        Actions that are flown whatever is pinned.
    facts
        Opportunities that are not available whatever is pinned. Shape ``(n,)``.

    Raises
    ------
    InvalidScenario
        ``pin_breaks_limits``, with a pointer to the first pin that is one too many.
    """
    if not problem.use_resources:
        return
    asked = sorted(asked, key=lambda pair: pair[0].row)
    for index, satellite in enumerate(problem.satellites):
        own = set(satellite.rows.tolist())
        flown = [kept for kept in frozen if kept.row in own]
        missing = facts.copy()
        for _, rows in ruled_out:
            missing[rows] = True
        for _, excluded in asked:
            missing[excluded] = True
        must = flown + [kept for kept, _ in asked if kept.row in own]
        if can_keep(problem, index, must, missing):
            continue
        missing = facts.copy()
        if not can_keep(problem, index, flown, missing):
            continue
        for pointer, rows in ruled_out:
            missing[rows] = True
            if not can_keep(problem, index, flown, missing):
                raise InvalidScenario(
                    "pin_breaks_limits",
                    "Without the contacts that it and the pins before it rule out, no plan keeps "
                    f"the limits: {_what_breaks(problem, flown)}",
                    pointer=pointer,
                )
        must = flown
        for one, excluded in asked:
            missing[excluded] = True
            must = [*must, one] if one.row in own else must
            if not can_keep(problem, index, must, missing):
                raise InvalidScenario(
                    "pin_breaks_limits",
                    "With it and the kept actions before it, no plan keeps the limits: "
                    + _what_breaks(problem, must),
                    pointer=one.pointer,
                )


def _what_breaks(problem: Problem, kept: Sequence[Kept]) -> str:
    alone = replace(problem, pinned=Pinned())
    timeline = replay(alone, Plan.of(problem, [k.row for k in kept]), in_detail=False)
    broken = [v for v in timeline.violations if v.code in ("battery", "recorder")]
    return broken[0].detail if broken else "Battery or recorder would reach its limit."


def can_keep(problem: Problem, index: int, kept: Sequence[Kept], missing: Bools) -> bool:
    """Return whether a satellite may keep the limits with these and contacts; False is proven.

    Parameters
    ----------
    missing
        Opportunities that are not available. Shape ``(n,)``.
    """
    satellite = problem.satellites[index]
    trial = replace(problem, pinned=Pinned(kept=tuple(kept)))
    track = compile_track(trial, satellite, missing[satellite.rows].astype(np.uint8))
    if track.is_guarded:
        return True
    return _has_way(track, transitive_closure(satellite))


@kernel
def _has_way(track: Track, precedence: Precedence) -> bool:
    """Return whether some fallbacks, together with all kept tasks, keep the limits."""
    num_rows = len(track.fallbacks)
    battery = np.empty((num_rows, _MAX_STATES))
    recorder = np.empty((num_rows, _MAX_STATES))
    num_states = np.zeros(num_rows, dtype=np.int64)
    resources = track.resources
    if track.next_kept[0] == len(track.start_s) and _lasts(
        resources, NO_TASK, resources.recorder_start
    ):
        return True
    for at in range(num_rows):
        row = track.fallbacks[at]
        found = np.empty((1 + at * _MAX_STATES, 2))
        num_found = 0
        if track.next_kept[0] >= row:
            left, filled, is_within = take(
                resources, NO_TASK, row, resources.battery_start, resources.recorder_start
            )
            if is_within:
                found[0] = (left, filled)
                num_found = 1
        for before in range(at - 1, -1, -1):
            last = track.fallbacks[before]
            if track.next_kept[last + 1] < row:
                break
            if not comes_before(precedence, last, row):
                continue
            for state in range(num_states[before]):
                left, filled, is_within = take(
                    resources, last, row, battery[before, state], recorder[before, state]
                )
                if is_within:
                    found[num_found] = (left, filled)
                    num_found += 1
        num_states[at] = _keep_best(found[:num_found], battery[at], recorder[at])
        if track.next_kept[row + 1] < len(track.start_s):
            continue
        for state in range(num_states[at]):
            if _lasts(resources, row, recorder[at, state]):
                return True
    return False


@inner
def _lasts(resources: ResourceColumns, last: int, recorder: float) -> bool:
    """Return whether the recorder has room for the telemetry until the end."""
    data_from_s = resources.data_from_s[last] if last >= 0 else 0.0
    idle_s = max(0.0, resources.data_end_s - data_from_s)
    return recorder + resources.telemetry_per_s * idle_s < resources.recorder_max - STRICT


@kernel
def _keep_best(found: Floats, battery: Floats, recorder: Floats) -> int:
    """Fill in the states that no other state dominates, the emptiest recorder first.

    If there are too many, neighbours are merged into one that has the best of each.
    """
    num_best = 0
    by_recorder = found[stable_order(found[:, 1].copy())]
    for i in range(len(by_recorder)):
        if num_best == 0 or by_recorder[i, 0] > by_recorder[num_best - 1, 0]:
            by_recorder[num_best] = by_recorder[i]
            num_best += 1
    size = 1 + num_best // _MAX_STATES
    num_states = 0
    for first in range(0, num_best, size):
        recorder[num_states] = by_recorder[first, 1]
        battery[num_states] = by_recorder[min(first + size, num_best) - 1, 0]
        num_states += 1
    return num_states
