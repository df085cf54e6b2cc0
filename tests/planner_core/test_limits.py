"""Light, time, side and direction: each limit compared with a plain check every second."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.limits import Limits
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.access.windows import find_accesses
from planner_core.budget import Budget
from planner_core.domain import Horizon, Scenario, Sensor, Target
from planner_core.errors import InvalidScenario
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.sites import Sites, view
from planner_core.problem import ACCESS_FOUND, OUTSIDE_LIMITS
from planner_core.reasons.access_changes import access_changes
from tests.examples import examples
from tests.geometry import YEAR_2019, hours, orbit, satellite, windows_by_scan

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

WIDE = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=60.0)


def plainly_within(path: Ephemeris, limits: Sensor | Target, target: Target, t: Floats) -> Bools:
    """Check the limits of light, time, side and direction instant by instant."""
    site = Sites.of([target])
    position, velocity = path.state_itrf(t)
    sun = path.sun_itrf(t)
    height_deg = np.degrees(np.arcsin(sun @ site.up[0]))
    holds = np.ones(len(t), dtype=np.bool_)
    if limits.sun_elevation_min_deg is not None:
        holds &= height_deg >= limits.sun_elevation_min_deg
    if limits.sun_elevation_max_deg is not None:
        holds &= height_deg <= limits.sun_elevation_max_deg
    if limits.local_time_from_h is not None and limits.local_time_to_h is not None:
        sun_lon_deg = np.degrees(np.arctan2(sun[:, 1], sun[:, 0]))
        time_h = (12.0 + (target.lon_deg - sun_lon_deg) / 15.0) % 24.0
        since_h = (time_h - limits.local_time_from_h) % 24.0
        span_h = (limits.local_time_to_h - limits.local_time_from_h) % 24.0
        holds &= (since_h <= span_h) | (span_h == 0.0)
    left = np.cross(position, velocity) @ site.position_m[0] >= 0.0
    if limits.look_side != "any":
        holds &= left if limits.look_side == "left" else ~left
    if limits.orbit_direction != "any":
        north = velocity[:, 2] >= 0.0
        holds &= north if limits.orbit_direction == "ascending" else ~north
    return np.asarray(holds)


def assert_same_windows(sensor: Sensor, target: Target, span_h: float = 24.0) -> int:
    path = propagate(satellite(orbit(inclination_deg=97.4)), hours(span_h))
    site = Sites.of([target])

    def holds(t: Floats) -> Bools:
        seen = view(path, site.at(np.zeros(len(t), dtype=np.int32)), t, sensor.nadir)
        return np.asarray(
            (seen.elevation_deg >= 0.0)
            & (seen.off_nadir_deg <= sensor.off_nadir_max_deg)
            & plainly_within(path, sensor, target, t)
            & plainly_within(path, target, target, t)
        )

    expected = [w for w in windows_by_scan(holds, path.duration_s) if w[1] - w[0] > 0.002]
    found = find_accesses(path, site, Limits.of_targets(sensor, [target]))
    lasting = found.end_s - found.start_s > 1.0
    for start, end in expected:
        inside = (found.end_s > start) & (found.start_s < end)
        assert abs(found.start_s[inside].min() - start) < 0.002
        assert abs(found.end_s[inside].max() - end) < 0.002
    assert lasting.sum() <= len(expected)
    return len(expected)


def test_a_collect_keeps_clear_of_the_sun() -> None:
    """Around New Year the sun is in the south: seen from the north it glares behind a target."""
    path = propagate(satellite(orbit(inclination_deg=97.4)), hours(24.0))
    site = Sites.of([NORTH])
    sensor = replace(WIDE, sun_exclusion_deg=75.0)

    def angle_deg(t: Floats) -> Floats:
        position, _ = path.state_itrf(t)
        sight = site.position_m[0] - position
        sight /= np.linalg.norm(sight, axis=1)[:, None]
        return np.asarray(np.degrees(np.arccos(np.einsum("ij,ij->i", sight, path.sun_itrf(t)))))

    def holds(t: Floats) -> Bools:
        seen = view(path, site.at(np.zeros(len(t), dtype=np.int32)), t, sensor.nadir)
        in_sight = (seen.elevation_deg >= 0.0) & (seen.off_nadir_deg <= sensor.off_nadir_max_deg)
        return np.asarray(in_sight & (angle_deg(t) >= 75.0))

    expected = [w for w in windows_by_scan(holds, path.duration_s) if w[1] - w[0] > 0.01]
    found = find_accesses(path, site, Limits.of_targets(sensor, [NORTH]))
    whole = find_accesses(path, site, Limits.of_targets(WIDE, [NORTH]))
    assert len(found) == len(expected)
    assert found.start_s == pytest.approx([w[0] for w in expected], abs=0.002)
    assert found.end_s == pytest.approx([w[1] for w in expected], abs=0.002)
    assert 0.0 < (found.end_s - found.start_s).sum() < (whole.end_s - whole.start_s).sum()


NORTH = Target(id="north", lat_deg=70.0, lon_deg=25.0)


@pytest.mark.parametrize(
    "limits",
    [
        {"sun_elevation_min_deg": -10.0},
        {"sun_elevation_max_deg": -6.0},
        {"sun_elevation_min_deg": -30.0, "sun_elevation_max_deg": -20.0},
        {"local_time_from_h": 6.0, "local_time_to_h": 6.83},
        {"local_time_from_h": 16.0, "local_time_to_h": 6.0},
        {"local_time_from_h": 0.0, "local_time_to_h": 24.0},
        {"local_time_from_h": 4.0, "local_time_to_h": 3.0},
        {"look_side": "left"},
        {"look_side": "right"},
        {"orbit_direction": "ascending"},
        {"orbit_direction": "descending"},
    ],
    ids=str,
)
def test_a_limit_of_the_sensor_or_of_the_target_cuts_the_same_windows(
    limits: dict[str, float],
) -> None:
    by_sensor = assert_same_windows(replace(WIDE, **limits), NORTH)  # type: ignore[arg-type]
    by_target = assert_same_windows(WIDE, replace(NORTH, **limits))  # type: ignore[arg-type]
    assert 0 < by_sensor == by_target <= assert_same_windows(WIDE, NORTH)


def test_contrary_wishes_of_sensor_and_target_leave_nothing() -> None:
    for name, one, other in (
        ("look_side", "left", "right"),
        ("orbit_direction", "ascending", "descending"),
    ):
        sensor = replace(WIDE, **{name: one})  # type: ignore[arg-type]
        target = replace(NORTH, **{name: other})  # type: ignore[arg-type]
        assert assert_same_windows(sensor, target) == 0


@examples(20)
@given(
    st.floats(-80.0, 80.0),
    st.floats(-180.0, 180.0),
    st.tuples(st.floats(-60.0, 40.0), st.floats(1.0, 60.0)),
    st.tuples(st.integers(0, 23), st.integers(1, 24)).filter(lambda span: span[0] != span[1]),
    st.tuples(st.integers(0, 23), st.integers(1, 24)).filter(lambda span: span[0] != span[1]),
    st.sampled_from(["left", "right", "any"]),
    st.sampled_from(["ascending", "descending", "any"]),
)
def test_any_mixture_of_limits_cuts_the_windows_that_a_scan_finds(
    lat: float,
    lon: float,
    sun: tuple[float, float],
    local: tuple[int, int],
    own: tuple[int, int],
    side: str,
    direction: str,
) -> None:
    sensor = replace(
        WIDE,
        sun_elevation_min_deg=sun[0],
        local_time_from_h=float(local[0]),
        local_time_to_h=float(local[1]),
        orbit_direction=direction,  # type: ignore[arg-type]
    )
    target = Target(
        id="t",
        lat_deg=lat,
        lon_deg=lon,
        sun_elevation_max_deg=min(90.0, sun[0] + sun[1]),
        local_time_from_h=float(own[0]),
        local_time_to_h=float(own[1]),
        look_side=side,  # type: ignore[arg-type]
    )
    assert_same_windows(sensor, target, 12.0)


def test_each_target_keeps_its_own_limits_in_a_mixed_list() -> None:
    mixed = [
        NORTH,
        replace(NORTH, id="lit", sun_elevation_min_deg=-10.0),
        replace(NORTH, id="high", min_elevation_deg=50.0),
        replace(NORTH, id="noon", local_time_from_h=9.0, local_time_to_h=15.0),
        replace(NORTH, id="left", look_side="left"),
    ]
    path = propagate(satellite(), hours(24))
    together = find_accesses(path, Sites.of(mixed), Limits.of_targets(WIDE, mixed))
    for index, one in enumerate(mixed):
        alone = find_accesses(path, Sites.of([one]), Limits.of_targets(WIDE, [one]))
        own = together.site == index
        assert together.start_s[own].tolist() == alone.start_s.tolist()
        assert together.end_s[own].tolist() == alone.end_s.tolist()
    assert len(set(np.bincount(together.site).tolist())) > 1


def test_a_high_target_has_a_high_horizon() -> None:
    """For a target 8 km high the satellite rises later and sets earlier than at sea level."""
    mountain = replace(NORTH, alt_m=8000.0)
    limits = Sensor(off_nadir_min_deg=0.0, off_nadir_max_deg=90.0)
    path = propagate(satellite(), hours(3))
    low, high = (
        find_accesses(path, Sites.of([t]), Limits.of_targets(limits, [t]))
        for t in (NORTH, mountain)
    )
    assert len(low) == len(high) == 2
    assert (high.start_s > low.start_s).all()
    assert (high.end_s < low.end_s).all()


@pytest.mark.parametrize(
    ("limits", "pointer"),
    [
        ({"sun_elevation_min_deg": 95.0}, "/sun_elevation_min_deg"),
        ({"sun_elevation_max_deg": float("nan")}, "/sun_elevation_max_deg"),
        ({"sun_elevation_min_deg": 5.0, "sun_elevation_max_deg": 4.0}, "/sun_elevation_max_deg"),
        ({"local_time_from_h": 25.0, "local_time_to_h": 3.0}, "/local_time_from_h"),
        ({"local_time_from_h": 5.0}, "/local_time_to_h"),
        ({"local_time_from_h": 5.0, "local_time_to_h": 5.0}, "/local_time_to_h"),
        ({"off_nadir_max_deg": 95.0}, "/off_nadir_max_deg"),
    ],
    ids=str,
)
def test_impossible_limits_are_refused_with_the_field(
    limits: dict[str, float], pointer: str
) -> None:
    for make in (
        lambda: replace(WIDE, **limits),  # type: ignore[arg-type]
        lambda: replace(NORTH, **limits),  # type: ignore[arg-type]
    ):
        with pytest.raises(InvalidScenario) as caught:
            make()
        assert caught.value.fault.pointer == pointer


def test_a_target_that_the_sun_rules_out_is_told_the_angle_that_would_do() -> None:
    flown = satellite(orbit(inclination_deg=97.4), sensor=replace(WIDE, sun_exclusion_deg=179.0))
    asked = Scenario(
        horizon=Horizon(start=YEAR_2019, end=YEAR_2019 + timedelta(hours=24)),
        satellites=(flown,),
        targets=(NORTH,),
        use_resources=False,
    )
    assert compute_opportunities(asked, Budget()).target_access[0] == OUTSIDE_LIMITS
    changes = {c.setting: c.value for c in access_changes(asked, 0, Budget())}
    assert set(changes) == {"sun_exclusion_deg"}
    value = changes["sun_exclusion_deg"]
    assert isinstance(value, float)
    for angle_deg, has_access in ((value, True), (value + 0.1, False)):
        sensor = replace(flown.sensor, sun_exclusion_deg=angle_deg)
        tried = replace(asked, satellites=(replace(flown, sensor=sensor),))
        found = compute_opportunities(tried, Budget()).target_access[0]
        assert (found == ACCESS_FOUND) == has_access
