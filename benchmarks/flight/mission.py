"""What a scenario file and a timeline say about one satellite's flight."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt
from sgp4 import omm
from sgp4.api import WGS72, Satrec

Floats = npt.NDArray[np.float64]
Json = Mapping[str, Any]
Mode = Literal["collect", "contact"]

_EQUATOR_KM: Final = 6378.137  # WGS84
_FLATTENING: Final = 1.0 / 298.257223563


@dataclass(frozen=True, slots=True)
class Site:
    """A point on the WGS84 ellipsoid or above it.

    Attributes
    ----------
    ecef_km
        Earth-fixed position. Shape ``(3,)``.
    up
        The ellipsoid's normal. Shape ``(3,)``.
    """

    name: str
    ecef_km: Floats
    up: Floats


@dataclass(frozen=True, slots=True)
class Station:
    """A ground station, and the downlink of a contact with it.

    Attributes
    ----------
    setup_s
        At the start of each contact, without downlink.
    gain
        Factor on the downlink rate.
    """

    site: Site
    setup_s: float
    gain: float


@dataclass(frozen=True, slots=True)
class Task:
    """A collect or a contact. Times are seconds from the horizon's start."""

    name: str
    mode: Mode
    start_s: float
    end_s: float
    site: Site
    station: Station | None = None


@dataclass(frozen=True, slots=True)
class SunVisit:
    """When the plan charges: from ``start_s`` to ``end_s`` the panels face the sun."""

    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Agility:
    """How fast the satellite slews.

    Attributes
    ----------
    settle_s
        How long before a task its line of sight must be reached.
    sun_exclusion_deg
        Least angle between boresight and sun at any time; 0 for none.
    """

    rate_deg_s: float
    acceleration_deg_s2: float | None
    settle_s: float
    sun_exclusion_deg: float


@dataclass(frozen=True, slots=True)
class Power:
    """Shares of the battery per second, and the angle between panel normal and boresight."""

    sun_per_s: float
    idle_per_s: float
    collect_per_s: float
    contact_per_s: float
    initial: float
    panel_angle_deg: float


@dataclass(frozen=True, slots=True)
class Data:
    """Shares of the recorder per second; the downlink's depend on elevation."""

    collect_per_s: float
    telemetry_per_s: float
    downlink_elevation_deg: Floats
    downlink_per_s: Floats
    initial: float


@dataclass(frozen=True, slots=True)
class Curve:
    """Battery and recorder as the timeline predicts them."""

    time_s: Floats
    battery: Floats
    recorder: Floats


@dataclass(frozen=True, slots=True)
class Mission:
    """One satellite's plan, and all that is needed to fly it.

    Attributes
    ----------
    tasks
        In order of time.
    visits
        None if the timeline does not say when the satellite points at the sun: in the paper's
        model it charges in all idle time, and no visit takes a slew.
    curve, power, data
        None if the plan was made without resources.
    """

    name: str
    start: datetime
    duration_s: float
    elements: Satrec
    agility: Agility
    tasks: tuple[Task, ...]
    visits: tuple[SunVisit, ...] | None
    power: Power | None
    data: Data | None
    curve: Curve | None


def missions(scenario: Json, timeline: Json, hours: float | None = None) -> list[Mission]:
    """Return what each satellite flies.

    Parameters
    ----------
    hours
        How much of it, from the horizon's start; all by default.
    """
    start = _instant(timeline["horizon"]["start"])
    duration_s = (_instant(timeline["horizon"]["end"]) - start).total_seconds()
    if hours is not None:
        duration_s = min(duration_s, 3600.0 * hours)
    sites = {each["id"]: _site(each) for each in scenario["targets"]}
    stations = {
        each["id"]: Station(
            _site(each), float(each.get("setup_s") or 0.0), float(each.get("downlink_gain") or 1.0)
        )
        for each in scenario["ground_stations"]
    }
    planned = {each["id"]: each for each in timeline["satellites"]}
    return [
        _mission(each, planned[each["id"]], sites, stations, start, duration_s,
                 use_resources=bool(timeline["use_resources"]))
        for each in scenario["satellites"]
    ]  # fmt: skip


def _mission(
    satellite: Json,
    planned: Json,
    sites: Mapping[str, Site],
    stations: Mapping[str, Station],
    start: datetime,
    duration_s: float,
    *,
    use_resources: bool,
) -> Mission:
    elements = _elements(satellite)
    actions = planned["actions"]
    power, data = _resources(satellite, elements) if use_resources else (None, None)
    told = planned.get("resources")
    curve = None
    if use_resources and told:
        times_s = np.array([_since(start, each) for each in told["time"]])
        curve = Curve(times_s, np.array(told["battery_fraction"]),
                      np.array(told["recorder_fraction"]))  # fmt: skip
    tasks = sorted(
        (task for each in actions if (task := _task(each, sites, stations, start)) is not None),
        key=lambda task: task.start_s,
    )
    return Mission(
        name=str(satellite["name"]),
        start=start,
        duration_s=duration_s,
        elements=elements,
        agility=_agility(satellite["agility"]),
        tasks=tuple(task for task in tasks if task.end_s <= duration_s),
        visits=_visits(actions, start),
        power=power,
        data=data,
        curve=curve,
    )


