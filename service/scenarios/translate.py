"""JSON to domain types: the only module that knows both.

A scenario's *content* is a self-contained scenario file (`ScenarioFile`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, count
from typing import Any, TypeVar

from pydantic import ValidationError

from planner_core.domain import (
    Agility,
    GroundStation,
    Horizon,
    Objective,
    Quality,
    Resources,
    Satellite,
    Scenario,
    Sensor,
    Target,
)
from planner_core.domain import Orbit as Elements
from planner_core.errors import Fault, InvalidElements, InvalidScenario, inside, pointing
from planner_core.orbits.oem import read_oem, tidy_lines
from planner_core.orbits.omm import elements_from_omm, omm_from_elements
from planner_core.orbits.tle import read_tle
from service.problems.faults import faults_of_validation
from service.scenarios.forecast_inputs import forecast_from
from service.scenarios.pin_inputs import outage_from, pins_from, replan_from, state_from
from service.wire.base import fields_of
from service.wire.satellites import (
    OrbitIn,
    Preset,
    PresetResourcesIn,
    ResourcesIn,
    TypedFigures,
    WholeSatellite,
)
from service.wire.scenarios import (
    FileGroundStation,
    FileSatellite,
    HorizonIn,
    QualityIn,
    ScenarioFile,
)
from service.wire.sites import GroundStationIn, TargetIn
from service.wire.spacecraft import WholeSpacecraft

B = TypeVar("B")
T = TypeVar("T")

_SECONDS_PER_HOUR = 3600.0


def scenario_from_content(content: Mapping[str, Any]) -> Scenario:
    """Return the scenario of a scenario file.

    Raises
    ------
    InvalidScenario, InvalidElements
        With a JSON pointer to the first thing that is wrong.
    """
    return scenario_from_file(read_file(content))


def read_file(content: Mapping[str, Any]) -> ScenarioFile:
    """Return a scenario file that fits the schema, with all ids filled in and orbits tidied.

    Raises
    ------
    InvalidScenario, InvalidElements
        With a JSON pointer to the first thing that is wrong.
    """
    try:
        file = ScenarioFile.model_validate(content)
    except ValidationError as error:
        first = faults_of_validation(error, content)[0]
        raise InvalidScenario(first.code, first.detail, pointer=first.pointer) from None
    tidy = _each("satellites", file.satellites, _with_tidy_orbit)
    stations = _with_ids(file.ground_stations)
    return file.model_copy(update={"satellites": _with_ids(tidy), "ground_stations": stations})


def _with_tidy_orbit(item: FileSatellite) -> FileSatellite:
    return item.model_copy(update=orbit_from(item).stored)


def _with_ids(items: Sequence[FileSatellite | FileGroundStation]) -> list[object]:
    taken = {item.id for item in items if item.id is not None}
    named: list[object] = []
    for item in items:
        names = chain((item.name,), (f"{item.name}-{number}" for number in count(2)))
        own = item.id or next(name for name in names if name not in taken)
        taken.add(own)
        named.append(item.model_copy(update={"id": own}))
    return named


def scenario_from_file(file: ScenarioFile) -> Scenario:
    """Return the scenario of a file returned by `read_file`."""
    return Scenario(
        horizon=horizon_from(file.horizon),
        satellites=_each(
            "satellites", file.satellites, lambda one: satellite_from(one, str(one.id))
        ),
        targets=_each("targets", file.targets, lambda one: target_from(one, one.catalog_id)),
        ground_stations=_each(
            "ground_stations",
            file.ground_stations,
            lambda one: ground_station_from(one, str(one.id)),
        ),
        use_resources=file.use_resources,
        dynamics=file.dynamics,
        collect_spacing_s=file.collect_spacing_s,
        collect_alignment=file.collect_alignment,
        continuous_starts=file.continuous_starts,
        quality=quality_from(file.quality),
        forecast=forecast_from(file),
        objective=Objective(**dict(file.objective) | {"prefer": tuple(file.objective.prefer)}),
        allow_old_elements=file.allow_old_elements,
        pins=pins_from(file.pins),
        outages=tuple(outage_from(outage) for outage in file.outages),
        states=tuple(state_from(state) for state in file.states),
        replan=None if file.replan is None else replan_from(file.replan),
    )


def _each(part: str, items: Sequence[B], build: Callable[[B], T]) -> tuple[T, ...]:
    """Return what is built from each item of a part; errors point to the item."""
    built = []
    for position, item in enumerate(items):
        with inside(f"/{part}/{position}"):
            built.append(build(item))
    return tuple(built)


def horizon_from(body: HorizonIn) -> Horizon:
    """Return the horizon; `InvalidScenario` ``horizon_inverted`` if it has no length."""
    if body.end <= body.start:
        raise InvalidScenario(
            "horizon_inverted", "The end must be later than the start.", pointer="/horizon/end"
        )
    return Horizon(start=body.start, end=body.end)


def quality_from(body: QualityIn) -> Quality:
    """Return the quality curves; `InvalidScenario` with a pointer to an invalid knot."""
    return Quality(
        off_nadir_deg=tuple((angle_deg, value) for angle_deg, value in body.off_nadir_deg),
        sun_elevation_deg=tuple((angle_deg, value) for angle_deg, value in body.sun_elevation_deg),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Orbit:
    """An orbit, and its tidy form as stored: the one given of ``tle``, ``omm`` and ``oem``."""

    elements: Elements
    stored: dict[str, Any]


def orbit_from(body: OrbitIn) -> Orbit:
    """Return the orbit of one body.

    Raises
    ------
    InvalidElements
        With a pointer such as ``/tle/1`` or ``/omm/EPOCH``.
    """
    if body.oem is not None:
        try:
            ephemeris = read_oem(body.oem)
        except InvalidElements as error:
            if error.fault.row is not None:
                pointer = f"/oem/{error.fault.row - 1}"
                error.fault = replace(error.fault, pointer=pointer, row=None)
            raise
        return Orbit(elements=ephemeris, stored={"oem": tidy_lines(ephemeris)})
    if body.tle is not None:
        reading = read_tle(body.tle)
        return Orbit(elements=reading.elements, stored={"tle": list(reading.lines)})
    elements = elements_from_omm(body.omm or {})
    return Orbit(elements=elements, stored={"omm": omm_from_elements(elements)})


def satellite_from(body: WholeSatellite, satellite_id: str) -> Satellite:
    """Return the satellite of one body."""
    elements = orbit_from(body).elements
    agility, sensor, resources = figures_from(body, elements.period_s)
    return Satellite(
        id=satellite_id,
        name=body.name,
        orbit=elements,
        agility=agility,
        sensor=sensor,
        resources=resources,
        spacecraft=body.spacecraft,
    )


def figures_from(
    body: TypedFigures | WholeSpacecraft, period_s: float
) -> tuple[Agility, Sensor, Resources]:
    """Return the capabilities of a spacecraft in an orbit of this period.

    Raises
    ------
    InvalidScenario
        With a pointer into the body.
    """
    with inside("/agility"):
        agility = Agility(**body.agility.model_dump())
    with inside("/sensor"):
        sensor = Sensor(**body.sensor.model_dump())
    with inside("/resources"):
        resources = resources_from(body.resources, period_s)
    return agility, sensor, resources


_FIELDS_OF_RATES = {
    "/sunpoint_charge_per_s": "/sunpoint_power_w",
    "/collect_drain_per_s": "/collect_power_w",
    "/contact_drain_per_s": "/contact_power_w",
    "/collect_fill_per_s": "/collect_rate_mbit_s",
    "/downlink_per_s": "/downlink_rate_mbit_s",
    "/telemetry_per_s": "/telemetry_rate_mbit_s",
    "/idle_drain_per_s": "/idle_power_w",
}


def resources_from(body: Preset | PresetResourcesIn | ResourcesIn, period_s: float) -> Resources:
    """Return the battery and recorder with rates as fractions of capacity per second.

    Presets depend on the orbital period.
    """
    if isinstance(body, PresetResourcesIn):
        changed = body.model_dump(exclude={"preset"})
        return replace(resources_from(body.preset, period_s), **changed)
    if body == "paper":
        return Resources.paper(period_s)
    if body == "paper_code":
        return Resources.paper_code(period_s)
    assert isinstance(body, ResourcesIn)
    battery_ws = body.battery_capacity_wh * _SECONDS_PER_HOUR
    recorder_mbit = body.recorder_capacity_mbit
    rate = body.downlink_rate_mbit_s
    by_elevation = rate if isinstance(rate, list) else []
    knots = tuple((deg, mbit_s / recorder_mbit) for deg, mbit_s in by_elevation)
    with pointing(_in_figures):
        return Resources(
            battery_min_fraction=body.battery_min_fraction,
            initial_battery_fraction=body.initial_battery_fraction,
            sunpoint_charge_per_s=body.sunpoint_power_w / battery_ws,
            collect_drain_per_s=body.collect_power_w / battery_ws,
            contact_drain_per_s=body.contact_power_w / battery_ws,
            recorder_max_fraction=body.recorder_max_fraction,
            initial_recorder_fraction=body.initial_recorder_fraction,
            collect_fill_per_s=body.collect_rate_mbit_s / recorder_mbit,
            downlink_per_s=max(per_s for _, per_s in knots)
            if isinstance(rate, list)
            else rate / recorder_mbit,
            downlink_by_elevation=knots,
            telemetry_per_s=body.telemetry_rate_mbit_s / recorder_mbit,
            eclipse_aware=body.eclipse_aware,
            recorder_capacity_mbit=recorder_mbit,
            sun_pointing=body.sun_pointing,
            panel_angle_deg=body.panel_angle_deg,
            idle_drain_per_s=body.idle_power_w / battery_ws,
        )


def _in_figures(fault: Fault) -> str:
    """Return the field of a body from which a wrong rate was computed."""
    pointer = (fault.pointer or "").replace("/downlink_by_elevation", "/downlink_rate_mbit_s")
    return _FIELDS_OF_RATES.get(pointer, pointer)


def target_from(body: TargetIn, catalog_id: str | None = None) -> Target:
    """Return the target of one body."""
    least, most = body.off_nadir_min_deg, body.off_nadir_max_deg
    if least is not None and most is not None and most < least:
        raise InvalidScenario(
            "value_out_of_range",
            f"off_nadir_max_deg is {most}: it must be at least off_nadir_min_deg, {least}.",
            pointer="/off_nadir_max_deg",
        )
    if body.release is not None and body.due is not None and body.due <= body.release:
        raise InvalidScenario(
            "value_out_of_range",
            f"due is {body.due:%Y-%m-%dT%H:%M:%SZ}: it must be later than release, "
            f"{body.release:%Y-%m-%dT%H:%M:%SZ}.",
            pointer="/due",
        )
    return Target(**fields_of(body, TargetIn), catalog_id=catalog_id)


def ground_station_from(body: GroundStationIn, station_id: str) -> GroundStation:
    """Return the ground station of one body."""
    _check_mask(body.elevation_mask)
    mask = tuple((azimuth, elevation) for azimuth, elevation in body.elevation_mask)
    fields = fields_of(body, GroundStationIn) | {"elevation_mask": mask}
    return GroundStation(**fields, id=station_id)


def _check_mask(mask: Sequence[Sequence[float]]) -> None:
    before = -1.0
    for position, (azimuth, elevation) in enumerate(mask):
        if not (before < azimuth <= 360.0 and -90.0 <= elevation <= 90.0):
            raise InvalidScenario(
                "value_out_of_range",
                "Azimuths must ascend from 0 to 360, elevations must lie between -90 and 90.",
                pointer=f"/elevation_mask/{position}",
            )
        before = max(azimuth, 0.0)
