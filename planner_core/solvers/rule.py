"""The rule-based planner (Alg. 4): take the next task in time if resources allow."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

from planner_core.budget import Budget
from planner_core.problem import Problem
from planner_core.solvers.base import Constraint, Feasibility, Outlook, Solution
from planner_core.solvers.priced import better_of
from planner_core.solvers.sequential import Subproblem, plan_in_turn
from planner_core.solvers.walk import (
    CONTACT_ABOVE,
    NOTHING_TAKEN,
    contact_above_metadata,
    rule_plan,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """Take the next feasible task in time; sun-point through those that resources forbid."""

    name: ClassVar[str] = "rule"
    title: ClassVar[str] = "Rule-based planner"
    about: ClassVar[str] = (
        "Takes the next task in time, and turns to the sun if battery or recorder forbid it. The "
        "quickest, for a first look."
    )
    paper: ClassVar[str] = "Algorithm 4, section Rule-Based Planning"
    exact: ClassVar[bool] = False
    bounds: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    unimaged_only: bool = field(
        default=True,
        metadata={
            "description": "Skip targets that are already imaged; the paper's listing does not."
        },
    )
    contact_above_fraction: float = field(
        default=CONTACT_ABOVE,
        metadata=contact_above_metadata(
            "The paper's rule has 0: every contact, which costs images."
        ),
    )
    feasibility: Feasibility = field(
        default="hard",
        metadata={
            "description": "hard: only actions that keep every limit to the end of the horizon; "
            "penalty: the listing's own test at each action."
        },
    )

    thresholds: Literal["text", "code"] = field(
        default="text",
        metadata={
            "description": "When resources allow a task. text: battery above its limit and "
            "recorder not above its own after the task (the paper); code: battery not empty, "
            "recorder not full, no collects from half full on (the authors' code)."
        },
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions it considers."""
        return Outlook(contact_above=self.contact_above_fraction)

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one whatever the seed."""

        def plan_one(subproblem: Subproblem) -> list[int]:
            track, before = subproblem.track, subproblem.collected.copy()
            rows = rule_plan(
                track,
                subproblem.collected,
                self.feasibility == "hard",
                self.unimaged_only,
                self.contact_above_fraction,
                NOTHING_TAKEN,
                self.thresholds == "code",
            )
            images = rows[track.is_contact[rows] == 0]
            images = images[before[track.site[images]] == 0]
            subproblem.report(1.0, problem.worth_of(subproblem.satellite.rows[images]))
            taken = [int(row) for row in rows]
            if self.feasibility == "penalty" or self.thresholds == "code":
                return taken
            fresh = replace(subproblem, collected=before)
            return better_of(problem, fresh, taken, looks_ahead=False)

        return plan_in_turn(problem, budget, plan_one)
