"""A second opinion on a timeline, from the scenario file and the answer alone.

It imports nothing of the planner: orbits come from python-sgp4 directly, and geometry and
resources are computed again in the plainest way, from the documents that a client sees.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import cache, lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from sgp4 import omm
from sgp4.api import WGS72, Satrec, jday

Vector = npt.NDArray[np.float64]
Document = dict[str, Any]

A_KM, FLATTENING = 6378.137, 1 / 298.257223563
ANGLE_TOLERANCE_DEG = 0.02
"""Earth orientation (up to 0.2 s of UT1) is ignored here: about 0.01 deg as seen from orbit."""


def instant(text: str) -> datetime:
    return datetime.fromisoformat(text).astimezone(UTC)


def record_of(satellite: Document) -> Satrec:
    """Return python-sgp4's record of an orbit as the client gave it; the same one on each call."""
    if satellite.get("tle"):
        return _of_tle(*satellite["tle"])
    return _of_omm(tuple((key, str(value)) for key, value in satellite["omm"].items()))


@cache
def _of_tle(first: str, second: str) -> Satrec:
    return Satrec.twoline2rv(first, second, WGS72)


@cache
def _of_omm(given: tuple[tuple[str, str], ...]) -> Satrec:
    record, fields = Satrec(), dict(given)
    fields["EPOCH"] = fields["EPOCH"].removesuffix("Z")
    if "." not in fields["EPOCH"]:
        fields["EPOCH"] += ".0"
    omm.initialize(record, fields)
    return record


def position_km(record: Satrec, when: datetime) -> Vector:
    """Return the TEME position."""
    clock = (when.hour, when.minute, when.second + when.microsecond / 1e6)
    error, r, _ = record.sgp4(*jday(when.year, when.month, when.day, *clock))
    assert error == 0
    return np.array(r)


def earth_angle_rad(when: datetime) -> float:
    """Return Greenwich mean sidereal time (IAU 1982), with UT1 taken as UTC."""
    days = (when - datetime(2000, 1, 1, 12, tzinfo=UTC)).total_seconds() / 86400
    t = days / 36525
    seconds = 67310.54841 + (876600 * 3600 + 8640184.812866) * t + 0.093104 * t * t - 6.2e-6 * t**3
    return math.radians(seconds % 86400 / 240)


def to_earth(r: Vector, when: datetime) -> Vector:
    angle = earth_angle_rad(when)
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * r[0] + s * r[1], -s * r[0] + c * r[1], r[2]])


def place_km(place: Document) -> tuple[Vector, Vector]:
    """Return the site's Earth-fixed position and local up direction."""
    return _place_km(*_coordinates(place))


def _coordinates(place: Document) -> tuple[float, float, float]:
    return place["lat_deg"], place["lon_deg"], place.get("alt_m", 0.0)


@cache
def _place_km(lat_deg: float, lon_deg: float, alt_m: float) -> tuple[Vector, Vector]:
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    e2 = FLATTENING * (2 - FLATTENING)
    n = A_KM / math.sqrt(1 - e2 * math.sin(lat) ** 2)
    h = alt_m / 1000
    up = np.array([math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)])
    position = np.array([(n + h) * up[0], (n + h) * up[1], (n * (1 - e2) + h) * up[2]])
    return position, up


def geodetic_nadir(r: Vector) -> Vector:
    """Return the direction straight down to the ellipsoid, by fixed-point iteration."""
    e2 = FLATTENING * (2 - FLATTENING)
    rho = math.hypot(r[0], r[1])
    lat = math.atan2(r[2], rho * (1 - e2))
    for _ in range(10):
        n = A_KM / math.sqrt(1 - e2 * math.sin(lat) ** 2)
        lat = math.atan2(r[2] + n * e2 * math.sin(lat), rho)
    lon = math.atan2(r[1], r[0])
    return -np.array([math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)])


