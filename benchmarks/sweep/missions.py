"""Missions by number: every option of a scenario occurs in some of them."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import Final

import numpy as np

from benchmarks.clouds.forecast import forecast_of
from benchmarks.clouds.weather import Weather
from benchmarks.missions import paper_scenario
from benchmarks.suite.families import fleet, towns
from planner_core.domain import (
    Agility,
    GroundStation,
    Horizon,
    Objective,
    Outage,
    Quality,
    Resources,
    Satellite,
    Scenario,
    Sensor,
    Target,
)
from planner_core.domain.objective import Preference

_SATELLITES: Final = (1, 1, 2, 4)
_HOURS: Final = (6.0, 12.0, 24.0)
_TARGETS: Final = (60, 200, 500, 1000)
_SHARES: Final = (1.0, 1.0, 0.9, 0.5, 0.0, 0.0)
_HALF_LIVES_H: Final = (1.0, 3.0, 12.0)
_PREFERENCES: Final[tuple[Preference, ...]] = ("early", "off_nadir", "balance", "margin")
_STATIONS: Final = (
    GroundStation(id="svalbard", name="Svalbard", lat_deg=78.2298391, lon_deg=15.3924483),
    GroundStation(id="troll", name="Troll", lat_deg=-72.0167, lon_deg=2.5333),
    GroundStation(id="fairbanks", name="Fairbanks", lat_deg=64.8, lon_deg=-147.7),
)


def random_mission(number: int) -> Scenario:
    """Return the mission of that number; always the same one."""
    rng = np.random.default_rng(number)
    num_satellites = int(rng.choice(_SATELLITES))
    hours, num_targets = float(rng.choice(_HOURS)), int(rng.choice(_TARGETS))
    drawn = paper_scenario(num_targets, number, use_resources=True)
    satellites, targets, start = drawn.satellites, drawn.targets, drawn.horizon.start
    if num_satellites > 1:
        satellites, targets = fleet(num_satellites), towns(num_targets, number)
        start = satellites[0].orbit.epoch
    horizon = Horizon(start=start, end=start + timedelta(hours=hours))
    stations = tuple(_station(rng, one) for one in _STATIONS[: int(rng.integers(1, 4))])
    scenario = Scenario(
        horizon=horizon,
        satellites=_alike(rng, satellites),
        targets=tuple(_targets(rng, targets, horizon)),
        ground_stations=stations,
        use_resources=bool(rng.random() < 0.85),
        objective=_objective(rng),
        outages=_outages(rng, horizon, satellites, stations),
    )
    scenario = _with_starts(rng, scenario)
    if rng.random() < 0.25:
        scenario = replace(scenario, forecast=forecast_of(scenario, Weather(number)))
    return scenario


def _alike(rng: np.random.Generator, satellites: tuple[Satellite, ...]) -> tuple[Satellite, ...]:
    """Return the satellites with one agility, sensor and spacecraft for all."""
    turns = Agility(
        slew_rate_deg_s=float(rng.choice([0.5, 1.0, 3.0])),
        settle_s=float(rng.choice([0.0, 5.0, 15.0])),
    )
    if rng.random() < 0.3:
        turns = replace(turns, acceleration_deg_s2=float(rng.choice([0.1, 0.5])))
        if rng.random() < 0.5:
            turns = replace(turns, slew_model="moving")
    sensor = Sensor(off_nadir_max_deg=float(rng.choice([20.0, 35.0, 55.0])))
    if rng.random() < 0.3:
        sensor = replace(sensor, sun_elevation_min_deg=10.0)
    seed = int(rng.integers(2**32))
    return tuple(
        replace(one, agility=turns, sensor=sensor, resources=_spacecraft(seed, one))
        for one in satellites
    )


def _spacecraft(seed: int, satellite: Satellite) -> Resources:
    rng = np.random.default_rng(seed)
    paper = Resources.paper(satellite.orbit.period_s)
    if rng.random() < 0.5:
        paper = replace(paper, sun_pointing="slew", eclipse_aware=True)
        paper = replace(paper, idle_drain_per_s=0.2 * paper.sunpoint_charge_per_s)
    return replace(
        paper,
        recorder_max_fraction=float(rng.choice([0.1, 0.3, 0.75])),
        initial_battery_fraction=float(rng.choice([0.5, 1.0])),
        downlink_per_s=float(rng.choice([0.3, 1.0, 2.5])) * paper.downlink_per_s,
        collect_drain_per_s=float(rng.choice([0.5, 1.0, 2.0])) * paper.collect_drain_per_s,
    )


def _station(rng: np.random.Generator, station: GroundStation) -> GroundStation:
    return replace(
        station,
        antennas=int(rng.choice([1, 1, 2])),
        setup_s=float(rng.choice([0.0, 30.0])),
        downlink_gain=float(rng.choice([0.5, 1.0])),
    )


def _targets(
    rng: np.random.Generator, targets: tuple[Target, ...], horizon: Horizon
) -> list[Target]:
    """Return the targets, some with rewards, times or half-lives of their own."""
    kind = rng.choice(["equal", "whole", "real", "urgent"])
    has_times, fades = rng.random(2) < 0.2
    length_s = (horizon.end - horizon.start).total_seconds()
    changed = list[Target]()
    for target in targets:
        reward = {
            "equal": 1.0,
            "whole": float(rng.integers(1, 11)),
            "real": float(rng.uniform(0.1, 5.0)),
            "urgent": 50.0 if rng.random() < 0.02 else 1.0,
        }[str(kind)]
        one = replace(target, reward=reward)
        if has_times and rng.random() < 0.3:
            one = replace(one, due=horizon.start + timedelta(seconds=0.5 * length_s))
        if fades and rng.random() < 0.5:
            one = replace(one, reward_half_life_s=float(rng.choice([3600.0, 36000.0])))
        changed.append(one)
    return changed


def _objective(rng: np.random.Generator) -> Objective:
    prefer = _PREFERENCES[: int(rng.integers(0, 4))] if rng.random() < 0.15 else ()
    halves = rng.random() < 0.4
    return Objective(
        collected_share=float(rng.choice(_SHARES)),
        half_life_s=3600.0 * float(rng.choice(_HALF_LIVES_H)) if halves else None,
        prefer=prefer,
    )


def _outages(
    rng: np.random.Generator,
    horizon: Horizon,
    satellites: tuple[Satellite, ...],
    stations: tuple[GroundStation, ...],
) -> tuple[Outage, ...]:
    if rng.random() < 0.8:
        return ()
    begin = horizon.start + timedelta(hours=float(rng.uniform(0.0, 4.0)))
    end = begin + timedelta(hours=2.0)
    if rng.random() < 0.5:
        return (Outage(satellite_id=satellites[0].id, start=begin, end=end),)
    return (Outage(station_id=stations[0].id, start=begin, end=end),)


def _with_starts(rng: np.random.Generator, scenario: Scenario) -> Scenario:
    """Return the scenario with spaced or continuous starts, with image quality, or as it is."""
    kind = rng.choice(["middle", "middle", "spaced", "free", "quality"])
    if kind == "spaced":
        return replace(scenario, collect_spacing_s=float(rng.choice([15.0, 60.0])))
    if kind == "quality":
        curve = ((0.0, 1.0), (30.0, 0.8), (60.0, 0.3))
        spacing_s = 30.0 if rng.random() < 0.5 else None
        return replace(scenario, quality=Quality(off_nadir_deg=curve), collect_spacing_s=spacing_s)
    moves = any(satellite.agility.tracks for satellite in scenario.satellites)
    fades = any(target.reward_half_life_s for target in scenario.targets)
    return replace(scenario, continuous_starts=kind == "free" and not moves and not fades)
