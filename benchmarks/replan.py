"""A day's events, replanned and planned from scratch (``python -m benchmarks.replan``).

Prints for each mission and event the result of a replan of ``LIMIT_S`` CPU seconds: reward and
bound after the freeze, the share of the plan's later actions that it moved or removed, how much of
that was unavoidable, and the least that any valid plan changes, and any that earns as much, if that
is proven. For comparison the result of solver ``certified`` on the same problem from scratch.
Access and compilation are not counted. One run each, on one core, after a warm-up on a small
mission.

``python -m benchmarks.replan one`` or ``four`` selects the mission. ``--fleet SPACECRAFT CITIES``
is the mission of ``benchmarks.fleet`` with 24 satellites and 10,000 targets: urgent requests one by
one, on a worker that holds the plan, and the time of each step.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks import fleet_missions
from benchmarks.cpu_budget import CpuBudget
from benchmarks.missions import ORBIT, START, paper_scenario, problem_of
from planner_core.access.opportunities_after import opportunities_after
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import (
    Outage,
    Replan,
    Resources,
    Satellite,
    Scenario,
    Target,
)
from planner_core.pins import PinnedAction
from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.replanning.known import KnownMultipliers, multipliers_of
from planner_core.replanning.plan_before import PlanBefore
from planner_core.replanning.programs import fewest_changes
from planner_core.replanning.question import Question, question_of
from planner_core.replanning.replan import solve_replan
from planner_core.solvers.registry import Certified

LIMIT_S: Final = 2.0
SCRATCH_S: Final = 30.0
NOW: Final = START + timedelta(hours=9, minutes=12)
FREEZE: Final = NOW + timedelta(minutes=18)
OUT: Final = timedelta(hours=6)
MISSIONS: Final = {"one": (1, 1000), "four": (4, 2000)}
_URGENT_REWARD: Final = 10.0
_NEW: Final = 0.05  # share of targets that arrive at once
_DRAWS: Final = 6  # of urgent requests
FLEET: Final = (24, 10_000)
_ROUNDING: Final = 1e-6


@dataclass(frozen=True, kw_only=True)
class Day:
    """A mission, and the plan in force."""

    scenario: Scenario
    problem: Problem
    plan: Plan
    later_targets: tuple[Target, ...]
    known: KnownMultipliers | None

    @property
    def base(self) -> tuple[PinnedAction, ...]:
        """Return the plan as a client gives it."""
        return base_of(self.scenario, self.problem, self.plan)


def base_of(scenario: Scenario, problem: Problem, plan: Plan) -> tuple[PinnedAction, ...]:
    """Return a plan as a client gives it."""
    table = problem.opportunities
    found = []
    for action in plan.actions:
        row = action.opportunity
        site = int(table.site[row])
        is_image = table.kind[row] == COLLECT
        found.append(
            PinnedAction(
                satellite_id=problem.satellites[int(table.satellite[row])].id,
                target_id=problem.target_ids[site] if is_image else None,
                station_id=None if is_image else problem.station_ids[site],
                start=scenario.horizon.instant(action.start_s),
            )
        )
    return tuple(found)


def day_of(num_satellites: int, num_targets: int) -> Day:
    """Return a mission, planned; a few targets are held back for later."""
    num_new = int(_NEW * num_targets)
    whole = paper_scenario(num_targets + num_new, 0, use_resources=True)
    orbits = [
        replace(ORBIT, raan_deg=360.0 * i / num_satellites, norad_cat_id=i + 1)
        for i in range(num_satellites)
    ]
    scenario = replace(
        whole,
        satellites=tuple(
            Satellite(
                id=f"s{i}", name=f"S{i}", orbit=orbit, resources=Resources.paper(orbit.period_s)
            )
            for i, orbit in enumerate(orbits)
        ),
        targets=whole.targets[:num_targets],
    )
    problem = problem_of(scenario)
    solution = Certified().solve(problem, CpuBudget(SCRATCH_S, time.time() + 300.0), 0)
    return Day(
        scenario=scenario, problem=problem, plan=solution.plan,
        later_targets=whole.targets[num_targets:],
        known=multipliers_of(solution.proven, problem.target_ids),
    )  # fmt: skip


def events_of(day: Day) -> Iterator[tuple[str, Scenario]]:
    """Yield each event, and the scenario to replan after it."""
    asked = replace(day.scenario, replan=Replan(base=day.base, freeze_until=FREEZE))
    rng = np.random.default_rng(7)
    for draw, i in enumerate(rng.permutation(len(day.later_targets))[:_DRAWS]):
        urgent = replace(day.later_targets[i], reward=_URGENT_REWARD)
        yield f"urgent request {draw}", replace(asked, targets=(*asked.targets, urgent))
    contacts = [
        action
        for action in day.base
        if action.station_id and action.start is not None and action.start > FREEZE
    ]
    for contact in contacts[:2]:
        assert contact.start is not None
        lost = Outage(
            satellite_id=contact.satellite_id, modes=("contact",),
            start=contact.start, end=contact.start + timedelta(minutes=1),
        )  # fmt: skip
        yield "contact lost", replace(asked, outages=(lost,))
    station = Outage(station_id="svalbard", start=FREEZE, end=FREEZE + OUT)
    yield "station out for 6 h", replace(asked, outages=(station,))
    safe = Outage(satellite_id=day.scenario.satellites[0].id, start=FREEZE, end=FREEZE + OUT)
    yield "safe mode for 6 h", replace(asked, outages=(safe,))
    yield "5 % new targets", replace(asked, targets=(*asked.targets, *day.later_targets))


def measure(
    name: str, scenario: Scenario, known: KnownMultipliers | None, *, is_brief: bool
) -> str:
    """Return a line of the table; a brief one holds only the replan."""
    problem = problem_of(scenario)
    question = question_of(scenario, problem)
    began = time.process_time()
    budget = CpuBudget(LIMIT_S, time.time() + 60.0)
    solution = solve_replan(question, Certified(), budget, 0, known)
    cpu_s = time.process_time() - began
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations
    start_s = problem.opportunities.start_s
    still = sum(not problem.pinned.is_frozen(start_s[row]) for row in question.base)
    forced = (question.num_base - still) / question.num_base
    changed = question.changed(solution.plan) / question.num_base
    told = f"| {name} | {timeline.reward:g} / {solution.bound:g} | {changed:.1%} | {forced:.1%} "
    least = f"{_least(question)}, {_least_earning(question, timeline.reward)}"
    if is_brief:
        return f"{told}| {least} | {cpu_s:.2f} | | | |"
    began = time.process_time()
    scratch = Certified().solve(problem, CpuBudget(SCRATCH_S, time.time() + 300.0), 0)
    scratch_s = time.process_time() - began
    anew = question.changed(scratch.plan) / question.num_base
    return (
        f"{told}| {least} "
        f"| {cpu_s:.2f} | {replay(problem, scratch.plan).reward:g} / {scratch.bound:g} "
        f"| {anew:.0%} | {scratch_s:.1f} |"
    )


def _least(question: Question) -> str:
    """Return the least share that any valid plan changes, ignoring contacts that are kept."""
    problem = question.problem
    found = None
    if problem.use_resources:
        budget = CpuBudget(SCRATCH_S, time.time() + 300.0)
        found = fewest_changes(question, range(len(problem.satellites)), budget, math.inf)
    if found is None or not found.is_proven:
        return "-"
    return _share_changed(question, found.num_kept)


def _least_earning(question: Question, reward: float) -> str:
    """Return the least share that any plan with that reward changes, by the bound on both together.

    Every image kept counts ``stability.weight`` there, so the difference between the bound and
    the reward limits the number of images kept.
    """
    if not question.problem.use_resources or question.promised:
        return "-"
    budget = CpuBudget(SCRATCH_S, time.time() + 300.0)
    bound = Certified(gap=0.0).solve(question.searched, budget, 0).bound
    assert bound is not None
    a_kept_image = question.stability.weight * question.typical
    return _share_changed(question, math.floor((bound - reward) / a_kept_image + _ROUNDING))


def _share_changed(question: Question, num_kept: int) -> str:
    """Return the share of the base that changes if this number of its images is kept."""
    problem = question.problem
    is_image = problem.opportunities.kind[question.base] == COLLECT
    start_s = problem.opportunities.start_s
    still = sum(not problem.pinned.is_frozen(start_s[row]) for row in question.base)
    least = question.num_base - still + max(0, int(is_image.sum()) - num_kept)
    return f"{least / question.num_base:.1%}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The result of one urgent request, in CPU seconds and in changes."""

    access_s: float
    build_s: float
    solve_s: float
    changed_share: float
    gained: float