def angle_deg(u: Vector, v: Vector) -> float:
    cosine = float(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
    return math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


def view(record: Satrec, place: Document, when: datetime) -> tuple[float, float]:
    """Return the off-nadir angle at the satellite (geodetic) and the elevation at the site."""
    return _view(record, _coordinates(place), when)


@lru_cache(2**17)  # solvers choose the same tasks of a mission, each checked at every second
def _view(
    record: Satrec, coordinates: tuple[float, float, float], when: datetime
) -> tuple[float, float]:
    r = to_earth(position_km(record, when), when)
    p, up = _place_km(*coordinates)
    return angle_deg(geodetic_nadir(r), p - r), 90.0 - angle_deg(up, r - p)


def line_of_sight(record: Satrec, place: Document, when: datetime) -> Vector:
    """Return the inertial direction from the satellite to the site."""
    p, _ = place_km(place)
    angle = earth_angle_rad(when)
    c, s = math.cos(angle), math.sin(angle)
    inertial = np.array([c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]])
    return inertial - position_km(record, when)


def check(scenario: Document, timeline: Document, targets: list[Document]) -> None:
    """Assert that a valid timeline obeys the rules and its figures add up."""
    assert timeline["validity"] == "valid"
    places = {t["id"]: t for t in scenario["targets"]} | {
        ("station", g["id"]): g for g in scenario["ground_stations"]
    }
    earned: dict[str, float] = {}
    quality_tolerance = _steepest(scenario) * ANGLE_TOLERANCE_DEG
    for satellite, line in zip(scenario["satellites"], timeline["satellites"], strict=True):
        record = record_of(satellite)
        tasks = [a for a in line["actions"] if a["mode"] != "sunpoint"]
        for action in tasks:
            _check_geometry(record, satellite, places, action)
            if action["mode"] == "collect":
                reward = places[action["target_id"]].get("reward", 1.0)
                worth = reward * _quality(record, scenario, places, action)
                assert abs(action["worth"] - worth) <= reward * quality_tolerance
                before = earned.get(action["target_id"], 0.0)
                earned[action["target_id"]] = max(before, worth)
        _check_turns(record, satellite, places, tasks)
        if scenario["use_resources"] and scenario["dynamics"] == "physical":
            _check_resources(satellite, timeline, line)
    _check_stations(timeline)
    difference = abs(timeline["totals"]["reward"] - sum(earned.values()))
    assert difference <= quality_tolerance * sum(t.get("reward", 1.0) for t in places.values())
    assert timeline["totals"]["bound"] >= timeline["totals"]["reward"]
    assert sorted(t["target_id"] for t in targets) == sorted(t["id"] for t in scenario["targets"])
    seen = {t["target_id"] for t in targets if t["outcome"] in ("collected", "downlinked")}
    assert seen == set(earned)
    assert all((t["reason"] is None) == (t["target_id"] in earned) for t in targets)


def _place_of(places: dict[Any, Document], action: Document) -> Document:
    if action["mode"] == "collect":
        return places[action["target_id"]]
    return places["station", action["station_id"]]


def _curve(scenario: Document) -> list[list[float]]:
    assert not scenario.get("quality", {}).get("sun_elevation_deg")
    curve: list[list[float]] = scenario.get("quality", {}).get("off_nadir_deg", [])
    return curve or [[0.0, 1.0]]


def _steepest(scenario: Document) -> float:
    """Return the largest change of quality per degree."""
    knots = itertools.pairwise(_curve(scenario))
    return max((abs(v - u) / (b - a) for (a, u), (b, v) in knots), default=0.0)


def _quality(
    record: Satrec, scenario: Document, places: dict[Any, Document], action: Document
) -> float:
    """Return the quality of an image by its off-nadir angle at the middle."""
    start, end = instant(action["start"]), instant(action["end"])
    angle, _ = view(record, places[action["target_id"]], start + (end - start) / 2)
    curve = _curve(scenario)
    for (a, u), (b, v) in itertools.pairwise(curve):
        if a <= angle <= b:
            return u + (v - u) * (angle - a) / (b - a)
    return curve[0][1] if angle < curve[0][0] else curve[-1][1]


def _check_geometry(
    record: Satrec, satellite: Document, places: dict[Any, Document], action: Document
) -> None:
    """Assert that every second of a task lies within the limits of sensor or mask."""
    place = _place_of(places, action)
    sensor = satellite.get("sensor") or {}
    for when in _seconds(action):
        off_nadir_deg, elevation_deg = view(record, place, when)
        if action["mode"] == "collect":
            low, high = sensor.get("off_nadir_min_deg", 5.0), sensor.get("off_nadir_max_deg", 55.0)
            assert low - ANGLE_TOLERANCE_DEG <= off_nadir_deg <= high + ANGLE_TOLERANCE_DEG
            assert elevation_deg >= -ANGLE_TOLERANCE_DEG
        else:
            assert elevation_deg >= place.get("min_elevation_deg", 5.0) - ANGLE_TOLERANCE_DEG


