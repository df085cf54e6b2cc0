"""Cases planned with the product: its scenario, its solvers, on the benchmark's action grid.

Differences of the models are handled here. The benchmark's geometry differs a little (constants of
SGP4, Earth orientation): collects that it would refuse are removed from the table, and slews are
computed from its lines of sight. Its battery, which idles, slews and charges at the same time, is
checked afterwards: if it would run empty, images are dropped, and other satellites are searched
for room for them.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from datetime import timedelta

import numpy as np
import numpy.typing as npt

from benchmarks.aeossp.case import Case, Observation
from benchmarks.aeossp.geometry import Sky, angle_deg, turn_s
from benchmarks.aeossp.verifier import verify
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget, Termination
from planner_core.build import build_problem
from planner_core.certified.lns.search import improved
from planner_core.domain import (
    Agility,
    Horizon,
    Resources,
    Satellite,
    Scenario,
    Sensor,
    Target,
)
from planner_core.orbits.tle import read_tle
from planner_core.problem import Opportunities, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_WIDER_DEG = 0.2  # than the sensor's limit: the benchmark's own geometry then decides
_ANGLE_ROUNDING_DEG = 1e-6
_REPAIR_MOVES = 20.0  # of the window search, per opportunity


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """A solution and how it was found.

    Attributes
    ----------
    weight, bound
        Weight of the observed tasks, and the most of any solution with any batteries, provided
        no image starts sooner than it could as a satellite's first, which begins at nadir.
    num_collects
        How many collects were available.
    num_dropped
        Images removed because of a battery; others may have replaced them.
    cpu_s
        From the scenario to the plan.
    """

    observations: tuple[Observation, ...]
    weight: float
    bound: float | None
    num_collects: int
    num_dropped: int
    termination: Termination
    cpu_s: float


def plan_case(case: Case, solver: Solver, *, time_s: float | None, seed: int) -> Planned:
    """Return a solution of a case.

    Parameters
    ----------
    time_s
        Limit for the solver alone; None for no limit.
    """
    began = time.process_time()
    scenario = scenario_of(case)
    computed = compute_opportunities(scenario, Budget())
    computed = replace(
        computed, opportunities=_as_the_benchmark_sees_it(case, computed.opportunities)
    )
    problem = build_problem(scenario, computed, Budget())
    solution = solver.solve(problem, Budget(time_s), seed)
    plan, num_dropped = _within_battery(case, problem, _distinct(problem, solution.plan), seed)
    assert replay(problem, plan).is_valid
    observations = _observations(problem, [action.opportunity for action in plan.actions])
    return Planned(
        observations=tuple(observations),
        weight=sum(case.tasks[one.task_id].weight for one in observations),
        bound=solution.bound,
        num_collects=len(problem.opportunities),
        num_dropped=num_dropped,
        termination=solution.termination,
        cpu_s=time.process_time() - began,
    )


def _distinct(problem: Problem, plan: Plan) -> Plan:
    """Return the plan without images that earn nothing."""
    timeline = replay(problem, plan)
    assert timeline.is_valid
    positions = sorted(collected.position for collected in timeline.collected.values())
    return Plan(tuple(plan.actions[position] for position in positions))


def scenario_of(case: Case) -> Scenario:
    """Return a case as a scenario of the product."""
    satellites = []
    for satellite in case.satellites.values():
        orbit = read_tle(list(satellite.tle)).elements
        satellites.append(
            Satellite(
                id=satellite.id,
                name=satellite.id,
                orbit=orbit,
                agility=Agility(
                    slew_rate_deg_s=satellite.slew_rate_deg_s,
                    acceleration_deg_s2=satellite.acceleration_deg_s2,
                    settle_s=satellite.settle_s,
                ),
                sensor=Sensor(
                    off_nadir_min_deg=0.0,
                    off_nadir_max_deg=satellite.off_nadir_max_deg + _WIDER_DEG,
                    nadir="geocentric",
                    sensor_type=satellite.sensor_type,
                ),
                resources=Resources.paper(orbit.period_s),
            )
        )
    return Scenario(
        horizon=Horizon(start=case.start, end=case.start + timedelta(seconds=case.horizon_s)),
        satellites=tuple(satellites),
        targets=tuple(
            Target(
                id=task.id,
                lat_deg=task.lat_deg,
                lon_deg=task.lon_deg,
                alt_m=task.alt_m,
                reward=task.weight,
                collect_s=task.duration_s,
                release=case.instant(task.release_s),
                due=case.instant(task.due_s),
                sensor_type=task.sensor_type,
            )
            for task in case.tasks.values()
        ),
        use_resources=False,
        collect_spacing_s=float(case.action_step_s),
        collect_alignment="horizon",
        allow_old_elements=True,
    )


def _as_the_benchmark_sees_it(case: Case, table: Opportunities) -> Opportunities:
    """Return the collects that the benchmark allows, with its own lines of sight."""
    sky = Sky.of(case)
    satellites, tasks = list(case.satellites.values()), list(case.tasks.values())
    is_allowed = np.zeros(len(table), dtype=np.bool_)
    lines = {name: np.array(getattr(table, name)) for name in ("los_start", "los_end")}
    for index, satellite in enumerate(satellites):
        rows = np.flatnonzero(table.satellite == index)
        fixed = np.array([sky.fixed(tasks[site]) for site in table.site[rows]]).reshape(-1, 3)

        def sight(t_s: Floats, own: str = satellite.id, fixed: Floats = fixed) -> Floats:
            return sky.turned(fixed, t_s) - sky.satellite(own, t_s)

        start_s, end_s = table.start_s[rows], table.end_s[rows]
        first = sight(start_s)
        angle = angle_deg(-sky.satellite(satellite.id, start_s), first)
        from_nadir_s = satellite.settle_s + np.array(
            [turn_s(a, satellite.slew_rate_deg_s, satellite.acceleration_deg_s2) for a in angle]
        )
        is_allowed[rows] = start_s >= from_nadir_s
        lines["los_start"][rows] = _unit(first)
        lines["los_end"][rows] = _unit(sight(end_s))
        # All instants are on the geometry's grid, so its samples are the starts and what follows.
        step_s = float(case.geometry_step_s)
        for into_s in np.arange(0.0, (end_s - start_s).max(initial=0.0) + step_s, step_s):
            t_s = np.minimum(start_s + into_s, end_s)
            at = sky.satellite(satellite.id, t_s)
            there = sky.turned(fixed, t_s)
            is_seen = np.einsum("ij,ij->i", there - at, there) < 0.0
            is_near = (
                angle_deg(-at, there - at) <= satellite.off_nadir_max_deg + _ANGLE_ROUNDING_DEG
            )
            is_allowed[rows] &= is_seen & is_near
    columns = {f.name: getattr(table, f.name) for f in fields(Opportunities)} | lines
    return Opportunities(**{name: values[is_allowed] for name, values in columns.items()})


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _within_battery(case: Case, problem: Problem, plan: Plan, seed: int) -> tuple[Plan, int]:
    """Return a plan under which no battery runs empty, and how many images were removed for that.

    Satellites that run empty lose the images that earn least for their time. From then on they
    may only do what they keep; the others are searched for room for the rest.
    """
    taken = [action.opportunity for action in plan.actions]
    is_weak = np.zeros(len(problem.satellites), dtype=np.bool_)
    num_dropped = 0
    while True:
        kept: list[int] = []
        for index, satellite in enumerate(problem.satellites):
            own = [row for row in taken if problem.opportunities.satellite[row] == index]
            enough = _affordable(case, satellite.id, problem, own)
            is_weak[index] |= len(enough) < len(own)
            kept += enough
        if len(kept) == len(taken):
            return Plan.of(problem, taken), num_dropped
        num_dropped += len(taken) - len(kept)
        is_open = ~is_weak[problem.opportunities.satellite]
        is_open[kept] = True
        rows = np.flatnonzero(is_open)
        rest = restricted(problem, rows)
        start = Plan.of(rest, np.searchsorted(rows, sorted(kept)))
        found = improved(rest, start, _REPAIR_MOVES, Budget(), seed)
        taken = [int(rows[action.opportunity]) for action in found.actions]


def _affordable(case: Case, satellite_id: str, problem: Problem, own: list[int]) -> list[int]:
    """Return the images of one satellite for which its battery suffices.

    Removing images never makes a slew infeasible: the rest stays valid.
    """
    alone = replace(case, satellites={satellite_id: case.satellites[satellite_id]})
    kept = list(own)
    while True:
        observations = _observations(problem, kept)
        empty_s = verify(alone, observations).drawn[satellite_id].empty_s
        before = [k for k, one in enumerate(observations) if one.start_s <= (empty_s or -1.0)]
        if not before:
            return kept

        def worth(k: int, images: list[Observation] = observations) -> tuple[float, float]:
            task = case.tasks[images[k].task_id]
            return task.weight / task.duration_s, -images[k].end_s

        del kept[min(before, key=worth)]


def _observations(problem: Problem, rows: Iterable[int]) -> list[Observation]:
    table = problem.opportunities
    return [
        Observation(
            satellite_id=problem.satellites[int(table.satellite[row])].id,
            task_id=problem.target_ids[int(table.site[row])],
            start_s=float(table.start_s[row]),
            end_s=float(table.end_s[row]),
        )
        for row in rows
    ]
