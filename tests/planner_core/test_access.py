"""Accesses: limits hold inside every window and fail outside it; no window is missed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.limits import Limits
from planner_core.access.windows import Accesses, find_accesses
from planner_core.domain import (
    GroundStation,
    Nadir,
    OrbitElements,
    Sensor,
    Target,
)
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.mask import mask_elevation_deg
from planner_core.orbits.sites import Sites
from tests.examples import examples
from tests.geometry import (
    Ground,
    SkyfieldPath,
    elevation_deg,
    hours,
    off_nadir_deg,
    orbit,
    satellite,
    windows_by_scan,
)

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


def target(lat_deg: float, lon_deg: float) -> Target:
    return Target(id=f"{lat_deg},{lon_deg}", lat_deg=lat_deg, lon_deg=lon_deg)


def some_targets(count: int, seed: int = 7) -> list[Target]:
    rng = np.random.default_rng(seed)
    lat = np.degrees(np.arcsin(rng.uniform(-0.95, 1.0, count)))
    return [
        target(float(a), float(b)) for a, b in zip(lat, rng.uniform(-180, 180, count), strict=True)
    ]


def accesses_of(
    targets: list[Target],
    sensor: Sensor,
    elements: OrbitElements | None = None,
    span_h: float = 24.0,
) -> Accesses:
    path = propagate(satellite(elements, sensor=sensor), hours(span_h))
    return find_accesses(path, Sites.of(targets), Limits.of_targets(sensor, targets))


def within_limits(position: Floats, ground: Ground, sensor: Sensor) -> Bools:
    angle = off_nadir_deg(position, ground, sensor.nadir)
    return np.asarray(
        (angle >= sensor.off_nadir_min_deg)
        & (angle <= sensor.off_nadir_max_deg)
        & (elevation_deg(position, ground) >= sensor.min_elevation_deg)
    )


@pytest.mark.parametrize("nadir", ["geodetic", "geocentric"])
def test_limits_hold_half_a_second_inside_and_fail_half_a_second_outside(nadir: Nadir) -> None:
    """Checked with Skyfield positions, at both edges of every window."""
    sensor = Sensor(nadir=nadir)
    targets = some_targets(60)
    found = accesses_of(targets, sensor)
    skyfield = SkyfieldPath(orbit(), hours(24))
    assert len(found) > 100
    for index, one in enumerate(targets):
        own = found.site == index
        ground = Ground.at(one.lat_deg, one.lon_deg)
        long = found.end_s[own] - found.start_s[own] > 1.0
        start, end = found.start_s[own][long], found.end_s[own][long]
        for t, expected in (
            (start + 0.5, True),
            (end - 0.5, True),
            (start - 0.5, False),
            (end + 0.5, False),
        ):
            inner = t[(t > 0.5) & (t < 86399.5)]
            if len(inner) > 0:
                holds = within_limits(skyfield.position_m(inner), ground, sensor)
                assert (holds == expected).all()


@examples(25)
@given(
    st.floats(11.0, 16.0),
    st.floats(0.0, 0.02),
    st.floats(0.0, 180.0),
    st.floats(0.0, 360.0),
    st.floats(-90.0, 90.0),
    st.floats(-180.0, 180.0),
    st.floats(0.0, 40.0),
    st.floats(10.0, 89.0),
    st.floats(0.0, 60.0),
    st.sampled_from(["geodetic", "geocentric"]),
)
def test_no_window_is_missed_and_none_invented(
    motion: float,
    eccentricity: float,
    inclination: float,
    raan: float,
    lat: float,
    lon: float,
    lowest: float,
    width: float,
    elevation: float,
    nadir: Nadir,
) -> None:
    """Against a scan of the planner's own path at every second, for random orbits and limits."""
    sensor = Sensor(
        off_nadir_min_deg=lowest,
        off_nadir_max_deg=min(90.0, lowest + width),
        min_elevation_deg=elevation,
        nadir=nadir,
    )
    elements = orbit(
        mean_motion_rev_day=motion,
        eccentricity=eccentricity,
        inclination_deg=inclination,
        raan_deg=raan,
    )
    path = propagate(satellite(elements, sensor=sensor), hours(12))
    one = [target(lat, lon)]
    found = find_accesses(path, Sites.of(one), Limits.of_targets(sensor, one))
    ground = Ground.at(lat, lon)
    expected = [
        window
        for window in windows_by_scan(
            lambda t: within_limits(path.state_itrf(t)[0], ground, sensor), path.duration_s
        )
        if window[1] - window[0] > 0.002
    ]
    # The scan may step over a window or gap shorter than a second: look for the scan's windows.
    for start, end in expected:
        inside = (found.end_s > start) & (found.start_s < end)
        assert abs(found.start_s[inside].min() - start) < 0.002
        assert abs(found.end_s[inside].max() - end) < 0.002
    for start, end in zip(found.start_s, found.end_s, strict=True):
        assert end - start < 1.0 or any(
            a - 0.002 <= start and end <= b + 0.002 for a, b in expected
        )


