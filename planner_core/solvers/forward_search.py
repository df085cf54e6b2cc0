"""Forward search (Alg. 1): look a few actions ahead, take the best first one, repeat.

``select_action`` is the listing as one reads it; ``_select_action`` is the same search compiled,
which ``ForwardSearch`` runs. Tests compare the two.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from planner_core.jit import borrowing
from planner_core.model import (
    NO_TASK,
    WAIT,
    Guidance,
    Model,
    State,
    Track,
    may_wait,
    next_action,
    take,
    task_reward,
)
from planner_core.problem import Bytes, Floats, Problem
from planner_core.solvers.base import Budget, Constraint, Feasibility, Solution
from planner_core.solvers.sequential import Turn, plan_in_turn

NOTHING = -2
"""No action is left in this state."""


def select_action(model: Model, state: State, depth: int, breadth: int) -> tuple[int, float]:
    """Return the best first action and its value: SELECTACTION of Alg. 1.

    Ties go to the earliest action. ``NOTHING`` where A(s) is empty.
    """
    if depth == 0:
        return NOTHING, 0.0
    gamma = model.guidance.gamma
    best, v_best = NOTHING, -np.inf
    actions = model.actions(state, breadth)
    for a in actions:
        step = model.step(state, a, actions[0])
        _, v_next = select_action(model, step.state, depth - 1, breadth)
        # Line 9: v <- R(s, a) + gamma^(a.t_s - s.t) v'. The end of the horizon is worth 0,
        # not the listing's -infinity, which would forbid every path to it.
        v = step.reward + gamma**step.sojourn_s * (v_next if v_next > -np.inf else 0.0)
        if v > v_best:
            best, v_best = a, v
    return best, v_best


@borrowing
def _select_action(
    track: Track,
    guidance: Guidance,
    target_reward: Floats,
    collected: Bytes,
    is_hard: bool,
    unimaged_only: bool,
    breadth: int,
    stop: Bytes,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
    depth: int,
) -> tuple[int, float, int]:
    """Return the best action, its value, and the first row of A(s); see ``select_action``."""
    m = len(track.start_s)
    best, v_best, first = NOTHING, -np.inf, m
    if depth == 0:
        return best, 0.0, first
    now_s = track.start_s[cursor] if cursor >= 0 else 0.0
    row = cursor
    for _ in range(breadth):
        row = next_action(
            track, last, row + 1, battery, recorder, is_hard, collected, unimaged_only
        )
        if row == m or stop[0]:
            break
        first = min(first, row)
        battery_after, recorder_after = battery, recorder
        if track.use_resources:
            battery_after, recorder_after, _ = take(track, last, row, battery, recorder)
        discount = guidance.gamma ** (track.start_s[row] - now_s)
        v = task_reward(
            track, guidance, target_reward, collected, discount, row, battery_after, recorder_after
        )
        if depth > 1:
            place = track.place[row]
            is_new = not track.is_contact[row] and not collected[place]
            if is_new:
                collected[place] = 1
            _, v_next, _ = _select_action(
                track, guidance, target_reward, collected, is_hard, unimaged_only, breadth,
                stop, row, row, battery_after, recorder_after, depth - 1,
            )  # fmt: skip
            if is_new:
                collected[place] = 0
            if v_next > -np.inf:
                v += discount * v_next
        if v > v_best:
            best, v_best = row, v
    if first == m or not track.use_resources:
        return best, v_best, first
    if may_wait(track, last, first, battery, recorder, is_hard):
        waited_s = track.start_s[first] - now_s
        v = guidance.sunpoint_reward_per_s * waited_s
        if depth > 1:
            _, v_next, _ = _select_action(
                track, guidance, target_reward, collected, is_hard, unimaged_only, breadth,
                stop, first, last, battery, recorder, depth - 1,
            )  # fmt: skip
            if v_next > -np.inf:
                v += guidance.gamma**waited_s * v_next
        if v > v_best:
            best, v_best = WAIT, v
    return best, v_best, first


@dataclass(frozen=True, slots=True, kw_only=True)
class ForwardSearch:
    """Search every sequence of ``depth`` actions from each state, keep the best first one.

    Attributes are the parameters of the API; ``gamma`` discounts per second (Table 2).
    """

    name: ClassVar[str] = "forward_search"
    title: ClassVar[str] = "SMDP forward search"
    paper: ClassVar[str] = "Algorithm 1, section Solution Methods"
    exact: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    depth: int = field(
        default=3,
        metadata={"minimum": 1, "maximum": 100, "description": "Actions to look ahead (d_solve)."},
    )
    breadth: int = field(
        default=3,
        metadata={
            "minimum": 1,
            "maximum": 1000,
            "description": "Tasks tried in each state, the first in time (N_a max); "
            "sun-pointing comes on top where resources count.",
        },
    )
    gamma: float = field(
        default=0.9995,
        metadata={
            "exclusiveMinimum": 0,
            "maximum": 1,
            "description": "Discount per second of plan time.",
        },
    )
    feasibility: Feasibility = field(
        default="hard",
        metadata={
            "description": "hard: only actions that keep every limit; "
            "penalty: the paper's soft form, where a broken limit costs reward (Table 2)."
        },
    )
    unimaged_only: bool = field(
        default=True,
        metadata={
            "description": "Leave targets that are already imaged out of A(s); "
            "the paper keeps them in."
        },
    )
    contact_reward_per_s: float = field(
        default=1e-3,
        metadata={
            "minimum": 0,
            "description": "Guidance per second of contact. Table 2 has 0.1, which makes every "
            "contact worth tens of images and costs a tenth of the plan.",
        },
    )
    sunpoint_reward_per_s: float = field(
        default=1e-4,
        metadata={"minimum": 0, "description": "Guidance per second of sun-pointing (Table 2)."},
    )
    penalty: float = field(
        default=1e4,
        metadata={"minimum": 0, "description": "Guidance lost for each broken limit (Table 2)."},
    )

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one whatever the seed."""
        guidance = self.guidance

        def plan_turn(turn: Turn) -> list[int]:
            return self._plan_turn(turn, problem.target_reward, guidance, budget)

        return plan_in_turn(problem, budget, plan_turn)

    @property
    def guidance(self) -> Guidance:
        """Return the weights of Table 2 that steer the search."""
        return Guidance(
            gamma=self.gamma,
            contact_reward_per_s=self.contact_reward_per_s,
            sunpoint_reward_per_s=self.sunpoint_reward_per_s,
            penalty=self.penalty,
        )

    def _plan_turn(
        self, turn: Turn, target_reward: Floats, guidance: Guidance, budget: Budget
    ) -> list[int]:
        track, collected = turn.track, turn.collected
        cursor, last = NO_TASK, NO_TASK
        battery, recorder = track.battery_start, track.recorder_start
        taken: list[int] = []
        reward = 0.0
        while not budget.is_spent():
            action, _, first = _select_action(
                track, guidance, target_reward, collected, self.feasibility == "hard",
                self.unimaged_only, self.breadth, budget.stop,
                cursor, last, battery, recorder, self.depth,
            )  # fmt: skip
            # A search that was stopped half way has not compared all its actions.
            if action == NOTHING or budget.is_spent():
                break
            if action == WAIT:
                cursor = first
                continue
            if track.use_resources:
                battery, recorder, _ = take(track, last, action, battery, recorder)
            cursor = last = action
            taken.append(action)
            place = track.place[action]
            if not track.is_contact[action] and not collected[place]:
                collected[place] = 1
                reward += float(target_reward[place])
            turn.report((action + 1) / len(track.start_s), reward)
        return taken
