"""How long the access search takes, and a peer's (``python -m benchmarks.access``).

The peer is brahe at its default step of 60 s, if it is installed (the extra ``peers``); both are
timed in one run, so the ratios mean more than the times. Window counts tell what each finds: a
step of 60 s misses grazing passes and joins the two halves of an overhead pass.
"""

from __future__ import annotations

import importlib
import importlib.util
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any

import numpy as np
from sgp4.exporter import export_tle

from planner_core.access.limits import Limits, TargetLimits
from planner_core.access.windows import find_accesses
from planner_core.domain import (
    Horizon,
    OrbitElements,
    Resources,
    Satellite,
    Sensor,
    Target,
    mean_elements,
)
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sgp4_record import satrec
from planner_core.orbits.sites import Sites

START = datetime(2019, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, kw_only=True)
class Case:
    """Satellites, targets and the time span."""

    name: str
    satellites: tuple[Satellite, ...]
    targets: tuple[Target, ...]
    days: int = 1

    @property
    def horizon(self) -> Horizon:
        return Horizon(start=START, end=START + timedelta(days=self.days))


def satellite(sensor: Sensor, **elements: float) -> Satellite:
    values: dict[str, Any] = {
        "mean_motion_rev_day": 15.24162312,
        "eccentricity": 0.001,
        "inclination_deg": 90.0,
        "raan_deg": 0.0,
        "arg_perigee_deg": 0.0,
        "mean_anomaly_deg": 0.0,
    } | elements
    orbit = OrbitElements(name=None, norad_cat_id=1, object_id="", epoch=START, **values)
    resources = Resources.paper(orbit.period_s)
    return Satellite(id="s", name="s", orbit=orbit, sensor=sensor, resources=resources)


def scenes(count: int) -> tuple[Target, ...]:
    """Return points as dense as scene centres under a polar orbit: denser towards the poles."""
    rng = np.random.default_rng(0)
    along = np.radians(rng.uniform(-60.0, 100.0, count))
    lat = np.degrees(np.arcsin(np.sin(np.radians(98.2)) * np.sin(along)))
    return _targets(lat, rng.uniform(-180.0, 180.0, count))


def spread(count: int, seed: int = 42) -> tuple[Target, ...]:
    """Return points spread evenly over the globe."""
    rng = np.random.default_rng(seed)
    lat = np.degrees(np.arcsin(rng.uniform(-1.0, 1.0, count)))
    return _targets(lat, rng.uniform(-180.0, 180.0, count))


def _targets(lat: Any, lon: Any) -> tuple[Target, ...]:
    return tuple(
        Target(id=str(i), lat_deg=float(lat[i]), lon_deg=float(lon[i])) for i in range(len(lat))
    )


def ours(case: Case, threads: int = 1) -> int:
    """Return the number of windows, computed from elements and targets."""
    sites, own = Sites.of(case.targets), TargetLimits.of(case.targets)

    def windows_of(one: Satellite) -> int:
        path = propagate(one, case.horizon)
        return len(find_accesses(path, sites, Limits.of_targets(one.sensor, own)))

    with ThreadPoolExecutor(threads) as pool:
        return sum(pool.map(windows_of, case.satellites))


def brahe_windows(case: Case, brahe: Any) -> int:
    sensor = case.satellites[0].sensor
    limits = [brahe.ElevationConstraint(min_elevation_deg=max(sensor.min_elevation_deg, 0.0))]
    if sensor.off_nadir_max_deg < 90.0:
        limits.append(
            brahe.OffNadirConstraint(
                min_off_nadir_deg=sensor.off_nadir_min_deg or None,
                max_off_nadir_deg=sensor.off_nadir_max_deg,
            )
        )
    propagators = [
        brahe.SGPPropagator.from_tle(*export_tle(satrec(mean_elements(s.orbit))))
        for s in case.satellites
    ]
    locations = [brahe.PointLocation(t.lon_deg, t.lat_deg, 0.0) for t in case.targets]
    start = brahe.Epoch.from_datetime(START.year, START.month, START.day, 0, 0, 0.0, 0.0, brahe.UTC)
    found = brahe.location_accesses(
        locations,
        propagators,
        start,
        start + 86400.0 * case.days,
        brahe.ConstraintAll(limits) if len(limits) > 1 else limits[0],
    )
    return len(found)


def timed(run: Callable[[], int], times: int) -> tuple[float, int]:
    """Return the median seconds, and the result."""
    taken, found = [], 0
    for _ in range(times):
        began = time.perf_counter()
        found = run()
        taken.append(time.perf_counter() - began)
    return statistics.median(taken), found


def cases() -> Sequence[Case]:
    imager = Sensor(off_nadir_min_deg=5.0, off_nadir_max_deg=55.0, nadir="geocentric")
    wide = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=55.0, nadir="geocentric")
    horizon10 = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=90.0, min_elevation_deg=10.0)
    station = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=90.0, min_elevation_deg=5.0)
    space_station = satellite(horizon10, mean_motion_rev_day=15.49, inclination_deg=51.64)
    polar = _targets(np.array([78.23, -72.02]), np.array([15.39, 2.53]))
    fleet = tuple(
        satellite(wide, inclination_deg=97.5, raan_deg=10.0 * i, mean_anomaly_deg=37.0 * i)
        for i in range(36)
    )
    imagers, scene_targets = (satellite(imager),), scenes(3600)
    return (
        Case(name="1 imager, 3600 scenes", satellites=imagers, targets=scene_targets),
        Case(name="the same, 7 days", satellites=imagers, targets=scene_targets, days=7),
        Case(name="space station, 100 points", satellites=(space_station,), targets=spread(100)),
        Case(name="1 satellite, 2 stations", satellites=(satellite(station),), targets=polar),
        Case(name="36 satellites, 10000 points", satellites=fleet, targets=spread(10_000)),
    )


def main() -> None:
    """Print a table: times, windows, and the peer's."""
    has_peer = importlib.util.find_spec("brahe") is not None
    brahe = importlib.import_module("brahe") if has_peer else None
    if brahe is not None:
        brahe.initialize_eop()
    print(f"{'case':<30}{'ours_s':>9}{'2 threads':>10}{'windows':>9}{'us/window':>10}"
          f"{'brahe_s':>9}{'windows':>9}{'ratio':>7}")  # fmt: skip
    for case in cases():
        ours(case)
        big = len(case.satellites) > 1
        ours_s, found = timed(partial(ours, case), 3 if big else 9)
        line = f"{case.name:<30}{ours_s:9.4f}"
        two = f"{timed(partial(ours, case, 2), 3)[0]:10.4f}" if big else f"{'':10}"
        line += f"{two}{found:9}{ours_s / found * 1e6:10.2f}"
        if brahe is not None and not big:
            peer_s, theirs = timed(partial(brahe_windows, case, brahe), 1)
            line += f"{peer_s:9.3f}{theirs:9}{peer_s / ours_s:7.0f}"
        print(line)


if __name__ == "__main__":
    main()
