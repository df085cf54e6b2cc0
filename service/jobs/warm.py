"""Compile the kernels before they are needed, and load them, so that jobs need not wait for it.

``python -m service.jobs.warm`` fills the cache of compiled kernels on disk. Each part plans a
tiny mission that needs some of them; a search that had to compile kernels would have less time
for its plan. The parts that a demonstration needs come first: a spacecraft that can be flown
and every solver.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from multiprocessing.queues import SimpleQueue
from typing import Any, Final

import numpy as np
from numba.core import event

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import AlternatingSearch
from planner_core.certified.multipliers.data import DataPaths
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.proofs.queues import queue_value
from planner_core.certified.strategies.agility import AgilitySearch
from planner_core.certified.strategies.fleet import FleetSearch
from planner_core.domain import (
    Agility,
    GroundStation,
    Horizon,
    Objective,
    OrbitElements,
    Resources,
    Satellite,
    Scenario,
    Target,
    mean_elements,
)
from planner_core.errors import InvalidScenario
from planner_core.jit import all_stamps, load_stored
from planner_core.pins import BlockedInterval, PinnedAction, Pins
from planner_core.precedence.arcs import arc_network_of
from planner_core.precedence.relation import excluded_beside
from planner_core.problem import CONTACT, Problem
from planner_core.problem.delivery import with_objective
from planner_core.run import plan_scenario
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import SOLVERS, Certified, ForwardSearch, Graph, Mcts, Milp, Rule
from service.jobs import compiled
from service.jobs.compilation_line import CompilationLine

_START: Final = datetime(2026, 1, 1, tzinfo=UTC)
_FEW: Final = 40  # targets
_SOME: Final = 60  # enough for every kernel; with twice as many, a search takes seconds
_SLOW_DEG_S: Final = 0.05  # tracking a target needs ten times as much


def main() -> None:
    """Compile what is not yet compiled."""
    make_ready(PARTS)


def warm_up() -> None:
    """Load compiled kernels into this process; if there are none, compile those for a first job."""
    if _is_ready(PARTS) or _is_ready(DEMONSTRATION):
        load_stored()
        return
    for run in DEMONSTRATION.values():
        run()


def make_ready(parts: Iterable[str]) -> None:
    """Compile all parts, or the demonstration's, in as many processes as there are cores.

    Prints its progress. Parts are taken in order. If several processes need the same kernel, one
    compiles it and the others wait for that kernel only.
    """
    parts = list(parts)
    if _is_ready(parts):
        return
    began_s = time.monotonic()
    context = multiprocessing.get_context("spawn")
    told = context.SimpleQueue()
    is_whole = set(parts) == set(PARTS)
    line = CompilationLine(began_s, 1.0 if is_whole else DEMONSTRATED)
    with ProcessPoolExecutor(
        min(len(parts), os.cpu_count() or 1), context, _tell_compiled, (told,)
    ) as processes:
        left = {processes.submit(_run, part) for part in parts}
        try:
            while left:
                done, left = wait(left, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                while not told.empty():
                    line.compiled(told.get())
                line.show()
        except BaseException:  # start no other part
            processes.shutdown(wait=False, cancel_futures=True)
            raise
    line.end()
    compiled.note(_name(parts), all_stamps())


def _run(part: str) -> None:
    try:
        PARTS[part]()
    except Exception as error:  # some errors cannot be pickled for another process
        raise RuntimeError(f"The kernels of {part!r} cannot be compiled: {error}") from error


def _is_ready(parts: Iterable[str]) -> bool:
    """Return whether all the given parts are compiled from the present sources."""
    name = _name(parts)
    if compiled.is_ready(name):
        return True
    stamps = all_stamps()
    is_ready = compiled.stamps(name) == stamps
    if is_ready:  # only sources outside the kernels were edited
        compiled.note(name, stamps)
    return is_ready


def _name(parts: Iterable[str]) -> compiled.Name:
    return "all" if set(parts) == set(PARTS) else "demonstration"


def _tell_compiled(told: SimpleQueue[str]) -> None:
    """Put the name of each kernel that this process compiles into a queue."""

    class Listener(event.Listener):
        def on_start(self, _: event.Event) -> None:
            pass

        def on_end(self, happened: event.Event) -> None:
            told.put(happened.data["dispatcher"].py_func.__qualname__)

    event.register("numba:compile", Listener())


# What the warm-up plans -----------------------------------------------------------------------


def _over_the_globe() -> Scenario:
    points = [(lat, lon) for lat in range(-80, 81, 20) for lon in range(-180, 180, 30)]
    return _mission(points, use_resources=True)


def _flown() -> Scenario:
    """Return a mission with slews in motion, turns to the sun, and contacts in parts."""
    globe = _over_the_globe()
    plain = globe.satellites[0].resources
    agility = Agility(slew_rate_deg_s=2.0, acceleration_deg_s2=0.2, slew_model="moving")
    resources = replace(
        plain,
        sun_pointing="slew",
        eclipse_aware=True,
        downlink_by_elevation=((0.0, plain.downlink_per_s), (90.0, 2.0 * plain.downlink_per_s)),
    )
    return _refitted(globe, agility=agility, resources=resources)


def _crowd(num_targets: int = 120, *, use_resources: bool = False) -> Scenario:
    """Return a mission of conflicting targets near the pole, whose proofs use every method."""
    random = np.random.default_rng(0)
    points = zip(
        random.uniform(60, 85, num_targets), random.uniform(-180, 180, num_targets), strict=True
    )
    return _mission(points, use_resources=use_resources)


def _few() -> Scenario:
    crowd = _crowd()
    return replace(crowd, targets=crowd.targets[:_FEW])


def _judge() -> None:
    """Plan with the rule-based planner: covers the referee, the reasons and the quick bound."""
    _plan(_flown(), Rule())


def _judge_worn() -> None:
    """Run the searches for reasons that occur only with a low battery and a full recorder."""
    globe = _over_the_globe()
    plain = globe.satellites[0].resources
    low = replace(plain, initial_battery_fraction=0.31, initial_recorder_fraction=0.74)
    worn = _refitted(globe, resources=low)
    _plan(worn, Rule())
    always = BlockedInterval(satellite_id="warm-up", start=worn.horizon.start, end=worn.horizon.end)
    with suppress(InvalidScenario):  # without any contact, the recorder's limit is broken
        _plan(replace(worn, pins=Pins(block=(always,))), Rule())


def _search(solver: str) -> Callable[[], None]:
    """Return only a solver's search: the judging of plans is already warmed by ``_judge``."""

    def search() -> None:
        SOLVERS[solver]().solve(_built(_flown()), Budget(), 0)

    return search


