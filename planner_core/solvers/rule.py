"""The rule-based planner (Alg. 4): take the next task in time if resources allow."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from planner_core.jit import kernel
from planner_core.model import NO_TASK, Track, is_safe, next_action, take
from planner_core.problem import Bytes, Problem
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
        default=0.0,
        metadata={
            "minimum": 0,
            "maximum": 1,
            "description": "Take a contact only when the recorder is at least this full "
            "(0: always, the paper's rule).",
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
            track, collected = turn.track, turn.collected
            last = cursor = NO_TASK
            battery, recorder = track.battery_start, track.recorder_start
            taken: list[int] = []
            reward = 0.0
            while not budget.is_spent():
                row = naive_select_action(
                    track, collected, self.feasibility == "hard", self.unimaged_only,
                    self.contact_above_fraction, cursor, last, battery, recorder,
                )  # fmt: skip
                if row == len(track.start_s):
                    break
                if track.use_resources:
                    battery, recorder, _ = take(track, last, row, battery, recorder)
                cursor = last = row
                taken.append(row)
                place = track.place[row]
                if not track.is_contact[row] and not collected[place]:
                    collected[place] = 1
                    reward += float(problem.target_reward[place])
                turn.report((row + 1) / len(track.start_s), reward)
            return taken

        return plan_in_turn(problem, budget, plan_turn)