def _seconds(action: Document) -> Iterator[datetime]:
    start, end = instant(action["start"]), instant(action["end"])
    for step in range(math.ceil((end - start).total_seconds())):
        yield start + (end - start) * (step / math.ceil((end - start).total_seconds()))
    yield end


def _check_turns(
    record: Satrec, satellite: Document, places: dict[Any, Document], tasks: list[Document]
) -> None:
    agility = satellite.get("agility") or {}
    rate, settle_s = agility.get("slew_rate_deg_s", 1.0), agility.get("settle_s", 0.0)
    for a, b in itertools.pairwise(tasks):
        gap_s = (instant(b["start"]) - instant(a["end"])).total_seconds()
        turn_deg = angle_deg(
            line_of_sight(record, _place_of(places, a), instant(a["end"])),
            line_of_sight(record, _place_of(places, b), instant(b["start"])),
        )
        assert gap_s >= turn_deg / rate + settle_s - ANGLE_TOLERANCE_DEG / rate


def _check_stations(timeline: Document) -> None:
    contacts = sorted(
        (a["station_id"], instant(a["start"]), instant(a["end"]))
        for s in timeline["satellites"]
        for a in s["actions"]
        if a["mode"] == "contact"
    )
    for (station, _, end), (other, start, _) in itertools.pairwise(contacts):
        assert station != other or end <= start


def _rates(satellite: Document) -> dict[str, float]:
    """Return the preset's rates per second, from the paper's sentences."""
    if satellite.get("tle"):
        period_s = 86400 / float(satellite["tle"][1][52:63])
    else:
        period_s = 86400 / float(satellite["omm"]["MEAN_MOTION"])
    preset = satellite.get("resources", "paper")
    assert preset in ("paper", "paper_code")
    ratio, telemetry = (4, 1e-6) if preset == "paper" else (10, 1 / 3e7)
    return {
        "sunpoint": 1 / (0.9 * period_s),
        "collect": 1 / (0.1 * period_s),
        "contact": 1 / (0.4 * period_s),
        "fill": 1 / 3000,
        "downlink": ratio / 3000,
        "telemetry": telemetry,
    }


def _check_resources(satellite: Document, timeline: Document, line: Document) -> None:
    """Check the levels task by task; in between the satellite points at the sun."""
    rates = _rates(satellite)
    battery, recorder, lowest, highest = 1.0, 0.0, 1.0, 0.0
    now = instant(timeline["horizon"]["start"])
    last = {"mode": "end", "start": timeline["horizon"]["end"], "end": timeline["horizon"]["end"]}
    for action in [a for a in line["actions"] if a["mode"] != "sunpoint"] + [last]:
        idle_s = (instant(action["start"]) - now).total_seconds()
        battery = min(1.0, battery + idle_s * rates["sunpoint"])
        recorder += idle_s * rates["telemetry"]
        highest = max(highest, recorder)
        length_s = (instant(action["end"]) - instant(action["start"])).total_seconds()
        recorder += length_s * rates["telemetry"]
        if action["mode"] == "collect":
            battery -= length_s * rates["collect"]
            recorder += length_s * rates["fill"]
        elif action["mode"] == "contact":
            battery -= length_s * rates["contact"]
            recorder = max(0.0, recorder - length_s * rates["downlink"])
        lowest, highest = min(lowest, battery), max(highest, recorder)
        if action["mode"] != "end":
            assert abs(action["battery_fraction_end"] - battery) < 1e-6
            assert abs(action["recorder_fraction_end"] - recorder) < 1e-6
        now = instant(action["end"])
    assert lowest > 0.3
    assert highest < 0.75
    totals = timeline["totals"]
    if len(timeline["satellites"]) == 1:
        assert abs(totals["battery_min_fraction"] - lowest) < 1e-6
        assert abs(totals["recorder_max_fraction"] - highest) < 1e-6
