"""Missions whose satellites turn to the sun to charge: plans, bounds, and the simple planners.

``python -m benchmarks.sun_turns`` plans the paper's mission at four sizes and three agilities, and
prints the gap of ``certified`` after 20 CPU seconds and what share of its plan the planners
without a proof reach. ``--fleet SPACECRAFT CITIES STATIONS`` plans four satellites over 2,000
cities as well, in 60 seconds of the clock on all cores.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from benchmarks.cpu_budget import CpuBudget
from benchmarks.fleet_missions import Files, fleet_scenario
from benchmarks.missions import paper_scenario, problem_of
from planner_core.budget import Budget
from planner_core.domain import Agility, Scenario
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import Certified, ForwardSearch, Mcts, Rule

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
    """Return a scenario whose satellites charge between turns to the sun alone."""
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


def reward_of(problem: Problem, solver: Solver, budget: Budget) -> float:
    """Return the reward of a valid plan."""
    timeline = replay(problem, solver.solve(problem, budget, 0).plan)
    assert timeline.is_valid, timeline.violations[:3]
    return timeline.reward


def certified_row(problem: Problem, budget: Budget) -> tuple[float, float, str]:
    """Return plan and bound, and when the gap was first within 2, 1 and 0.5 %."""
    began_s, reward, bound = time.process_time(), 0.0, math.inf
    near: dict[float, float] = {}

    def watch(progress: object) -> None:
        nonlocal reward, bound
        reward = max(reward, getattr(progress, "reward", None) or 0.0)
        bound = min(bound, getattr(progress, "bound", None) or math.inf)
        for level in (0.02, 0.01, 0.005):
            if math.isfinite(bound) and bound - reward <= level * bound:
                near.setdefault(level, time.process_time() - began_s)

    budget.report = watch
    solution = Certified().solve(problem, budget, 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations[:3]
    assert solution.bound is not None
    reached = " ".join(
        f"{near[level]:5.1f}" if level in near else "    -" for level in (0.02, 0.01, 0.005)
    )
    return timeline.reward, solution.bound, reached


def cpu_budget(cpu_s: float) -> Budget:
    """Return a budget of CPU seconds."""
    return CpuBudget(cpu_s, time.time() + 10.0 * cpu_s)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=list(_SIZES))
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--fleet", type=Path, nargs=3, metavar=("SPACECRAFT", "CITIES", "STATIONS"))
    options = parser.parse_args()
    warm = problem_of(Case(name="", num_targets=100, agility=AGILITIES["A0"], draw=9,
                           eclipse_aware=True).scenario())  # fmt: skip
    for solver in (Certified(), *_SIMPLE.values()):
        solver.solve(warm, cpu_budget(5.0), 0)
    print(f"{'mission':>20} {'plan':>6} {'bound':>7} {'gap':>6} "
          f"{'2 %':>5} {'1 %':>5} {'0.5 %':>5}  "
          + " ".join(f"{name:>14}" for name in _SIMPLE))  # fmt: skip
    for case in cases(options.sizes, options.draws):
        problem = problem_of(case.scenario())
        reward, bound, near = certified_row(problem, cpu_budget(_SOLVE_S))
        shares = [reward_of(problem, s, cpu_budget(_SOLVE_S)) / reward for s in _SIMPLE.values()]
        print(f"{case.num_targets:5} {case.draw} {case.name:>12} {reward:6.0f} {bound:7.1f} "
              f"{100 * (1 - reward / bound):5.2f}% {near}  "
              + " ".join(f"{100 * share:13.1f}%" for share in shares), flush=True)  # fmt: skip
    if options.fleet:
        files = Files(
            spacecraft=options.fleet[0], cities=options.fleet[1], stations=options.fleet[2]
        )  # fmt: skip
        scenario = with_sun_turns(
            fleet_scenario(files, 4, 2000, use_resources=True), None, eclipse_aware=False
        )
        budget = Budget(_FLEET_S)
        budget.num_threads = os.cpu_count() or 1
        reward, bound, near = certified_row(problem_of(scenario), budget)
        print(f"fleet of 4 x 2,000   {reward:6.0f} {bound:7.1f} "
              f"{100 * (1 - reward / bound):5.2f}% {near}")  # fmt: skip


if __name__ == "__main__":
    main()