def _agility(told: Json) -> Agility:
    acceleration = told.get("acceleration_deg_s2")
    return Agility(
        rate_deg_s=float(told["slew_rate_deg_s"]),
        acceleration_deg_s2=None if acceleration is None else float(acceleration),
        settle_s=float(told.get("settle_s") or 0.0),
        sun_exclusion_deg=float(told.get("sun_exclusion_deg") or 0.0),
    )


def _task(
    action: Json, sites: Mapping[str, Site], stations: Mapping[str, Station], start: datetime
) -> Task | None:
    if action["mode"] not in ("collect", "contact"):
        return None
    span_s = _since(start, action["start"]), _since(start, action["end"])
    if action["mode"] == "collect":
        site = sites[action["target_id"]]
        return Task(site.name, "collect", *span_s, site)
    station = stations[action["station_id"]]
    return Task(station.site.name, "contact", *span_s, station.site, station)


def _visits(actions: Sequence[Json], start: datetime) -> tuple[SunVisit, ...] | None:
    found = [each for each in actions if each["mode"] == "sunpoint"]
    if not any(each.get("turn_to_s") or each.get("turn_back_s") for each in found):
        return None
    return tuple(SunVisit(_since(start, each["start"]), _since(start, each["end"]))
                 for each in found)  # fmt: skip


def _site(told: Json) -> Site:
    lat, lon = math.radians(told["lat_deg"]), math.radians(told["lon_deg"])
    alt_km = float(told.get("alt_m") or 0.0) / 1000.0
    square = _FLATTENING * (2.0 - _FLATTENING)
    normal_km = _EQUATOR_KM / math.sqrt(1.0 - square * math.sin(lat) ** 2)
    up = np.array([math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)])
    axes_km = np.array([1.0, 1.0, 1.0 - square]) * normal_km + alt_km
    return Site(str(told["id"]), axes_km * up, up)


def _elements(satellite: Json) -> Satrec:
    if satellite.get("tle"):
        return Satrec.twoline2rv(*satellite["tle"], WGS72)
    elements = Satrec()
    fields = {key: "" if value is None else str(value) for key, value in satellite["omm"].items()}
    epoch = fields["EPOCH"].removesuffix("Z")
    fields["EPOCH"] = epoch if "." in epoch else f"{epoch}.0"  # the library's format
    omm.initialize(elements, fields)
    return elements


def _resources(satellite: Json, elements: Satrec) -> tuple[Power, Data]:
    told = satellite["resources"]
    if isinstance(told, str):
        told = {"preset": told}
    power_panel_deg = float(told.get("panel_angle_deg") or 180.0)
    initial = float(told.get("initial_battery_fraction", 1.0))
    held = float(told.get("initial_recorder_fraction", 0.0))
    if "preset" in told:
        # The paper's spacecraft, in capacities (section Experiments; its code has other rates).
        period_s = 2.0 * math.pi / elements.no_kozai * 60.0
        is_text = told["preset"] == "paper"
        draw = 1.0 / (0.1 * period_s)
        power = Power(1.0 / (0.9 * period_s), 0.0, draw, draw / 4.0, initial, power_panel_deg)
        ratio, telemetry = (4.0, 1e-6) if is_text else (10.0, 1.0 / 3e7)
        rates = np.array([ratio / 3000.0])
        return power, Data(1.0 / 3000.0, telemetry, np.zeros(1), rates, held)
    battery_ws = 3600.0 * told["battery_capacity_wh"]
    power = Power(
        told["sunpoint_power_w"] / battery_ws,
        float(told.get("idle_power_w") or 0.0) / battery_ws,
        told["collect_power_w"] / battery_ws,
        told["contact_power_w"] / battery_ws,
        initial,
        power_panel_deg,
    )
    recorder_mbit = told["recorder_capacity_mbit"]
    rate = told["downlink_rate_mbit_s"]
    knots = np.array(rate if isinstance(rate, list) else [[0.0, rate]], dtype=np.float64)
    data = Data(
        told["collect_rate_mbit_s"] / recorder_mbit,
        told["telemetry_rate_mbit_s"] / recorder_mbit,
        knots[:, 0],
        knots[:, 1] / recorder_mbit,
        held,
    )
    return power, data


def _instant(text: str) -> datetime:
    return datetime.fromisoformat(text).astimezone(UTC)


def _since(start: datetime, text: str) -> float:
    return (_instant(text) - start).total_seconds()