def _plain() -> None:
    """Plan with turns from rest to rest, and charge in all idle time."""
    plain = _over_the_globe()
    _plan(plain, Rule(), ForwardSearch(), Graph(path="longest"))
    Certified().solve(_built(plain), Budget(), 0)


def _free() -> None:
    _plan(_crowd(_SOME), Certified(), Graph(path="longest"))


def _spaced() -> None:
    _plan(replace(_few(), collect_spacing_s=30.0), Rule(), Certified())


def _continuous() -> None:
    crowd = replace(_crowd(_SOME), continuous_starts=True)
    _plan(crowd, Rule(), Certified(moves_per_task=1.0))
    problem = _built(crowd)
    image = Rule().solve(problem, Budget(), 0).plan.actions[0]
    target = problem.target_ids[problem.opportunities.site[image.opportunity]]
    start = crowd.horizon.start + timedelta(seconds=image.start_s)
    kept = PinnedAction(satellite_id="warm-up", target_id=target, start=start)
    _plan(replace(crowd, pins=Pins(keep=(kept,))), Rule())


def _continuous_with_resources() -> None:
    _plan(replace(_over_the_globe(), continuous_starts=True), Rule(), Certified(gap=0.5))


def _fleet() -> None:
    fleet = _two(_few())
    _plan(fleet, Rule(), Certified())
    # With so few targets, no plan at the multipliers is needed.
    FleetSearch(Incumbent(_built(fleet), Budget(), 0.0), 0).windows(1)


def _fleet_with_resources() -> None:
    _plan(_two(_crowd(use_resources=True)), Certified(gap=0.1))