def test_grazing_passes_shorter_than_the_step_between_nodes_are_found() -> None:
    """A minimum elevation just below a pass's maximum leaves a window of seconds."""
    path = propagate(satellite(), hours(24))
    station = GroundStation(id="s", name="s", lat_deg=40.0, lon_deg=10.0, min_elevation_deg=0.0)
    site = Sites.of([station])
    ground = Ground.at(40.0, 10.0)
    passes = find_accesses(path, site, Limits.of_stations([station]))
    assert len(passes) >= 4
    for start, end in zip(passes.start_s, passes.end_s, strict=True):
        t = np.linspace(start, end, 20001)
        elevation = elevation_deg(path.state_itrf(t)[0], ground)
        grazing = replace(station, min_elevation_deg=float(elevation.max()) - 1e-4)
        found = find_accesses(path, site, Limits.of_stations([grazing]))
        inside = (found.start_s >= start) & (found.end_s <= end)
        assert inside.sum() == 1
        assert (found.end_s - found.start_s)[inside][0] < 30.0
        assert abs(found.start_s[inside][0] - t[elevation.argmax()]) < 15.0


def test_a_pass_overhead_is_split_by_the_smallest_off_nadir_angle() -> None:
    path = propagate(satellite(), hours(24))
    under, _ = path.state_itrf(np.array([5000.0]))
    lon = float(np.degrees(np.arctan2(under[0, 1], under[0, 0])))
    lat = float(np.degrees(np.arcsin(under[0, 2] / np.linalg.norm(under))))
    found = accesses_of([target(lat, lon)], Sensor(nadir="geocentric"))
    after = int(np.searchsorted(found.start_s, 5000.0))
    gap_s = found.start_s[after] - found.end_s[after - 1]
    assert 8.0 < gap_s < 16.0
    whole = accesses_of([target(lat, lon)], Sensor(nadir="geocentric", off_nadir_min_deg=0.0))
    assert ((whole.start_s < 5000.0) & (whole.end_s > 5000.0)).sum() == 1


def test_off_nadir_alone_never_sees_through_the_earth() -> None:
    targets = some_targets(40)
    found = accesses_of(targets, Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=90.0))
    path = propagate(satellite(), hours(24))
    for index, one in enumerate(targets):
        own = found.site == index
        middle = 0.5 * (found.start_s[own] + found.end_s[own])
        position, _ = path.state_itrf(middle)
        assert (elevation_deg(position, Ground.at(one.lat_deg, one.lon_deg)) > 0.0).all()


def test_left_and_right_share_out_what_either_side_sees() -> None:
    targets = some_targets(80)
    path = propagate(satellite(), hours(24))
    parts = {
        side: accesses_of(targets, Sensor(look_side=side)) for side in ("left", "right", "any")
    }
    assert len(parts["left"]) > 50
    assert len(parts["right"]) > 50
    length = {side: float((a.end_s - a.start_s).sum()) for side, a in parts.items()}
    assert length["left"] + length["right"] == pytest.approx(length["any"], rel=1e-4)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        found = parts[side]
        position, velocity = path.state_itrf(0.5 * (found.start_s + found.end_s))
        there = Sites.of(targets).position_m[found.site]
        left_of_track = (np.cross(position, velocity) * (there - position)).sum(axis=1)
        assert (sign * left_of_track > 0.0).all()


