"""A finished job rebuilt: its plan read back, for comparison or as actions of its problem."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from planner_core.access.scenario_opportunities import ScenarioOpportunities
from planner_core.budget import Budget, Termination
from planner_core.build import build_problem
from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.reasons.reason import Search
from planner_core.referee.plan_diff import PlannedAction, PlanView
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.solvers.registry import outlook_of
from service.answers.reading import Finder
from service.scenarios.opportunities import Described
from service.wire.timelines import IDLE_MODES, TimelineOut

_FIGURES: Final = (
    "reward", "collects", "contacts", "delivered", "downlinked_mbit", "downlinked_fraction",
    "battery_min_fraction", "recorder_max_fraction",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rebuilt:
    """What the solver's process had when it ended."""

    scenario: Scenario
    computed: ScenarioOpportunities
    problem: Problem
    plan: Plan
    timeline: Timeline
    search: Search


def rebuild(described: Described, timeline: TimelineOut, budget: Budget) -> Rebuilt:
    """Return the problem and the plan of a stored timeline."""
    problem = build_problem(described.scenario, described.computed, budget)
    plan = stored_plan(timeline, described.scenario, problem)
    judged = replay(problem, plan)
    outlook = outlook_of(timeline.solver.name, timeline.solver.params)
    return Rebuilt(
        scenario=described.scenario,
        computed=described.computed,
        problem=problem,
        plan=plan,
        timeline=judged,
        search=Search(
            is_optimal=judged.is_valid and timeline.termination == Termination.OPTIMAL.value,
            breadth=outlook.breadth,
            contact_above=outlook.contact_above,
        ),
    )


def stored_plan(timeline: TimelineOut, scenario: Scenario, problem: Problem) -> Plan:
    """Return the plan of a stored timeline as actions of a problem, without those it lacks."""
    found = map(Finder(scenario, problem).action, planned(timeline))
    plan = Plan(tuple(sorted(action for action in found if action is not None)))
    if problem.continuous_starts:
        return plan
    # Documents are rounded to milliseconds; the opportunities' own times are exact.
    return Plan.of(problem, dict.fromkeys(action.opportunity for action in plan.actions))


def view_of(timeline: TimelineOut) -> PlanView:
    """Return what a stored timeline is compared by."""
    totals = timeline.totals
    imaged = totals.targets["downlinked"] + totals.targets["collected"]
    return PlanView(
        actions=tuple(sorted(planned(timeline))),
        totals={
            **{name: getattr(totals, name) for name in _FIGURES},
            "targets": float(imaged),
            "age_mean_s": None if totals.age_s is None else totals.age_s.mean,
        },
    )


def planned(timeline: TimelineOut) -> Iterator[PlannedAction]:
    """Yield the collects and contacts of a stored timeline."""
    for satellite in timeline.satellites:
        for action in satellite.actions:
            if action.mode not in IDLE_MODES:
                yield PlannedAction(
                    start=action.start,
                    end=action.end,
                    satellite_id=satellite.id,
                    mode=action.mode,
                    site_id=str(action.target_id or action.station_id),
                )
