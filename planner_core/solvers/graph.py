"""Graph search (Alg. 3): the longest path through all collects that may follow each other.

The path knows agility alone. Where resources count, what it proposes is then walked through
in order, and only what keeps the limits is taken (``feasibility``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from planner_core.chains import chain_to, longest_chain, longest_chain_with_history
from planner_core.model import NO_TASK, Track
from planner_core.problem import Floats, Problem
from planner_core.solvers.base import Budget, Constraint, Feasibility, Solution
from planner_core.solvers.sequential import Turn, plan_in_turn
from planner_core.solvers.walk import CONTACT_ABOVE, NOTHING_TAKEN, rule_plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Graph:
    """Take the heaviest chain of collects."""

    name: ClassVar[str] = "graph"
    title: ClassVar[str] = "Graph search"
    paper: ClassVar[str] = "Algorithm 3, section Graph Search"
    exact: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset({Constraint.SLEW, Constraint.STATION})

    path: Literal["history", "longest"] = field(
        default="history",
        metadata={
            "description": "history: no target twice on a path (the authors' code); "
            "longest: the listing, which counts a target at each of its collects."
        },
    )
    feasibility: Feasibility = field(
        default="hard",
        metadata={
            "description": "hard: walk along the path and take what keeps battery and recorder, "
            "and contacts as they come; "
            "penalty: the path as it is, whatever it does to them."
        },
    )
    contact_above_fraction: float = field(
        default=CONTACT_ABOVE,
        metadata={
            "minimum": 0,
            "maximum": 1,
            "description": "On the walk, take a contact only when the recorder is this full.",
        },
    )

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one whatever the seed."""

        def plan_turn(turn: Turn) -> list[int]:
            track = turn.track
            is_wanted = (track.is_contact == 0) & (turn.collected[track.place] == 0)
            weight = np.where(is_wanted, problem.target_reward[track.place], 0.0)
            path = self._path(track, weight)
            if problem.use_resources and self.feasibility == "hard":
                off_path = track.is_contact == 0
                off_path[path] = False
                narrowed = track._replace(blocked=track.blocked | off_path.astype(np.uint8))
                rows = rule_plan(
                    narrowed, turn.collected, True, True, self.contact_above_fraction, NOTHING_TAKEN
                )
                path = [int(row) for row in rows]
            turn.report(1.0, float(weight[path].sum()))
            return path

        return plan_in_turn(problem, budget, plan_turn)

    def _path(self, track: Track, weight: Floats) -> list[int]:
        before = np.full(len(weight), NO_TASK, dtype=np.int32)
        arcs = (track.near_from, track.far_from, track.offset, track.bits, before)
        if self.path == "longest":
            _, task = longest_chain(weight, *arcs)
        else:
            _, task = longest_chain_with_history(weight, track.place, *arcs)
        return chain_to(task, before)
