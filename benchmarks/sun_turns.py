"""Missions whose satellites turn to the sun to charge: plans, bounds, and the simple planners.

``python -m benchmarks.sun_turns`` plans the paper's mission at four sizes and three agilities, and
prints the gap of ``certified`` after 20 CPU seconds and the share of its plan's reward that the
planners without a proof reach. ``--fleet SPACECRAFT CITIES STATIONS`` plans four satellites over
2,000 cities as well, in 60.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from benchmarks.cpu_budget import CpuBudget
from benchmarks.fleet_missions import Files, fleet_scenario
from benchmarks.missions import paper_scenario, problem_of
from benchmarks.suite.engine import LEVELS, Result, solve
from planner_core.domain import Agility, Scenario
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import ForwardSearch, Mcts, Rule

AGILITIES: Final = {
    "A0": Agility(),
    "A1": Agility(slew_rate_deg_s=1.0, acceleration_deg_s2=0.05, settle_s=5.0, slew_model="rest"),
    "A2": Agility(slew_rate_deg_s=3.0, acceleration_deg_s2=0.5, settle_s=5.0, slew_model="rest"),
}
"""Instant acceleration; weak wheels; strong ones."""

_SIZES: Final = (200, 500, 1000, 2000)
_SOLVE_S: Final = 20.0
_FLEET_S: Final = 60.0
_SIMPLE: Final[dict[str, Solver]] = {
    "rule": Rule(), "forward_search": ForwardSearch(), "mcts": Mcts(),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One mission of the table."""

    name: str
    num_targets: int
    agility: Agility
    draw: int
    eclipse_aware: bool

    def scenario(self) -> Scenario:
        """Return the mission."""
        base = paper_scenario(self.num_targets, self.draw, use_resources=True)
        return with_sun_turns(base, self.agility, eclipse_aware=self.eclipse_aware)


def with_sun_turns(scenario: Scenario, agility: Agility | None, *, eclipse_aware: bool) -> Scenario:
    """Return a scenario whose satellites charge only between turns to the sun and back."""
    satellites = tuple(
        replace(
            satellite,
            agility=agility or satellite.agility,
            resources=replace(
                satellite.resources, sun_pointing="slew", eclipse_aware=eclipse_aware
            ),
        )
        for satellite in scenario.satellites
    )
    return replace(scenario, satellites=satellites)


def cases(sizes: list[int], draws: int) -> Iterator[Case]:
    """Yield the missions of one satellite."""
    for num_targets in sizes:
        for draw in range(draws):
            for name, agility in AGILITIES.items():
                yield Case(name=name, num_targets=num_targets, agility=agility, draw=draw,
                           eclipse_aware=False)  # fmt: skip
            yield Case(name="A0, eclipse", num_targets=num_targets, agility=AGILITIES["A0"],
                       draw=draw, eclipse_aware=True)  # fmt: skip


def share_of(problem: Problem, solver: Solver, reward: float) -> float:
    """Return what share of a reward a solver's valid plan reaches."""
    budget = CpuBudget(_SOLVE_S, time.time() + 10.0 * _SOLVE_S)
    timeline = replay(problem, solver.solve(problem, budget, 0).plan)
    assert timeline.is_valid, timeline.violations[:3]
    return timeline.reward / reward


def told(name: str, result: Result) -> str:
    """Return plan, bound and gap of ``certified``, and when gaps were reached."""
    gap = 100.0 * (1.0 - result.reward / result.bound)
    reached = " ".join("    -" if s is None else f"{s:5.1f}" for s in result.to_level_s)
    return f"{name:>20} {result.reward:6.0f} {result.bound:7.1f} {gap:5.2f}% {reached}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=list(_SIZES))
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--fleet", type=Path, nargs=3, metavar=("SPACECRAFT", "CITIES", "STATIONS"))
    options = parser.parse_args()
    warm = problem_of(Case(name="", num_targets=100, agility=AGILITIES["A0"], draw=9,
                           eclipse_aware=True).scenario())  # fmt: skip
    solve(warm, 0, _SOLVE_S)
    levels = " ".join(f"{100.0 * level:3g} %" for level in LEVELS)
    simple = " ".join(f"{name:>14}" for name in _SIMPLE)
    print(f"{'mission':>20} {'plan':>6} {'bound':>7} {'gap':>6} {levels}  {simple}")
    for case in cases(options.sizes, options.draws):
        problem = problem_of(case.scenario())
        result = solve(problem, 0, _SOLVE_S)
        shares = [share_of(problem, solver, result.reward) for solver in _SIMPLE.values()]
        name = f"{case.num_targets} {case.draw} {case.name}"
        shown = " ".join(f"{100.0 * share:13.1f}%" for share in shares)
        print(f"{told(name, result)}  {shown}", flush=True)
    if options.fleet:
        spacecraft, cities, stations = options.fleet
        files = Files(spacecraft=spacecraft, cities=cities, stations=stations)
        scenario = fleet_scenario(files, 4, 2000, use_resources=True)
        problem = problem_of(with_sun_turns(scenario, None, eclipse_aware=False))
        print(told("4 x 2000 cities", solve(problem, 0, _FLEET_S)))


if __name__ == "__main__":
    main()