def urgent_requests(files: fleet_missions.Files, number: int) -> Iterator[Asked]:
    """Yield the results of urgent requests, each on its own after the same plan in force."""
    num_satellites, num_targets = FLEET
    whole = fleet_missions.fleet_scenario(files, num_satellites, num_targets + number)
    scenario = replace(whole, targets=whole.targets[:num_targets])
    opportunities = compute_opportunities(scenario, Budget())
    problem = build_problem(scenario, opportunities, Budget())
    published = Certified().solve(problem, CpuBudget(SCRATCH_S, time.time() + 600.0), 0)
    earned = replay(problem, published.plan).reward
    before = PlanBefore(
        scenario=scenario, opportunities=opportunities, bound=published.proven,
        imaged=frozenset(
            problem.target_ids[int(problem.opportunities.site[action.opportunity])]
            for action in published.plan.actions
        ),
    )  # fmt: skip
    freeze = scenario.horizon.start + (FREEZE - START)
    replan = Replan(base=base_of(scenario, problem, published.plan), freeze_until=freeze)
    for target in whole.targets[num_targets:]:
        urgent = replace(target, reward=_URGENT_REWARD)
        asked = replace(scenario, targets=(*scenario.targets, urgent), replan=replan)
        clock = [time.process_time()]
        table = opportunities_after(asked, scenario, opportunities, Budget())
        clock.append(time.process_time())
        left = build_problem(asked, table, Budget())
        question = question_of(asked, left, before.asked_by(asked))
        clock.append(time.process_time())
        budget = CpuBudget(LIMIT_S, time.time() + 60.0)
        solution = solve_replan(question, Certified(), budget, 0, before.multipliers)
        clock.append(time.process_time())
        timeline = replay(left, solution.plan)
        assert timeline.is_valid, timeline.violations
        yield Asked(
            access_s=clock[1] - clock[0],
            build_s=clock[2] - clock[1],
            solve_s=clock[3] - clock[2],
            changed_share=question.changed(solution.plan) / question.num_base,
            gained=timeline.reward - earned,
        )


