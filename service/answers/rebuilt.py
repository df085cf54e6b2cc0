"""A finished job taken up again: its problem compiled anew, its plan read back and judged."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from planner_core.budget import Budget, Termination
from planner_core.build import ScenarioOpportunities, build_problem
from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.reasons.reason import Search
from planner_core.referee.replay import Timeline, replay
from service.answers.reading import plan_in, records_of_json
from service.scenarios.opportunities import Described


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rebuilt:
    """What the solver's process had at its end."""

    scenario: Scenario
    computed: ScenarioOpportunities
    problem: Problem
    plan: Plan
    timeline: Timeline
    search: Search


def rebuild(described: Described, timeline: str, budget: Budget) -> Rebuilt:
    """Return the problem and the plan of a stored timeline."""
    problem = build_problem(described.scenario, described.computed, budget)
    plan = stored_plan(timeline, described.scenario, problem)
    judged = replay(problem, plan)
    return Rebuilt(
        scenario=described.scenario,
        computed=described.computed,
        problem=problem,
        plan=plan,
        timeline=judged,
        search=_search(json.loads(timeline), judged),
    )


def stored_plan(timeline: str, scenario: Scenario, problem: Problem) -> Plan:
    """Return the plan of a timeline document as actions of a problem, as far as it has them."""
    plan = plan_in(records_of_json(timeline.encode()), scenario, problem).plan
    if problem.continuous_starts:
        return plan
    # Documents have milliseconds; the opportunities' own times are exact.
    return Plan.of(problem, dict.fromkeys(action.opportunity for action in plan.actions))


def _search(document: dict[str, Any], judged: Timeline) -> Search:
    return Search(
        is_optimal=judged.is_valid and document["termination"] == Termination.OPTIMAL.value,
        breadth=document["solver"]["params"].get("breadth"),
        contact_above=document["solver"]["params"].get("contact_above_fraction", 0.0),
    )
