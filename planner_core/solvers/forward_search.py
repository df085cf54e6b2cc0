"""Forward search (Alg. 1): look a few actions ahead, take the best first one, repeat.

``select_action`` follows the listing; ``_select_action`` is the same search compiled, which
``ForwardSearch`` runs. Tests compare the two.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from planner_core.budget import Budget
from planner_core.bundles import bundle
from planner_core.certified.lns.search import polished
from planner_core.jit import borrowing
from planner_core.mdp.actions import is_repeated, may_wait, next_action
from planner_core.mdp.model import (
    IMAGE_NEEDS,
    WAIT,
    Guidance,
    Model,
    State,
    counts_as_made,
    task_reward,
)
from planner_core.mdp.resource_columns import take
from planner_core.mdp.track import NO_TASK, Track
from planner_core.problem import (
    Bytes,
    Floats,
    Ints,
    Problem,
)
from planner_core.solvers.base import (
    BreadthCounts,
    Constraint,
    ContactCounts,
    Feasibility,
    ImageNeeds,
    Outlook,
    Solution,
)
from planner_core.solvers.priced import better_of
from planner_core.solvers.sequential import Subproblem, plan_in_turn
from planner_core.solvers.walk import contact_above_metadata

Discount = Literal["action", "next_action"]

NOTHING = -2
"""No action is left in this state."""


def select_action(
    model: Model, state: State, depth: int, breadth: int, discount: Discount = "action"
) -> tuple[int, float]:
    """Return the best first action and its value: SELECTACTION of Alg. 1.

    Ties go to the earliest action. ``NOTHING`` if A(s) is empty.
    """
    if depth == 0:
        return NOTHING, 0.0
    gamma = model.guidance.gamma
    best, v_best = NOTHING, -np.inf
    actions = model.actions(state, breadth)
    for a in actions:
        step = model.step(state, a, actions[0])
        a_next, v_next = select_action(model, step.state, depth - 1, breadth, discount)
        waited_s = step.sojourn_s
        if discount == "next_action" and a_next != NOTHING:
            row = model.actions(step.state, breadth)[0] if a_next == WAIT else a_next
            waited_s = float(model.track.start_s[row]) - model.now_s(state)
        # Line 9: v <- R(s, a) + gamma^(a.t_s - s.t) v'. The end of the horizon is worth 0,
        # not the listing's -infinity, which would forbid every path to it.
        v = step.reward + gamma**waited_s * (v_next if v_next > -np.inf else 0.0)
        if v > v_best:
            best, v_best = a, v
    return best, v_best


@bundle
class Rules(NamedTuple):
    """The parameters of the search, as kernels take them."""

    breadth: int
    is_hard: bool
    unimaged_only: bool
    is_discounted_by_next: bool
    contact_above: float


@bundle
class Search(NamedTuple):
    """What a search reads and changes while it runs.

    Attributes
    ----------
    worth
        Of each task. Shape ``(m,)``.
    collected
        1 for targets that are imaged already. Shape ``(num_targets,)``.
    chosen
        Buffer for the tasks of A(s) at each depth. Shape ``(depth * breadth,)``.
    """

    track: Track
    guidance: Guidance
    rules: Rules
    worth: Floats
    collected: Bytes
    chosen: Ints
    stop: Bytes


@borrowing
def _select_action(
    search: Search, cursor: int, last: int, battery: float, recorder: float, depth: int
) -> tuple[int, float, int]:
    """Return the best action, its value, and the first row of A(s); see ``select_action``."""
    track, guidance, rules = search.track, search.guidance, search.rules
    worth, collected, chosen = search.worth, search.collected, search.chosen
    m = len(track.start_s)
    best, v_best, first = NOTHING, -np.inf, m
    if depth == 0:
        return best, 0.0, first
    now_s = track.start_s[cursor] if cursor >= 0 else 0.0
    row = cursor
    begin = end = (depth - 1) * rules.breadth
    while end < begin + rules.breadth:
        row = next_action(
            track, last, row + 1, battery, recorder, rules.is_hard, collected,
            rules.unimaged_only, rules.contact_above,
        )  # fmt: skip
        if row == m or search.stop[0]:
            break
        if is_repeated(track, chosen, begin, end, row):
            continue
        chosen[end] = row
        end += 1
        first = min(first, row)
        battery_after, recorder_after = battery, recorder
        if track.use_resources:
            battery_after, recorder_after, _ = take(track.resources, last, row, battery, recorder)
        waited_s = track.start_s[row] - now_s
        discount = guidance.gamma**waited_s
        v = task_reward(
            track, guidance, worth, collected, waited_s, discount,
            row, battery_after, recorder_after,
        )  # fmt: skip
        if depth > 1:
            site = track.site[row]
            is_new = (
                not track.is_contact[row]
                and not collected[site]
                and counts_as_made(track, guidance, battery_after, recorder_after)
            )
            if is_new:
                collected[site] = 1
            a_next, v_next, first_next = _select_action(
                search, row, row, battery_after, recorder_after, depth - 1
            )
            if is_new:
                collected[site] = 0
            if rules.is_discounted_by_next and a_next != NOTHING:
                row_next = first_next if a_next == WAIT else a_next
                discount = guidance.gamma ** (track.start_s[row_next] - now_s)
            if v_next > -np.inf:
                v += discount * v_next
        if v > v_best:
            best, v_best = row, v
    if first == m or not track.use_resources:
        return best, v_best, first
    if may_wait(track, last, first, battery, recorder, rules.is_hard):
        waited_s = track.start_s[first] - now_s
        v = guidance.sunpoint_reward_per_s * waited_s
        if depth > 1:
            a_next, v_next, first_next = _select_action(
                search, first, last, battery, recorder, depth - 1
            )
            if rules.is_discounted_by_next and a_next != NOTHING:
                row_next = first_next if a_next == WAIT else a_next
                waited_s = track.start_s[row_next] - now_s
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
    about: ClassVar[str] = "Looks a few actions ahead at each step and takes the best first one."
    paper: ClassVar[str] = "Algorithm 1, section Solution Methods"
    exact: ClassVar[bool] = False
    bounds: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    depth: int = field(
        default=3,
        metadata={"minimum": 1, "maximum": 100, "description": "How many actions to look ahead."},
    )
    breadth: int = field(
        default=3,
        metadata={
            "minimum": 1,
            "maximum": 1000,
            "description": "How many of the next images and contacts are tried at each step, "
            "besides sun-pointing if resources count.",
        },
    )
    gamma: float = field(
        default=0.9995,
        metadata={
            "exclusiveMinimum": 0,
            "maximum": 1,
            "description": "Discount factor for each second: how much less later images count.",
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
            "description": "Leave out targets that are imaged already; "
            "the paper keeps offering them."
        },
    )
    breadth_counts: BreadthCounts = field(
        default="tasks",
        metadata={
            "description": "tasks: breadth tasks are tried (the paper); "
            "one_more: breadth + 1 tasks (the authors' code, which stops one task too late)."
        },
    )
    discount: Discount = field(
        default="action",
        metadata={
            "description": "The start to which the value after an action is discounted. action: "
            "its own (the paper); next_action: the best next action's (the authors' code)."
        },
    )
    contact_counts: ContactCounts = field(
        default="duration",
        metadata={
            "description": "Which seconds contact_reward_per_s counts. duration: of the contact "
            "(the authors' code); wait: until the contact starts (the paper's equation)."
        },
    )
    image_needs: ImageNeeds = field(
        default="nothing",
        metadata={
            "description": "What an image needs to count as taken. nothing; limits: battery and "
            "recorder within limits after it (the paper); room: room on board (the authors' "
            "code). Matters only if feasibility is penalty."
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
    contact_above_fraction: float = field(
        default=0.0,
        metadata=contact_above_metadata(
            "0 (the paper's) tries every contact: with few targets the search goes from "
            "contact to contact. With many stations 0.45 takes far more images."
        ),
    )
    penalty: float = field(
        default=1e4,
        metadata={"minimum": 0, "description": "Guidance lost for each broken limit (Table 2)."},
    )

    window_moves_per_task: float = field(
        default=0.5,
        metadata={
            "minimum": 0,
            "maximum": 1000,
            "description": "Moves of a large neighbourhood search on the finished plan, for each "
            "access; without resources only. The paper has none.",
        },
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions it considers."""
        return Outlook(breadth=self.breadth, contact_above=self.contact_above_fraction)

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one whatever the seed."""
        guidance = self.guidance

        def plan_one(subproblem: Subproblem) -> list[int]:
            fresh = replace(subproblem, collected=subproblem.collected.copy())
            rows = self._plan_turn(
                subproblem, problem.worth[subproblem.satellite.rows], guidance, budget
            )
            if self.feasibility == "penalty" or budget.is_spent():
                return rows
            return better_of(problem, fresh, rows, looks_ahead=True)

        solution = plan_in_turn(problem, budget, plan_one)
        return polished(problem, solution, self.window_moves_per_task, budget)

    @property
    def guidance(self) -> Guidance:
        """The weights of Table 2 that steer the search."""
        return Guidance(
            gamma=self.gamma,
            contact_reward_per_s=self.contact_reward_per_s,
            sunpoint_reward_per_s=self.sunpoint_reward_per_s,
            penalty=self.penalty,
            is_contact_by_wait=self.contact_counts == "wait",
            image_needs=IMAGE_NEEDS.index(self.image_needs),
        )

    def _plan_turn(
        self, subproblem: Subproblem, worth: Floats, guidance: Guidance, budget: Budget
    ) -> list[int]:
        track, collected = subproblem.track, subproblem.collected
        cursor, last = NO_TASK, NO_TASK
        battery, recorder = track.resources.battery_start, track.resources.recorder_start
        breadth = self.breadth + (self.breadth_counts == "one_more")
        rules = Rules(
            breadth=breadth,
            is_hard=self.feasibility == "hard",
            unimaged_only=self.unimaged_only,
            is_discounted_by_next=self.discount == "next_action",
            contact_above=self.contact_above_fraction,
        )
        chosen = np.empty(self.depth * breadth, dtype=np.int32)
        search = Search(track, guidance, rules, worth, collected, chosen, budget.stop)
        taken: list[int] = []
        reward = 0.0
        while not budget.is_spent():
            action, _, first = _select_action(search, cursor, last, battery, recorder, self.depth)
            # A search that was stopped half way has not compared all its actions.
            if action == NOTHING or budget.is_spent():
                break
            if action == WAIT:
                cursor = first
                continue
            if track.use_resources:
                battery, recorder, _ = take(track.resources, last, action, battery, recorder)
            cursor = last = action
            taken.append(action)
            site = track.site[action]
            if (
                not track.is_contact[action]
                and not collected[site]
                and (
                    self.image_needs == "nothing"
                    or counts_as_made(track, guidance, battery, recorder)
                )
            ):
                collected[site] = 1
                reward += float(worth[action])
            subproblem.report((action + 1) / len(track.start_s), reward)
        return taken