def _shortage() -> None:
    """Run the searches that small missions do not need."""
    problem = _built(_over_the_globe())
    plan = Rule().solve(problem, Budget(), 0).plan
    AlternatingSearch(problem, plan, problem.typical_worth, Budget(), 0).step(1)
    paths, nothing = EnergyPaths(problem), np.zeros(len(problem.target_ids))
    ascent_on_energy(problem, paths, nothing, 1, 0).improve(1, Budget().stop)
    on_board = DataPaths.of(with_objective(problem, Objective(collected_share=0.9)))
    assert on_board is not None
    on_board.gain(np.append(nothing, 0.0))
    free = AgilitySearch(Incumbent(replace(problem, use_resources=False), Budget(), 0.0), 0)
    free.ascend()
    for _ in free.cut(1):
        pass
    Mcts(worthless="sunpoint").solve(problem, Budget(), 0)
    excluded_beside(problem.satellites[0], problem.satellites[0].rows[:1])


def _late() -> None:
    """Plan with images that lose worth until they are downlinked."""
    late = with_objective(
        _built(_over_the_globe()), Objective(collected_share=0.0, half_life_s=3600.0)
    )
    nothing = np.zeros(len(late.target_ids))
    LatencyAscent(late, nothing).improve(1, 0.0, Budget().stop)
    num_contacts = np.count_nonzero(late.opportunities.kind == CONTACT)
    queue_value(late, nothing, 1, contact_multipliers=np.zeros(num_contacts))


def _slow() -> None:
    """Plan for a satellite that reaches some tasks only by way of others."""
    problem = _built(_refitted(_crowd(), agility=Agility(slew_rate_deg_s=_SLOW_DEG_S)))
    Graph().solve(problem, Budget(), 0)
    Milp(formulation="pairwise").solve(problem, Budget(), 0)
    arc_network_of(problem)
    excluded_beside(problem.satellites[0], problem.satellites[0].rows[:1])


DEMONSTRATION: Final[dict[str, Callable[[], None]]] = {
    # Judging and the tree search take longest, so two processes begin with one each.
    "rule": _judge,
    **{name: _search(name) for name in ("mcts", "certified", "milp", "forward_search", "graph")},
    # What longer searches need in addition.
    "shortage": _shortage,
}
DEMONSTRATED: Final = 0.67
"""The share of the demonstration in the source lines of all kernels."""
PARTS: Final[dict[str, Callable[[], None]]] = {
    **DEMONSTRATION,
    "plain": _plain,
    "worn": _judge_worn,
    "free": _free,
    "spaced": _spaced,
    "slow": _slow,
    "continuous": _continuous,
    "continuous with resources": _continuous_with_resources,
    "late": _late,
    "fleet": _fleet,
    "fleet with resources": _fleet_with_resources,
}


def _plan(scenario: Scenario, *solvers: Solver) -> None:
    opportunities = None
    for solver in solvers:
        opportunities = plan_scenario(scenario, solver, 0, Budget(), opportunities).opportunities


def _built(scenario: Scenario) -> Problem:
    budget = Budget()
    return build_problem(scenario, compute_opportunities(scenario, budget), budget)


def _refitted(scenario: Scenario, **changes: Any) -> Scenario:
    """Return a mission with a changed satellite."""
    return replace(scenario, satellites=(replace(scenario.satellites[0], **changes),))


def _two(scenario: Scenario) -> Scenario:
    """Return a mission with a second satellite that follows the first."""
    (first,) = scenario.satellites
    orbit = replace(mean_elements(first.orbit), mean_anomaly_deg=20.0, norad_cat_id=2)
    return replace(scenario, satellites=(first, replace(first, id="later", orbit=orbit)))


def _mission(points: Iterable[tuple[float, float]], *, use_resources: bool) -> Scenario:
    orbit = OrbitElements(
        name="WARM-UP",
        norad_cat_id=1,
        object_id="",
        epoch=_START,
        mean_motion_rev_day=15.2,
        eccentricity=0.001,
        inclination_deg=90.0,
        raan_deg=0.0,
        arg_perigee_deg=0.0,
        mean_anomaly_deg=0.0,
    )
    resources = Resources.paper(orbit.period_s)
    return Scenario(
        horizon=Horizon(start=_START, end=_START + timedelta(hours=6)),
        satellites=(Satellite(id="warm-up", name="WARM-UP", orbit=orbit, resources=resources),),
        targets=tuple(
            Target(id=str(i), lat_deg=float(lat), lon_deg=float(lon))
            for i, (lat, lon) in enumerate(points)
        ),
        ground_stations=(GroundStation(id="pole", name="Pole", lat_deg=85.0, lon_deg=0.0),),
        use_resources=use_resources,
    )


if __name__ == "__main__":
    main()
