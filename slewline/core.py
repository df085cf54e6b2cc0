"""The planning core without a service: a scenario in, a judged plan out.

Kept apart from the client, whose ``Satellite`` and ``Scenario`` are answers of a service, and
because the core takes a second to import and the client does not.
"""

from planner_core.budget import Budget, Progress, Termination
from planner_core.domain import (
    Agility,
    GroundStation,
    Horizon,
    OrbitElements,
    Resources,
    Satellite,
    Scenario,
    Sensor,
    Target,
)
from planner_core.errors import Cancelled, PlannerError
from planner_core.orbits.tle import parse_tle
from planner_core.pins import BlockedInterval, PinnedAction, Pins
from planner_core.run import Judged, plan_scenario
from planner_core.solvers.registry import SOLVERS, Certified, ForwardSearch, Graph, Mcts, Milp, Rule

__all__ = [
    "SOLVERS",
    "Agility",
    "BlockedInterval",
    "Budget",
    "Cancelled",
    "Certified",
    "ForwardSearch",
    "Graph",
    "GroundStation",
    "Horizon",
    "Judged",
    "Mcts",
    "Milp",
    "OrbitElements",
    "PinnedAction",
    "Pins",
    "PlannerError",
    "Progress",
    "Resources",
    "Rule",
    "Satellite",
    "Scenario",
    "Sensor",
    "Target",
    "Termination",
    "parse_tle",
    "plan_scenario",
]
