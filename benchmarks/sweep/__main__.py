"""Plan missions drawn at random, and report faults of the answers.

Every solver plans each mission, and ``certified`` under other objectives too; all plans are judged
under the mission's own. A fault is a plan that the referee refuses, a bound below a plan, a bound
that does not follow from its own proof, a plan better than that of ``certified`` by more than half
a percent, or an answer of ``certified`` that took 1.5 times the time it was given.

    python -m benchmarks.sweep --first 1 --last 40 --cpu-s 10 build/sweep.csv
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from benchmarks.cpu_budget import CpuBudget
from benchmarks.missions import problem_of
from benchmarks.sweep.missions import random_mission
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.domain import Objective, Scenario
from planner_core.errors import PlannerError
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import SOLVERS, Certified

_BETTER: Final = 0.005  # relative
_ROUNDING: Final = 1e-6  # relative; rewards to which bounds are stated
_OVER: Final = 1.5  # times the CPU seconds
_NEIGHBOURS: Final = {
    "collected": Objective.collected(),
    "delivered": Objective.delivered(),
    "soon": Objective(collected_share=0.0, half_life_s=6 * 3600.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The result of one way of planning a mission.

    Attributes
    ----------
    bound
        None if nothing is proven, or only for another objective.
    is_proven
        Whether the bound follows from the proof, read as it is stored.
    """

    way: str
    reward: float
    bound: float | None
    is_proven: bool
    is_valid: bool
    used_s: float


def main() -> None:
    """Sweep the missions of a range of numbers into a CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--last", type=int, default=20)
    parser.add_argument("--cpu-s", type=float, default=10.0)
    parser.add_argument("csv", type=Path)
    given = parser.parse_args()
    given.csv.parent.mkdir(parents=True, exist_ok=True)
    with given.csv.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["mission", "way", "reward", "bound", "used_s", "fault"])
        for number in range(given.first, given.last + 1):
            scenario = random_mission(number)
            answers = answers_of(scenario, given.cpu_s)
            print(f"{number}: {_told(scenario)}")
            for answer in answers:
                fault = fault_of(answer, answers, given.cpu_s)
                bound = "" if answer.bound is None else f"{answer.bound:.3f}"
                row = (number, answer.way, f"{answer.reward:.3f}", bound, f"{answer.used_s:.1f}")
                rows.writerow([*row, fault])
                if fault or answer.way == "certified":
                    print("   ", *row[1:], fault, flush=True)
            file.flush()


def answers_of(scenario: Scenario, cpu_s: float) -> list[Answer]:
    """Plan a mission in every way, ``certified`` first; all judged under its own objective."""
    problem = problem_of(scenario)
    answers = [_answer("certified", Certified(), problem, problem, cpu_s)]
    for name, solver in SOLVERS.items():
        if name == "certified":
            continue
        try:
            answers.append(_answer(name, solver(), problem, problem, cpu_s / 2.0))
        except PlannerError:  # it cannot plan with one of the mission's options
            continue
    if scenario.use_resources:
        for name, objective in _NEIGHBOURS.items():
            if objective != replace(scenario.objective, prefer=()):
                asked = problem_of(replace(scenario, objective=objective))
                answers.append(_answer(f"as {name}", Certified(), asked, problem, cpu_s))
    return answers


def _answer(way: str, solver: Solver, asked: Problem, problem: Problem, cpu_s: float) -> Answer:
    began_s = time.process_time()
    solution = solver.solve(asked, CpuBudget(cpu_s, math.inf), 0)
    used_s = time.process_time() - began_s
    timeline = replay(problem, solution.plan)
    return Answer(
        way=way,
        reward=timeline.reward,
        bound=solution.bound if asked is problem else None,
        is_proven=solution.proven is None or follows_from_proof(asked, solution.proven),
        is_valid=timeline.is_valid,
        used_s=used_s,
    )


def follows_from_proof(problem: Problem, bound: Bound) -> bool:
    """Return whether a bound can be checked from its JSON text; a report of HiGHS is believed."""
    is_checked = is_proven(problem, from_json(to_json(bound)))
    return bound.proof == "milp" if is_checked is None else is_checked


def fault_of(answer: Answer, answers: list[Answer], cpu_s: float) -> str:
    """Return what is wrong with an answer compared with the others, or nothing."""
    valid = [other.reward for other in answers if other.is_valid]
    best = max(valid, default=0.0)
    if not answer.is_valid:
        return "invalid"
    if answer.bound is not None and answer.bound < best * (1.0 - _ROUNDING):
        return f"bound below {best:.3f}"
    if not answer.is_proven:
        return "not proven"
    if answer.way == "certified" and answer.reward < best * (1.0 - _BETTER):
        return f"worse than {best:.3f}"
    if answer.way == "certified" and answer.used_s > _OVER * cpu_s:
        return "too long"
    return ""


def _told(scenario: Scenario) -> str:
    """Return a short description of a mission."""
    hours = (scenario.horizon.end - scenario.horizon.start).total_seconds() / 3600.0
    objective = scenario.objective
    words = [
        f"{len(scenario.satellites)} x {len(scenario.targets)}, {hours:.0f} h",
        f"share {objective.collected_share}",
        f"half-life {objective.half_life_s}",
        f"spacing {scenario.collect_spacing_s}",
        "continuous starts" if scenario.continuous_starts else "",
        "clouds" if scenario.forecast else "",
        "quality" if scenario.quality else "",
        "outage" if scenario.outages else "",
        "" if scenario.use_resources else "agility alone",
        scenario.satellites[0].resources.sun_pointing,
        scenario.satellites[0].agility.slew_model,
    ]
    return ", ".join(word for word in words if word)


if __name__ == "__main__":
    main()
