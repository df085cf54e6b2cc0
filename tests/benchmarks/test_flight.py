"""The parts of the flight that need no Basilisk: world, rotations, reference and verdict."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.flight import rodrigues, world
from benchmarks.flight.judge import judge
from benchmarks.flight.mission import Floats, Mission, missions
from benchmarks.flight.reference import STEP_S, Flight, Pilot, Reference, limits_of
from benchmarks.flight.report import is_flyable
from benchmarks.flight.rotations import BORESIGHT, bursts_s, draw, norm, solve, turned
from tests.examples import examples

# Compilation takes half a minute.
pytestmark = pytest.mark.full_size

_OMM = {
    "OBJECT_NAME": "TEST", "OBJECT_ID": "2019-001A", "CLASSIFICATION_TYPE": "U",
    "EPOCH": "2019-01-01T00:00:00", "MEAN_MOTION": 15.24162312, "ECCENTRICITY": 0.001,
    "INCLINATION": 90.0, "RA_OF_ASC_NODE": 0.0, "ARG_OF_PERICENTER": 0.0, "MEAN_ANOMALY": 0.0,
    "EPHEMERIS_TYPE": 0, "NORAD_CAT_ID": 1, "ELEMENT_SET_NO": 999, "REV_AT_EPOCH": 0,
    "BSTAR": 0.0, "MEAN_MOTION_DOT": 0.0, "MEAN_MOTION_DDOT": 0.0,
}  # fmt: skip
_START = datetime(2019, 1, 1, tzinfo=UTC)
vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda v: norm(v) > 0.1)


def _instant(seconds: float) -> str:
    return datetime.fromtimestamp(_START.timestamp() + seconds, UTC).isoformat()


def _files(*collects: tuple[float, float, float], hours: float = 0.5) -> tuple[Any, Any]:
    """Return a scenario and a timeline with collects of 30 s: start, latitude and longitude."""
    targets = [{"id": f"t{i}", "lat_deg": lat, "lon_deg": lon, "alt_m": 0.0}
               for i, (_, lat, lon) in enumerate(collects)]  # fmt: skip
    actions = [{"mode": "collect", "start": _instant(s), "end": _instant(s + 30.0),
                "target_id": f"t{i}", "station_id": None}
               for i, (s, _, _) in enumerate(collects)]  # fmt: skip
    agility = {"slew_rate_deg_s": 1.0, "acceleration_deg_s2": 0.1, "settle_s": 5.0}
    satellite = {"id": "s", "name": "test", "omm": _OMM, "agility": agility, "resources": "paper"}
    scenario = {"targets": targets, "ground_stations": [], "satellites": [satellite]}
    planned = {"id": "s", "actions": actions, "resources": {
        "time": [_instant(0.0), _instant(3600.0 * hours)],
        "battery_fraction": [0.5, 0.5], "recorder_fraction": [0.0, 0.0]}}  # fmt: skip
    horizon = {"start": _instant(0.0), "end": _instant(3600.0 * hours)}
    timeline = {"horizon": horizon, "use_resources": True, "satellites": [planned]}
    # In the form read from files.
    return json.loads(json.dumps(scenario)), json.loads(json.dumps(timeline))


def _mission(*collects: tuple[float, float, float]) -> Mission:
    (mission,) = missions(*_files(*collects))
    return mission


def _below(mission: Mission, time_s: float) -> tuple[float, float]:
    """Return the point below the satellite on a sphere: close enough to look at."""
    where = world.orbit(mission)
    x, y, z = world.satellite_km(where, time_s)[0]
    turned_rad = where.gmst_rad + world.EARTH_RATE_RAD_S * time_s
    lon_deg = math.degrees(math.atan2(y, x) - turned_rad)
    return math.degrees(math.atan2(z, math.hypot(x, y))), (lon_deg + 180.0) % 360.0 - 180.0


@given(vectors, vectors)
@examples(100)
def test_parameters_tell_the_boresight(rotation: Floats, other: Floats) -> None:
    pose = turned(turned(np.eye(3), 3.0 * rotation), 3.0 * other)
    found = rodrigues.parameters(pose[None])
    assert np.abs(rodrigues.boresights(found)[0] - pose[:, BORESIGHT]).max() < 1e-12
    assert norm(found[0]) <= 1.0 + 1e-12  # by at most 180 deg


@given(vectors, vectors, vectors, st.floats(20.0, 400.0))
@examples(100)
def test_a_turn_ends_on_the_line_of_sight_at_its_rate(
    direction: Floats, spin: Floats, end_spin: Floats, takes_s: float
) -> None:
    direction = direction / norm(direction)
    if direction[BORESIGHT] < -0.99:
        return  # almost opposite: any axis is right
    spin, end_spin, acceleration = 0.005 * spin, 0.005 * end_spin, 0.002
    found, cruise = solve(np.eye(3), spin, direction, end_spin, takes_s, acceleration)
    if not found or sum(bursts_s(spin, cruise, end_spin, acceleration)) > takes_s:
        return
    num_steps = int(takes_s / STEP_S) + 1
    poses, rates = np.zeros((num_steps, 3, 3)), np.zeros((num_steps, 3))
    span_s = np.array([0.0, takes_s])
    end = draw(np.eye(3), spin, cruise, end_spin, span_s, acceleration, STEP_S, 0, poses, rates)
    assert norm(end[:, BORESIGHT] - direction) < 1e-4
    assert norm(rates[0] - spin) < 1e-12
    changes = np.linalg.norm(np.diff(rates, axis=0), axis=1) / STEP_S
    assert changes.max() <= acceleration * (1.0 + 1e-9)
    # The drawn amounts match the rates.
    for row in (0, num_steps // 2, num_steps - 2):
        middle = (rates[row] + rates[row + 1]) / 2.0
        assert np.abs(turned(poses[row], middle * STEP_S) - poses[row + 1]).max() < 1e-5


def test_where_the_satellite_is_between_states_is_where_sgp4_has_it() -> None:
    mission = _mission()
    where = world.orbit(mission)
    for time_s in (3.7, 1234.5, 1799.9):
        day = 2458484.5
        _, exact_km, exact_km_s = mission.elements.sgp4(day, time_s / 86_400.0)
        found_km, found_km_s = world.satellite_km(where, time_s)
        assert norm(found_km - np.array(exact_km)) < 1e-3
        assert norm(found_km_s - np.array(exact_km_s)) < 1e-3


def test_the_sun_of_a_solstice_is_where_it_belongs() -> None:
    # 2019-06-21T15:54Z: right ascension 90 deg, declination 23.44 deg.
    (mission,) = missions(*_files())
    sun = world.sun_km(
        mission, (datetime(2019, 6, 21, 15, 54, tzinfo=UTC) - _START).total_seconds()
    )
    assert math.degrees(math.atan2(sun[1], sun[0])) == pytest.approx(90.0, abs=0.02)
    assert math.degrees(math.asin(sun[2] / norm(sun))) == pytest.approx(23.436, abs=0.02)


def _reference(mission: Mission) -> Reference:
    return Pilot(mission, limits_of(mission.agility, None)).reference()


def _as_told(reference: Reference) -> Flight:
    boresight = np.ascontiguousarray(reference.attitude[:, :, BORESIGHT])
    rate_deg_s = np.degrees(np.linalg.norm(reference.rate, axis=1))
    return Flight(boresight, rate_deg_s, np.ones(len(boresight)), 0.0)


def _nearest_sun_deg(mission: Mission, reference: Reference) -> float:
    towards = world.sun_km(mission, 900.0)
    cosines = reference.attitude[:, :, BORESIGHT] @ (towards / norm(towards))
    return math.degrees(math.acos(float(cosines.max())))


def test_the_reference_keeps_its_limits_and_comes_in_time() -> None:
    free = _mission()
    at = [(time_s, *_below(free, time_s + 15.0)) for time_s in (300.0, 420.0, 900.0)]
    mission = _mission(*at)
    reference = _reference(mission)
    speeds = np.linalg.norm(reference.rate, axis=1)
    assert np.degrees(speeds.max()) <= 1.0 + 1e-6
    changes = np.linalg.norm(np.diff(reference.rate, axis=0), axis=1) / STEP_S
    assert np.degrees(changes.max()) <= 0.1 * 1.01
    verdict = judge(mission, reference, _as_told(reference))
    assert verdict.too_short == ()
    assert [each.throughout for each in verdict.pointing] == [True] * 3
    assert verdict.share("collect") == 1.0
    assert verdict.nearest_sun_deg == pytest.approx(_nearest_sun_deg(mission, reference), abs=0.1)
    # There is time to visit the sun before, between and after.
    assert len(reference.visits) >= 3
    assert all(earlier[1] <= later[0] for earlier, later in
               zip(reference.visits, reference.visits[1:], strict=False))  # fmt: skip


def test_who_has_too_little_time_is_late_and_told() -> None:
    free = _mission()
    lat, lon = _below(free, 315.0)
    mission = _mission((300.0, lat, lon), (331.0, lat, lon + 6.0))
    verdict = judge(mission, reference := _reference(mission), _as_told(reference))
    assert verdict.too_short == ("t1",)
    first, second = verdict.pointing
    assert first.throughout
    assert not second.at_start
    assert second.late_s > 1.0
    assert not is_flyable(verdict, 0.995)


def test_the_battery_is_what_the_sun_gives_and_the_recorder_what_was_written() -> None:
    free = _mission()
    mission = _mission((300.0, *_below(free, 315.0)))
    verdict = judge(mission, reference := _reference(mission), _as_told(reference))
    assert mission.power is not None
    assert verdict.lowest_battery is not None
    assert verdict.lowest_battery < 1.0 - 20.0 * mission.power.collect_per_s
    assert verdict.incidence["sun"] > 0.999
    assert verdict.charged["once at the sun"] <= verdict.charged["in all idle time"]
    # The timeline's curve is invented and empty; the recorder holds an image and telemetry.
    assert verdict.recorder_error == pytest.approx(0.01 + 1800.0 * 1e-6, abs=1e-6)


def test_a_flight_that_comes_too_near_to_the_sun_is_not_flyable() -> None:
    mission = _mission((300.0, *_below(_mission(), 315.0)))
    flown = judge(mission, reference := _reference(mission), _as_told(reference))
    flown = replace(flown, recorder_error=0.0, below_curve=0.0)

    def is_kept(sun_exclusion_deg: float) -> bool:
        agility = replace(mission.agility, sun_exclusion_deg=sun_exclusion_deg)
        kept = replace(flown, mission=replace(mission, agility=agility))
        return is_flyable(kept, 0.995)

    assert is_kept(0.0)
    assert is_kept(flown.nearest_sun_deg - 0.1)
    assert not is_kept(flown.nearest_sun_deg + 0.1)


@pytest.mark.parametrize("turn_s", [None, 0.0, 20.0])
def test_only_visits_that_take_a_turn_say_when_the_satellite_is_at_the_sun(
    turn_s: float | None,
) -> None:
    scenario, timeline = _files((300.0, 0.0, 0.0))
    visit = {"mode": "sunpoint", "start": _instant(0.0), "end": _instant(280.0),
             "turn_to_s": turn_s and 0.0, "turn_back_s": turn_s}  # fmt: skip
    timeline["satellites"][0]["actions"].insert(0, visit)
    (mission,) = missions(scenario, timeline)
    assert (mission.visits is None) == (not turn_s)
