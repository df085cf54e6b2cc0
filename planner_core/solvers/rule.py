"""The rule-based planner (Alg. 4): take the next task in time if resources allow."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from planner_core.jit import kernel
from planner_core.model import NO_TASK, Track, is_safe, next_action, take
from planner_core.problem import Bytes, Ints, Problem
from planner_core.solvers.base import Budget, Constraint, Feasibility, Solution
from planner_core.solvers.sequential import Turn, plan_in_turn


@kernel
def naive_select_action(
    track: Track,
    collected: Bytes,
    is_hard: bool,
    unimaged_only: bool,
    contact_above: float,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
) -> int:
    """Return the row that NAIVESELECTACTION takes next, or ``m`` when none is left.

    Tasks that it refuses are what it sun-points through. The limits are those of the text
    (battery above its minimum, recorder not above its maximum) in the soft form, and those
    of the plan model in the hard form.
    """
    m = len(track.start_s)
    row = cursor
    while row < m:
        row = next_action(
            track, last, row + 1, battery, recorder, is_hard, collected, unimaged_only
        )
        if row == m or not track.use_resources:
            break
        battery_after, recorder_after, _ = take(track, last, row, battery, recorder)
        if battery_after <= track.battery_min or recorder_after > track.recorder_max:
            continue
        # A contact that is not worth it yet may pass, unless the recorder cannot do without.
        may_pass = track.is_contact[row] and recorder < contact_above
        if may_pass and (not track.is_guarded or is_safe(track, last, row, battery, recorder)):
            continue
        break
    return row


@kernel
def rule_plan(
    track: Track, collected: Bytes, is_hard: bool, unimaged_only: bool, contact_above: float
) -> Ints:
    """Return the rows that RULEBASEDPLANNER takes from the start to the end of the horizon.

    Marks the targets it takes in ``collected``.
    """
    m = len(track.start_s)
    rows = np.empty(m, dtype=np.int32)
    count = 0
    last = NO_TASK
    battery, recorder = track.battery_start, track.recorder_start
    row = naive_select_action(
        track, collected, is_hard, unimaged_only, contact_above, last, last, battery, recorder
    )
    while row < m:
        if track.use_resources:
            battery, recorder, _ = take(track, last, row, battery, recorder)
        if not track.is_contact[row]:
            collected[track.place[row]] = 1
        rows[count] = row
        count += 1
        last = row
        row = naive_select_action(
            track, collected, is_hard, unimaged_only, contact_above, row, last, battery, recorder
        )
    return rows[:count]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """Take the next feasible task in time; sun-point through those that resources forbid."""

    name: ClassVar[str] = "rule"
    title: ClassVar[str] = "Rule-based planner"
    paper: ClassVar[str] = "Algorithm 4, section Rule-Based Planning"
    exact: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    unimaged_only: bool = field(
        default=True,
        metadata={
            "description": "Skip targets that are already imaged; the paper's listing does not."
        },
    )
    contact_above_fraction: float = field(
        default=0.45,
        metadata={
            "minimum": 0,
            "maximum": 1,
            "description": "Take a contact only when the recorder is at least this full. "
            "The paper's rule is 0, every contact, which costs images.",
        },
    )
    feasibility: Feasibility = field(
        default="hard",
        metadata={
            "description": "hard: only actions that keep every limit to the end of the horizon; "
            "penalty: the listing's own test at each action."
        },
    )

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one whatever the seed."""

        def plan_turn(turn: Turn) -> list[int]:
            before = turn.collected.copy()
            rows = rule_plan(
                turn.track,
                turn.collected,
                self.feasibility == "hard",
                self.unimaged_only,
                self.contact_above_fraction,
            )
            turn.report(1.0, float(problem.target_reward[turn.collected > before].sum()))
            return [int(row) for row in rows]

        return plan_in_turn(problem, budget, plan_turn)
