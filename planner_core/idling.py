"""Carry the state of a satellite to the start of the horizon while it only points at the sun."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta

import numpy as np

from planner_core.domain import (
    Attitude,
    GroundStation,
    Horizon,
    Resources,
    Satellite,
    Scenario,
    State,
    Target,
)
from planner_core.errors import InvalidScenario
from planner_core.orbits.eclipse import always_sunlit, sunlight
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites, line_of_sight_teme, los_rate_deg_s
from planner_core.orbits.sun import sun_path
from planner_core.problem import (
    COLLECT,
    Floats,
    Heading,
    ImageOnBoard,
    Opportunities,
    Sunlight,
)
from planner_core.problem.sun_turns import sun_turn_s

_A_MOMENT = timedelta(minutes=1)  # of orbit, to find where a satellite looks


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """What a satellite begins the horizon with.

    Attributes
    ----------
    heading
        Where it looks; None if unknown.
    sun_from_s
        When its panels can first be at the sun.
    images
        The images in its recorder, in the order of downlink.
    """

    resources: Resources
    heading: Heading | None = None
    sun_from_s: float = 0.0
    images: tuple[ImageOnBoard, ...] = ()


def started(scenario: Scenario, index: int, state: State | None, table: Opportunities) -> Start:
    """Return a satellite's resources and line of sight at the horizon's start.

    From the state's instant on it idles: it turns to the sun, its panels charge in sunlight, and
    telemetry fills the recorder. No turn is counted if it is unknown where the satellite looked.

    Raises
    ------
    PropagationFailed
        SGP4 stops before the horizon begins.
    InvalidScenario
        The attitude names an opportunity that the satellite does not have.
    """
    satellite = scenario.satellites[index]
    if state is None:
        return Start(resources=satellite.resources)
    seen = None if state.attitude is None else heading_of(scenario, index, state, table)
    images = _images(scenario, index, state)
    if not scenario.use_resources:
        return Start(resources=satellite.resources, heading=seen, images=images)
    waited_s = (scenario.horizon.start - state.at).total_seconds()
    turn_s = _turn_to_sun_s(satellite, state, seen)
    resources = _carried(satellite, state, scenario.horizon, turn_s)
    is_free = satellite.resources.sun_pointing == "free"
    if seen is not None and not is_free and turn_s <= waited_s:
        # By then it is at the sun, as idle satellites are.
        seen = Heading(free_from_s=0.0)
    return Start(
        resources=resources, heading=seen, sun_from_s=max(0.0, turn_s - waited_s), images=images
    )


def _carried(satellite: Satellite, state: State, horizon: Horizon, turn_s: float) -> Resources:
    resources = satellite.resources
    waited_s = (horizon.start - state.at).total_seconds()
    battery = state.battery_fraction
    recorder = state.recorder(resources.recorder_capacity_mbit)
    if waited_s > 0.0:
        if battery is not None:
            lit = always_sunlit(waited_s)
            if resources.eclipse_aware:
                lit = sunlight(propagate(satellite, Horizon(start=state.at, end=horizon.start)))
            battery = battery_after(resources, battery, sunlit_from(lit, turn_s), waited_s)
        if recorder is not None:
            recorder = min(1.0, recorder + resources.telemetry_per_s * waited_s)
    return replace(
        resources,
        initial_battery_fraction=(
            resources.initial_battery_fraction if battery is None else battery
        ),
        initial_recorder_fraction=(
            resources.initial_recorder_fraction if recorder is None else recorder
        ),
    )


def _turn_to_sun_s(satellite: Satellite, state: State, seen: Heading | None) -> float:
    if seen is None or seen.line_of_sight is None:
        return 0.0
    then = Horizon(start=state.at, end=state.at + _A_MOMENT)
    return sun_turn_s(
        satellite.resources, satellite.agility, sun_path(then), seen.line_of_sight, 0.0,
        seen.moving_deg_s,
    )  # fmt: skip


def heading_of(scenario: Scenario, index: int, state: State, table: Opportunities) -> Heading:
    """Return where a satellite looks according to the attitude in its state."""
    attitude = state.attitude
    assert attitude is not None
    free_from_s = scenario.horizon.offset_s(state.at)
    if attitude.at_sun:
        return Heading(free_from_s=free_from_s)
    if attitude.line_of_sight is not None:
        vector = np.array(attitude.line_of_sight)
        return Heading(
            free_from_s=free_from_s, line_of_sight=_triple(vector / np.linalg.norm(vector))
        )
    satellite = scenario.satellites[index]
    site = Sites.of([_tracked(scenario, index, attitude, table)])
    path = propagate(satellite, Horizon(start=state.at, end=state.at + _A_MOMENT))
    at_s, is_moving = np.zeros(1), satellite.agility.tracks
    return Heading(
        free_from_s=free_from_s,
        line_of_sight=_triple(line_of_sight_teme(path, site, at_s)[0]),
        moving_deg_s=_triple(los_rate_deg_s(path, site, at_s)[0]) if is_moving else (0.0,) * 3,
    )


def _triple(vector: Floats) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


def _tracked(
    scenario: Scenario, index: int, attitude: Attitude, table: Opportunities
) -> Target | GroundStation:
    """Return the target or station that an attitude names."""
    named: Sequence[Target | GroundStation]
    if attitude.opportunity_id is not None:
        found = re.fullmatch(r"o(\d{1,9})", attitude.opportunity_id, re.ASCII)
        row = int(found[1]) if found else -1
        if not 0 <= row < len(table) or table.satellite[row] != index:
            position = next(
                i
                for i, state in enumerate(scenario.states)
                if state.satellite_id == scenario.satellites[index].id
            )
            raise InvalidScenario(
                "unknown_opportunity",
                f"The satellite has no opportunity {attitude.opportunity_id!r}.",
                pointer=f"/states/{position}/attitude/opportunity_id",
            )
        named = scenario.targets if table.kind[row] == COLLECT else scenario.ground_stations
        return named[int(table.site[row])]
    named, own_id = scenario.targets, attitude.target_id
    if attitude.station_id is not None:
        named, own_id = scenario.ground_stations, attitude.station_id
    return next(site for site in named if site.id == own_id)


def _images(scenario: Scenario, index: int, state: State) -> tuple[ImageOnBoard, ...]:
    """Return the images that a state lists, in their order."""
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    capacity_mbit = scenario.satellites[index].resources.recorder_capacity_mbit
    return tuple(
        ImageOnBoard(
            satellite=index,
            target=targets[image.target_id],
            amount=image.amount(capacity_mbit),
            collected_s=scenario.horizon.offset_s(image.collected_at),
            worth=scenario.targets[targets[image.target_id]].reward
            if image.worth is None
            else image.worth,
        )
        for image in state.on_board or ()
    )


def sunlit_from(lit: Sunlight, from_s: float) -> Sunlight:
    """Return the intervals in sunlight from an instant on."""
    is_left = lit.exit_s > from_s
    return Sunlight(enter_s=np.maximum(lit.enter_s[is_left], from_s), exit_s=lit.exit_s[is_left])


def battery_after(resources: Resources, battery: float, lit: Sunlight, span_s: float) -> float:
    """Return a battery's level after a span of idling, as a fraction of capacity.

    Parameters
    ----------
    lit
        When panels are in sunlight, in seconds from the span's start; disjoint and in order.
    """
    idle_per_s, at_s = resources.idle_drain_per_s, 0.0
    charge_per_s = resources.sunpoint_charge_per_s - idle_per_s
    for enter_s, exit_s in zip(lit.enter_s.tolist(), lit.exit_s.tolist(), strict=True):
        battery = max(0.0, battery - idle_per_s * (enter_s - at_s))
        battery = min(1.0, max(0.0, battery + charge_per_s * (exit_s - enter_s)))
        at_s = exit_s
    return max(0.0, battery - idle_per_s * (span_s - at_s))