def fleet(files: fleet_missions.Files, number: int) -> None:
    """Print the results of urgent requests: median, 99th percentile and greatest."""
    # The first one compiles the kernels.
    found = list(urgent_requests(files, number + 1))[1:]
    print(f"\n{number} urgent requests at {FLEET[0]} x {FLEET[1]:,}\n")
    print("| figure | median | p99 | greatest |\n|---|---|---|---|")
    for name in Asked.__slots__:
        values = np.array([getattr(one, name) for one in found])
        middle, high = np.quantile(values, [0.5, 0.99])
        print(f"| {name} | {middle:.4g} | {high:.4g} | {values.max():.4g} |")
    print(f"\nreward gained, least: {min(one.gained for one in found):g}", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("missions", nargs="*", choices=[*MISSIONS, []], default=[])
    parser.add_argument("--fleet", nargs=2, type=Path, metavar=("SPACECRAFT", "CITIES"))
    parser.add_argument("--requests", type=int, default=100, help="of a fleet")
    parser.add_argument("--brief", action="store_true", help="nothing from scratch")
    options = parser.parse_args()
    if options.fleet:
        spacecraft, cities = options.fleet
        fleet(fleet_missions.Files(spacecraft=spacecraft, cities=cities), options.requests)
        return
    chosen = options.missions or list(MISSIONS)
    warm = day_of(2, 60)
    for _, scenario in events_of(warm):
        problem = problem_of(scenario)
        solve_replan(
            question_of(scenario, problem), Certified(), CpuBudget(1.0, time.time() + 9), 0
        )
    for name in chosen:
        day = day_of(*MISSIONS[name])
        print(f"\n{name}: {replay(day.problem, day.plan).reward:g} before\n")
        head = "event | reward / bound | changed | lost | least | CPU s | anew | changed | CPU s"
        print(f"| {head} |\n|{'---|' * 9}")
        for event, scenario in events_of(day):
            print(measure(event, scenario, day.known, is_brief=options.brief), flush=True)


if __name__ == "__main__":
    main()
