"""Monte Carlo tree search (Alg. 2): sample futures, and go where they turn out well."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar, Final, Literal

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.lns.search import polished
from planner_core.mdp.model import (
    IMAGE_NEEDS,
    WAIT,
    Guidance,
    counts_as_made,
)
from planner_core.mdp.track import NO_TASK
from planner_core.problem import Floats, Problem
from planner_core.solvers.base import (
    BreadthCounts,
    Constraint,
    ContactCounts,
    Feasibility,
    ImageNeeds,
    Outlook,
    Solution,
)
from planner_core.solvers.mcts_choices import Rules, step_for
from planner_core.solvers.mcts_simulate import search, sunpoint_instead
from planner_core.solvers.mcts_tree import (
    UNSEEN,
    Tree,
    copy_branch,
    empty_tree,
    new_node,
)
from planner_core.solvers.priced import better_of, with_choices
from planner_core.solvers.sequential import Subproblem, plan_in_turn
from planner_core.solvers.walk import contact_above_metadata

MAX_ACTIONS: Final = 10_000_000
"""Actions in a tree: 20 bytes each, and two trees."""


def _described(text: str, **limits: float) -> dict[str, object]:
    return {**limits, "description": text}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mcts:
    """Sample sequences of actions from each state, steered by upper confidence bounds."""

    name: ClassVar[str] = "mcts"
    title: ClassVar[str] = "SMDP Monte Carlo tree search"
    about: ClassVar[str] = (
        "Samples many futures at each step and follows those that turn out well. Finds better "
        "plans the longer it runs."
    )
    paper: ClassVar[str] = "Algorithm 2, section Solution Methods"
    exact: ClassVar[bool] = False
    bounds: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    num_simulations: int = field(
        default=500,
        metadata=_described(
            "Futures sampled at each step: more of them give better plans, but take longer.",
            minimum=1,
            maximum=1_000_000,
        ),
    )
    depth: int = field(
        default=100,
        metadata=_described(
            "How many actions ahead each sampled future goes.", minimum=1, maximum=1000
        ),
    )
    exploration: float = field(
        default=30.0,
        metadata=_described(
            "How much to try actions that have not turned out well so far: higher explores more.",
            minimum=0,
        ),
    )
    breadth: int = field(
        default=8,
        metadata=_described(
            "How many of the next images and contacts are tried at each step.",
            minimum=1,
            maximum=1000,
        ),
    )
    breadth_counts: BreadthCounts = field(
        default="tasks",
        metadata=_described(
            "tasks: breadth tasks are tried (the paper); one_more: breadth + 1 tasks "
            "(the authors' code, which stops one task too late)."
        ),
    )
    gamma: float = field(
        default=0.9999,
        metadata=_described(
            "Discount factor, applied as discount says: how much less later images count.",
            exclusiveMinimum=0,
            maximum=1,
        ),
    )
    discount: Literal["per_second", "per_decision"] = field(
        default="per_second",
        metadata=_described(
            "per_second: gamma to the power of the elapsed seconds (the paper); "
            "per_decision: gamma once at each action (the authors' code)."
        ),
    )
    returns: Literal["with_reward", "literal"] = field(
        default="with_reward",
        metadata=_described(
            "with_reward: an action's own reward is part of its value; "
            "literal: line 14 of the listing, which leaves it out."
        ),
    )
    backup: Literal["mean", "max"] = field(
        default="max",
        metadata=_described("Value of an action: the mean of its samples (the paper) or the best."),
    )
    rollout: Literal["random", "greedy"] = field(
        default="greedy",
        metadata=_described(
            "random: any possible task (the paper); greedy: what the rule would take."
        ),
    )
    keep_incumbent: bool = field(
        default=True,
        metadata=_described("Follow the best sequence sampled so far; the paper does not."),
    )
    unimaged_only: bool = field(
        default=True,
        metadata=_described(
            "Leave out targets that are imaged already; the paper keeps offering them."
        ),
    )
    feasibility: Feasibility = field(
        default="hard",
        metadata=_described(
            "hard: only actions that keep every limit; "
            "penalty: the paper's soft form, where a broken limit costs reward (Table 2)."
        ),
    )
    worthless: Literal["take", "sunpoint"] = field(
        default="take",
        metadata=_described(
            "What to do when the chosen action's own reward is not positive. take: that action "
            "(the paper); sunpoint: let it pass (the authors' code)."
        ),
    )
    contact_counts: ContactCounts = field(
        default="duration",
        metadata=_described(
            "Which seconds contact_reward_per_s counts. duration: of the contact "
            "(the authors' code); wait: until the contact starts (the paper's equation)."
        ),
    )
    image_needs: ImageNeeds = field(
        default="nothing",
        metadata=_described(
            "What an image needs to count as taken. nothing; limits: battery and recorder "
            "within limits after it (the paper); room: room on board (the authors' code). "
            "Matters only if feasibility is penalty."
        ),
    )
    contact_reward_per_s: float = field(
        default=1e-3,
        metadata=_described("Guidance per second of contact (Table 2: 0.1).", minimum=0),
    )
    sunpoint_reward_per_s: float = field(
        default=1e-4,
        metadata=_described("Guidance per second of sun-pointing (Table 2).", minimum=0),
    )
    penalty: float = field(
        default=1e4,
        metadata=_described("Guidance lost for each broken limit (Table 2).", minimum=0),
    )
    contact_above_fraction: float = field(
        default=0.0,
        metadata=contact_above_metadata(
            "0 (the paper's) tries every contact; greedy rollouts use 0.45 in any case."
        ),
    )

    window_moves_per_task: float = field(
        default=0.5,
        metadata=_described(
            "Moves of a large neighbourhood search on the finished plan, for each access; "
            "without resources only. The paper has none.",
            minimum=0,
            maximum=1000,
        ),
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions it considers."""
        return Outlook(breadth=self.breadth, contact_above=self.contact_above_fraction)

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one for the same seed."""

        def plan_one(subproblem: Subproblem) -> list[int]:
            fresh = replace(subproblem, collected=subproblem.collected.copy())
            rows = self._plan_turn(
                subproblem, problem.worth[subproblem.satellite.rows], budget, seed
            )
            if self.feasibility == "penalty" or budget.is_spent():
                return rows
            return better_of(problem, fresh, rows, looks_ahead=True)

        solution = plan_in_turn(problem, budget, plan_one)
        if self.feasibility == "hard":
            solution = with_choices(problem, solution, budget, seed)
        return polished(problem, solution, self.window_moves_per_task, budget)

    @property
    def _guidance(self) -> Guidance:
        return Guidance(
            gamma=self.gamma,
            contact_reward_per_s=self.contact_reward_per_s,
            sunpoint_reward_per_s=self.sunpoint_reward_per_s,
            penalty=self.penalty,
            is_contact_by_wait=self.contact_counts == "wait",
            image_needs=IMAGE_NEEDS.index(self.image_needs),
        )

    @property
    def _rules(self) -> Rules:
        return Rules(
            depth=self.depth,
            breadth=self.breadth + (self.breadth_counts == "one_more"),
            exploration=self.exploration,
            is_hard=self.feasibility == "hard",
            unimaged_only=self.unimaged_only,
            is_per_decision=self.discount == "per_decision",
            is_literal=self.returns == "literal",
            is_greedy=self.rollout == "greedy",
            is_max_backup=self.backup == "max",
            contact_above=self.contact_above_fraction,
        )

    def _plan_turn(
        self, subproblem: Subproblem, worth: Floats, budget: Budget, seed: int
    ) -> list[int]:
        track, collected = subproblem.track, subproblem.collected
        guidance, rules = self._guidance, self._rules
        # A state stays in the tree for at most ``depth`` steps, which limits the number of nodes.
        # If that is more than memory should hold, the rest is sampled by rollouts alone.
        num_nodes = min(
            self.num_simulations * (self.depth + 1) + 2, MAX_ACTIONS // (rules.breadth + 1)
        )
        num_nodes += rules.breadth + 3
        num_edges = (num_nodes + 2) * (rules.breadth + 1) + 2
        trees = [empty_tree(num_nodes, num_edges) for _ in range(2)]
        tree, spare = trees
        new_node(
            tree, NO_TASK, NO_TASK, track.resources.battery_start, track.resources.recorder_start
        )
        step = step_for(track, rules, guidance, worth, collected, seed)
        taken: list[int] = []
        reward = 0.0
        while not budget.is_spent():
            edge = search(tree, step, self.num_simulations, budget.stop)
            if edge == UNSEEN or budget.is_spent():
                break
            if self.keep_incumbent:
                edge = _edge_of(tree, int(step.best_actions[0]), edge)
            if self.worthless == "sunpoint":
                edge = sunpoint_instead(tree, step, edge)
            action = int(tree.action[edge])
            child = int(tree.child[edge])
            if action != WAIT:
                taken.append(action)
                site = track.site[action]
                levels = float(tree.battery[child]), float(tree.recorder[child])
                if (
                    not track.is_contact[action]
                    and not collected[site]
                    and (self.image_needs == "nothing" or counts_as_made(track, guidance, *levels))
                ):
                    collected[site] = step.successors.imaged[site] = 1
                    reward += float(worth[action])
            step.best[0] = -np.inf
            copy_branch(tree, spare, child)
            tree, spare = spare, tree
            subproblem.report((int(tree.cursor[0]) + 1) / len(track.start_s), reward)
        return taken


def _edge_of(tree: Tree, action: int, otherwise: int) -> int:
    first = int(tree.first_edge[0])
    for edge in range(first, first + int(tree.num_edges[0])):
        if tree.action[edge] == action and tree.visits[edge] > 0:
            return edge
    return otherwise
