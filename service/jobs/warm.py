"""Load the solvers and run their kernels once, so that no job pays for it.

``python -m service.jobs.warm`` fills the cache of compiled kernels on disk.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Final

import numpy as np

from planner_core.budget import Budget
from planner_core.domain import (
    GroundStation,
    Horizon,
    OrbitElements,
    Resources,
    Satellite,
    Scenario,
    Target,
)
from planner_core.errors import InvalidScenario
from planner_core.pins import BlockedInterval, Pins
from planner_core.run import plan_scenario
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import (
    SOLVERS,
    Certified,
    Graph,
    Rule,
)

_START: Final = datetime(2026, 1, 1, tzinfo=UTC)
_FEW: Final = 40  # targets


def main() -> None:
    """Compile what is not yet compiled, and say how long it took."""
    began_s = time.monotonic()
    warm_up()
    print(f"Kernels are ready ({time.monotonic() - began_s:.1f} s).")


def warm_up() -> None:
    """Plan tiny missions with every solver, so that all kernels are compiled and loaded."""
    over_the_globe = [(lat, lon) for lat in range(-80, 81, 20) for lon in range(-180, 180, 30)]
    _plan(_mission(over_the_globe, use_resources=True), [solver() for solver in SOLVERS.values()])
    # Where a battery is low and a recorder full, reasons are looked for as nowhere else.
    worn = _mission(over_the_globe, use_resources=True, is_worn=True)
    _plan(worn, [Rule()])
    always = BlockedInterval(satellite_id="warm-up", start=worn.horizon.start, end=worn.horizon.end)
    with suppress(InvalidScenario):  # the recorder does not bear that no contact is left
        _plan(replace(worn, pins=Pins(block=(always,))), [Rule()])
    # Near the pole targets are in each other's way: proofs need all there is to prove with.
    random = np.random.default_rng(0)
    crowd = zip(random.uniform(60, 85, 120), random.uniform(-180, 180, 120), strict=True)
    crowded = _mission(crowd, use_resources=False)
    _plan(crowded, [Certified(), Graph(path="longest")])
    # A choice of starts, free starts and fleets have bounds and searches of their own.
    few = replace(crowded, targets=crowded.targets[:_FEW])
    _plan(replace(few, collect_spacing_s=30.0), [Rule(), Certified()])
    _plan(replace(crowded, continuous_starts=True), [Rule(), Certified(moves_per_task=1.0)])
    _plan(replace(few, satellites=_two(few.satellites[0])), [Rule(), Certified()])
    fed = _mission(over_the_globe, use_resources=True)
    _plan(replace(fed, continuous_starts=True), [Rule(), Certified(gap=0.5)])
    shared = replace(crowded, satellites=_two(crowded.satellites[0]), use_resources=True)
    _plan(shared, [Certified(gap=0.1)])


def _plan(scenario: Scenario, solvers: Iterable[Solver]) -> None:
    opportunities = None
    for solver in solvers:
        opportunities = plan_scenario(scenario, solver, 0, Budget(), opportunities).opportunities


def _two(satellite: Satellite) -> tuple[Satellite, Satellite]:
    """Return a satellite and another that follows it."""
    later = replace(satellite.orbit, mean_anomaly_deg=20.0, norad_cat_id=2)
    return satellite, replace(satellite, id="later", orbit=later)


def _mission(
    points: Iterable[tuple[float, float]], *, use_resources: bool, is_worn: bool = False
) -> Scenario:
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
    if is_worn:
        resources = replace(
            resources, initial_battery_fraction=0.31, initial_recorder_fraction=0.74
        )
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
