"""Graph search (Alg. 3): the longest path through all collects that may follow each other.

The path considers agility alone. If resources count, it is then walked through in order, and only
tasks that keep the limits are taken (``feasibility``).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from planner_core.budget import Budget
from planner_core.precedence.chains import chain_with_history, heaviest_chain
from planner_core.problem import Problem
from planner_core.solvers.base import Constraint, Feasibility, Outlook, Solution
from planner_core.solvers.sequential import Subproblem, plan_in_turn
from planner_core.solvers.walk import (
    CONTACT_ABOVE,
    NOTHING_TAKEN,
    contact_above_metadata,
    rule_plan,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Graph:
    """Take the heaviest chain of collects."""

    name: ClassVar[str] = "graph"
    title: ClassVar[str] = "Graph search"
    about: ClassVar[str] = (
        "Finds the chain of images that is worth most, and only then looks at battery and "
        "recorder. Quick; strong if only images count."
    )
    paper: ClassVar[str] = "Algorithm 3, section Graph Search"
    exact: ClassVar[bool] = False
    bounds: ClassVar[bool] = False
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
            "description": "hard: walk along the path and take tasks that keep the limits of "
            "battery and recorder, and contacts as they come; "
            "penalty: the path as it is, even if it breaks them."
        },
    )
    contact_above_fraction: float = field(
        default=CONTACT_ABOVE,
        metadata=contact_above_metadata("Matters only if feasibility is hard."),
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions it considers."""
        return Outlook(contact_above=self.contact_above_fraction)

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one whatever the seed."""

        def plan_one(subproblem: Subproblem) -> list[int]:
            track = subproblem.track
            is_wanted = (track.is_contact == 0) & (subproblem.collected[track.site] == 0)
            weight = np.where(is_wanted, problem.worth[subproblem.satellite.rows], 0.0)
            if self.path == "longest":
                path = heaviest_chain(subproblem.satellite, weight)
            else:
                path = chain_with_history(subproblem.satellite, weight, track.site)
            path = _with_kept(problem, subproblem, path)
            if problem.use_resources and self.feasibility == "hard":
                off_path = track.is_contact == 0
                off_path[path] = False
                narrowed = track._replace(blocked=track.blocked | off_path.astype(np.uint8))
                rows = rule_plan(
                    narrowed,
                    subproblem.collected,
                    True,
                    True,
                    self.contact_above_fraction,
                    NOTHING_TAKEN,
                    False,
                )
                path = [int(row) for row in rows]
            subproblem.report(1.0, float(weight[path].sum()))
            return path

        return plan_in_turn(problem, budget, plan_one)


def _with_kept(problem: Problem, subproblem: Subproblem, path: list[int]) -> list[int]:
    """Return the path with what must be taken, or the rule's plan if that does not fit in."""
    kept = problem.kept_local(subproblem.satellite).tolist()
    whole = sorted({*path, *kept})
    if all(subproblem.satellite.transitions.allows(a, b) for a, b in itertools.pairwise(whole)):
        return whole
    rows = rule_plan(
        subproblem.track,
        subproblem.collected.copy(),
        True,
        True,
        CONTACT_ABOVE,
        NOTHING_TAKEN,
        False,
    )
    return [int(row) for row in rows if row in kept or not subproblem.track.is_contact[row]]