def test_a_target_narrows_the_limits_of_the_sensor_and_never_widens_them() -> None:
    narrow = [replace(t, off_nadir_min_deg=20.0, off_nadir_max_deg=30.0) for t in some_targets(50)]
    wide = [replace(t, off_nadir_min_deg=0.0, off_nadir_max_deg=80.0) for t in some_targets(50)]
    by_sensor = accesses_of(
        some_targets(50), Sensor(off_nadir_min_deg=20.0, off_nadir_max_deg=30.0)
    )
    by_target = accesses_of(narrow, Sensor())
    assert len(by_target) > 50
    assert by_target.start_s.tolist() == by_sensor.start_s.tolist()
    assert by_target.end_s.tolist() == by_sensor.end_s.tolist()
    plain = accesses_of(some_targets(50), Sensor())
    assert accesses_of(wide, Sensor()).start_s.tolist() == plain.start_s.tolist()


def test_windows_are_whole_milliseconds_within_the_horizon_in_order() -> None:
    found = accesses_of(some_targets(100), Sensor())
    for instants in (found.start_s, found.end_s):
        assert (np.round(instants * 1000.0) / 1000.0 == instants).all()
    assert (found.end_s > found.start_s).all()
    assert (np.diff(found.site) >= 0).all()
    same = np.diff(found.site) == 0
    assert (found.start_s[1:][same] > found.end_s[:-1][same]).all()


def test_windows_cut_by_the_horizon_say_so() -> None:
    one = some_targets(1)
    whole = accesses_of(one, Sensor())
    middle_s = float(0.5 * (whole.start_s[0] + whole.end_s[0]))
    path = propagate(satellite(), hours(middle_s / 3600.0))
    before = find_accesses(path, Sites.of(one), Limits.of_targets(Sensor(), one))
    assert not whole.ends_cut[0]
    assert before.ends_cut.tolist() == [False] * (len(before) - 1) + [True]
    assert not before.starts_cut.any()


def test_a_geostationary_satellite_sees_a_place_all_day_or_never() -> None:
    fixed = orbit(mean_motion_rev_day=1.0027379, eccentricity=1e-5, inclination_deg=0.01)
    path = propagate(satellite(fixed), hours(24))
    under, _ = path.state_itrf(np.zeros(1))
    lon = float(np.degrees(np.arctan2(under[0, 1], under[0, 0])))
    stations = [
        GroundStation(id=str(i), name="", lat_deg=10.0, lon_deg=east)
        for i, east in enumerate([lon, lon - 180.0 if lon > 0 else lon + 180.0])
    ]
    found = find_accesses(path, Sites.of(stations), Limits.of_stations(stations))
    assert found.site.tolist() == [0]
    assert (found.start_s[0], found.end_s[0]) == (0.0, 86400.0)
    assert found.starts_cut[0]
    assert found.ends_cut[0]


def test_a_stopped_search_ends_early() -> None:
    targets = some_targets(30)
    path = propagate(satellite(), hours(24))
    limits = Limits.of_targets(Sensor(), targets)
    stopped = find_accesses(path, Sites.of(targets), limits, np.ones(1, dtype=np.uint8))
    assert len(stopped) == 0


MASKS = [
    ((0.0, 5.0), (90.0, 30.0), (180.0, 8.0), (270.0, 40.0)),
    ((10.0, 5.0), (10.5, 60.0), (40.0, 60.0), (40.5, 5.0), (350.0, 12.0)),
    ((200.0, 25.0),),
]


@pytest.mark.parametrize("mask", MASKS)
def test_contacts_stand_above_the_azimuth_elevation_mask(
    mask: tuple[tuple[float, float], ...],
) -> None:
    """Compared with a scan of each pass every tenth of a second."""
    path = propagate(satellite(), hours(24))
    station = GroundStation(
        id="s", name="s", lat_deg=78.2, lon_deg=15.4, min_elevation_deg=7.0, elevation_mask=mask
    )
    site = Sites.of([station])
    ground = Ground.at(78.2, 15.4)

    def holds(t: Floats) -> Bools:
        position, _ = path.state_itrf(t)
        sight = position - ground.position_m
        east, north = sight @ site.east[0], sight @ site.north[0]
        azimuth = np.degrees(np.arctan2(east, north))
        floor = np.maximum(7.0, mask_elevation_deg(mask, azimuth))
        return np.asarray(elevation_deg(position, ground) >= floor)

    expected = np.array(windows_by_scan(holds, path.duration_s, 0.1))
    found = find_accesses(path, site, Limits.of_stations([station]))
    assert len(found) == len(expected) > 5
    assert np.abs(found.start_s - expected[:, 0]).max() < 0.002
    assert np.abs(found.end_s - expected[:, 1]).max() < 0.002
