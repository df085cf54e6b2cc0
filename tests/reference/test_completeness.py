"""Every window and no other, against a brute force on Skyfield's positions.

The targets are real Landsat scene centres; orbits of all regimes; both verticals. Windows
and gaps of 0.02 s and longer must agree one to one; edges of windows of 20 s and longer to
2 ms (99 of 100) and 10 ms (all).
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.limits import Limits
from planner_core.access.windows import find_accesses
from planner_core.domain import (
    Horizon,
    Nadir,
    OrbitElements,
    Sensor,
    Target,
)
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites
from tests.brute_force_windows import BruteForce, Comparison
from tests.examples import examples
from tests.geometry import Ground, SkyfieldTable, hours, off_nadir_deg, orbit, satellite


def landsat_targets(folder: Path) -> list[Target]:
    """Return the distinct real scene centres of both files, 3,829 of them."""
    sites: dict[tuple[float, float], None] = {}
    for name in ("landsat_dev_half.csv", "landsat_1200.csv"):
        with (folder / "targets" / name).open() as file:
            rows = csv.DictReader(file)
            sites |= dict.fromkeys((float(row["lat"]), float(row["lon"])) for row in rows)
    return [Target(id=str(i), lat_deg=lat, lon_deg=lon) for i, (lat, lon) in enumerate(sites)]


def spread_targets(count: int) -> list[Target]:
    """Return points spread evenly over the globe, both poles included."""
    k = np.arange(count)
    lat = np.degrees(np.arcsin(np.clip(1.0 - 2.0 * k / (count - 1), -1.0, 1.0)))
    lon = (k * 137.50776405) % 360.0 - 180.0
    return [Target(id=str(i), lat_deg=float(lat[i]), lon_deg=float(lon[i])) for i in range(count)]


@cache
def skyfield_table(elements: OrbitElements, horizon: Horizon) -> SkyfieldTable:
    return SkyfieldTable(elements, horizon)


def compare(
    elements: OrbitElements, sensor: Sensor, targets: list[Target], horizon: Horizon
) -> Comparison:
    path = propagate(satellite(elements, sensor=sensor), horizon)
    found = find_accesses(path, Sites.of(targets), Limits.of_targets(sensor, targets))
    first = np.searchsorted(found.site, np.arange(len(targets) + 1))
    brute = BruteForce(skyfield_table(elements, horizon), sensor)
    comparison = Comparison()
    for index, one in enumerate(targets):
        rows = slice(first[index], first[index + 1])
        comparison.add(
            list(zip(found.start_s[rows].tolist(), found.end_s[rows].tolist(), strict=True)),
            brute.windows(Ground.at(one.lat_deg, one.lon_deg, one.alt_m)),
        )
    return comparison


@pytest.mark.parametrize(
    ("nadir", "num_targets"),
    [
        ("geocentric", 400),
        ("geodetic", 400),
        pytest.param("geocentric", 3600, marks=pytest.mark.full_size),
        pytest.param("geodetic", 800, marks=pytest.mark.full_size),
    ],
)
def test_the_paper_orbit_over_real_targets(
    shared_data: Path, nadir: Nadir, num_targets: int
) -> None:
    targets = landsat_targets(shared_data)[:num_targets]
    result = compare(orbit(), Sensor(nadir=nadir), targets, hours(24))
    assert (result.missing, result.extra) == (0, 0)
    assert result.num_windows > 3 * num_targets
    errors_ms = result.edge_errors_ms()
    assert np.percentile(errors_ms, 99) <= 2.0
    assert errors_ms.max() <= 10.0


REGIMES = {
    "low": orbit(mean_motion_rev_day=16.2, inclination_deg=51.6, eccentricity=0.0005),
    "sun_synchronous": orbit(mean_motion_rev_day=14.57, inclination_deg=98.2, raan_deg=40.0),
    "retrograde": orbit(mean_motion_rev_day=14.0, inclination_deg=140.0),
    "equatorial": orbit(mean_motion_rev_day=15.0, inclination_deg=0.1),
    "molniya": orbit(
        mean_motion_rev_day=2.006, eccentricity=0.74, inclination_deg=63.4, arg_perigee_deg=270.0
    ),
    "elliptic": orbit(
        mean_motion_rev_day=10.0, eccentricity=0.29, inclination_deg=40.0, mean_anomaly_deg=90.0
    ),
    "navigation": orbit(mean_motion_rev_day=2.0056, eccentricity=0.01, inclination_deg=55.0),
    "geosynchronous": orbit(mean_motion_rev_day=1.0027, eccentricity=0.001, inclination_deg=15.0),
}


@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize(
    "sensor",
    [
        Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=90.0, min_elevation_deg=5.0),
        Sensor(off_nadir_min_deg=3.0, off_nadir_max_deg=8.0),
        Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=90.0, min_elevation_deg=70.0),
    ],
    ids=["mask5", "ring", "high"],
)
def test_orbits_of_every_regime(regime: str, sensor: Sensor) -> None:
    result = compare(REGIMES[regime], sensor, spread_targets(40), hours(24))
    assert (result.missing, result.extra) == (0, 0)
    errors_ms = result.edge_errors_ms()
    if len(errors_ms) > 0:
        assert errors_ms.max() <= 20.0


@examples(8)
@given(
    st.floats(11.5, 16.0),
    st.floats(0.0, 0.02),
    st.floats(0.0, 180.0),
    st.floats(0.0, 360.0),
    st.floats(0.0, 30.0),
    st.floats(5.0, 60.0),
    st.floats(0.0, 70.0),
    st.sampled_from(["geodetic", "geocentric"]),
)
def test_generated_orbits_and_limits(
    motion: float,
    eccentricity: float,
    inclination: float,
    raan: float,
    lowest: float,
    width: float,
    elevation: float,
    nadir: Nadir,
) -> None:
    elements = orbit(
        mean_motion_rev_day=motion,
        eccentricity=eccentricity,
        inclination_deg=inclination,
        raan_deg=raan,
    )
    sensor = Sensor(
        off_nadir_min_deg=lowest,
        off_nadir_max_deg=lowest + width,
        min_elevation_deg=elevation,
        nadir=nadir,
    )
    result = compare(elements, sensor, spread_targets(30), hours(8))
    assert (result.missing, result.extra) == (0, 0)


def test_grazing_passes_between_two_nodes_are_found_by_name() -> None:
    """Targets just inside the reach of one pass: windows of seconds, nodes minutes apart."""
    elements, day = orbit(), hours(24)
    path = propagate(satellite(elements), day)
    wide = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=89.0)
    targets = spread_targets(40)
    found = find_accesses(path, Sites.of(targets), Limits.of_targets(wide, targets))
    num_short = 0
    for row in range(0, len(found), 5):
        one = targets[found.site[row]]
        t = np.linspace(found.start_s[row], found.end_s[row], 2001)
        ground = Ground.at(one.lat_deg, one.lon_deg)
        least = float(off_nadir_deg(path.state_itrf(t)[0], ground, "geodetic").min())
        grazing = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=least + 2e-3)
        result = compare(elements, grazing, [one], day)
        assert (result.missing, result.extra) == (0, 0)
        here = find_accesses(path, Sites.of([one]), Limits.of_targets(grazing, [one]))
        length_s = here.end_s - here.start_s
        num_short += int((length_s < 60.0).sum())
        assert ((here.start_s >= found.start_s[row]) & (here.end_s <= found.end_s[row])).any()
    assert num_short >= 20
