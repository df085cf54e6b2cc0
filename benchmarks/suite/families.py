"""The suite's missions: families, each with its sizes, budgets and draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import Final

import numpy as np

from benchmarks.clouds.forecast import forecast_of
from benchmarks.clouds.weather import Weather
from benchmarks.missions import paper_scenario
from planner_core.domain import (
    Agility,
    Dynamics,
    GroundStation,
    Horizon,
    Objective,
    OrbitElements,
    Quality,
    Resources,
    Satellite,
    Scenario,
    Target,
)

_FLEET_START: Final = datetime(2020, 1, 1, tzinfo=UTC)
_TARGETS_PER_TOWN: Final = 10
_TOWN_SPREAD_DEG: Final = 3.0
_HIGHEST_TOWN_LAT_DEG: Final = 60.0
_APART_DEG: Final = 12.0  # in a train, along the orbit
_COLLECTED: Final = Objective.collected()
_DELIVERED: Final = Objective.delivered()
_OFF_NADIR: Final = Quality(off_nadir_deg=((0.0, 1.0), (30.0, 0.9), (50.0, 0.5)))
_WARM_UP_DRAW: Final = 99
_WARM_UP_TARGETS: Final = 100


def _halved_in(half_life_h: float, collected_share: float = 0.0) -> Objective:
    return Objective(collected_share=collected_share, half_life_s=3600.0 * half_life_h)


def _shared(collected_share: float) -> Objective:
    return Objective(collected_share=collected_share)


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """Missions of one kind and size, planned in the same CPU seconds.

    Attributes
    ----------
    budget_s, quick_budget_s
        CPU seconds for a case in the full form and in the quick one; None in the latter if the
        quick form leaves the family out.
    num_draws
        How many missions the full form draws; the quick one takes the first of them.
    dynamics
        None without resources.
    has_random_rewards
        Whether rewards are drawn from 1 to 10 instead of all being 1.
    has_tight_battery
        Whether images use twice, and sunlight gives half, of the paper's spacecraft's energy.
    objective
        What an image earns; by default all its worth when it is taken.
    has_forecast
        Whether that is multiplied by the probability of a clear sky (``benchmarks.clouds``).
    has_quality
        Whether images off nadir are worth less.
    turns_to_sun
        Whether satellites charge only between turns to the sun and back.
    num_stations
        How many stations are drawn over the land; by default the paper's two.
    is_train
        Whether satellites follow each other in one plane, so that their passes overlap.
    """

    num_targets: int
    budget_s: float
    quick_budget_s: float | None
    num_draws: int = 2
    num_satellites: int = 1
    dynamics: Dynamics | None = None
    spacing_s: float | None = None
    continuous_starts: bool = False
    has_random_rewards: bool = False
    has_tight_battery: bool = False
    objective: Objective = _COLLECTED
    has_forecast: bool = False
    has_quality: bool = False
    turns_to_sun: bool = False
    num_stations: int | None = None
    is_train: bool = False


FAMILIES: Final[Mapping[str, Family]] = {
    "agility-200": Family(num_targets=200, budget_s=5.0, quick_budget_s=3.0),
    "agility-500": Family(num_targets=500, budget_s=10.0, quick_budget_s=5.0),
    "agility-1000": Family(num_targets=1000, budget_s=20.0, quick_budget_s=10.0),
    "agility-2000": Family(num_targets=2000, budget_s=30.0, quick_budget_s=10.0),
    "paper-200": Family(num_targets=200, budget_s=10.0, quick_budget_s=5.0, dynamics="paper"),
    "paper-500": Family(num_targets=500, budget_s=20.0, quick_budget_s=10.0, dynamics="paper"),
    "paper-1000": Family(num_targets=1000, budget_s=20.0, quick_budget_s=10.0, dynamics="paper"),
    "paper-2000": Family(num_targets=2000, budget_s=30.0, quick_budget_s=10.0, dynamics="paper"),
    "physical-200": Family(
        num_targets=200, budget_s=10.0, quick_budget_s=5.0, dynamics="physical"
    ),
    "physical-500": Family(
        num_targets=500, budget_s=20.0, quick_budget_s=10.0, dynamics="physical"
    ),
    "physical-1000": Family(
        num_targets=1000, budget_s=20.0, quick_budget_s=10.0, dynamics="physical"
    ),
    "physical-2000": Family(
        num_targets=2000, budget_s=30.0, quick_budget_s=10.0, dynamics="physical"
    ),
    "spaced-1000": Family(num_targets=1000, budget_s=20.0, quick_budget_s=12.0, spacing_s=15.0),
    "continuous-1000": Family(
        num_targets=1000, budget_s=30.0, quick_budget_s=12.0, continuous_starts=True
    ),
    "fleet-2x500": Family(num_satellites=2, num_targets=500, budget_s=10.0, quick_budget_s=5.0),
    "spaced-fleet-2x500": Family(
        num_satellites=2, num_targets=500, budget_s=10.0, quick_budget_s=None, spacing_s=15.0
    ),
    "fleet-4x2000": Family(num_satellites=4, num_targets=2000, budget_s=12.0, quick_budget_s=8.0),
    "fleet-24x10000": Family(
        num_satellites=24, num_targets=10_000, budget_s=60.0, quick_budget_s=None, num_draws=1
    ),
    "fleet-stations-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=40.0, quick_budget_s=30.0, dynamics="paper"
    ),
    "weights-agility-1000": Family(
        num_targets=1000, budget_s=20.0, quick_budget_s=10.0, has_random_rewards=True
    ),
    "weights-1000": Family(
        num_targets=1000, budget_s=20.0, quick_budget_s=12.0, dynamics="physical",
        has_random_rewards=True,
    ),
    "tight-150": Family(
        num_targets=150, budget_s=10.0, quick_budget_s=5.0, dynamics="physical",
        has_tight_battery=True,
    ),
    "tight-weights-300": Family(
        num_targets=300, budget_s=10.0, quick_budget_s=5.0, dynamics="physical",
        has_random_rewards=True, has_tight_battery=True,
    ),
    "delivered-paper-500": Family(
        num_targets=500, budget_s=20.0, quick_budget_s=None, dynamics="paper", objective=_DELIVERED
    ),
    "delivered-1000": Family(
        num_targets=1000, budget_s=10.0, quick_budget_s=5.0, dynamics="physical",
        objective=_DELIVERED,
    ),
    "share-200": Family(
        num_targets=200, budget_s=10.0, quick_budget_s=None, dynamics="physical",
        objective=_shared(0.9),
    ),
    "share-paper-500": Family(
        num_targets=500, budget_s=20.0, quick_budget_s=10.0, dynamics="paper",
        objective=_shared(0.5),
    ),
    "share-1000": Family(
        num_targets=1000, budget_s=20.0, quick_budget_s=None, dynamics="physical",
        objective=_shared(0.9),
    ),
    "share-fleet-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=40.0, quick_budget_s=None, dynamics="physical",
        objective=_shared(0.9),
    ),
    "share-fleet-paper-4x500": Family(
        num_satellites=4, num_targets=500, budget_s=15.0, quick_budget_s=None, dynamics="paper",
        objective=_shared(0.9),
    ),
    "share-sun-fleet-4x500": Family(
        num_satellites=4, num_targets=500, budget_s=15.0, quick_budget_s=None,
        dynamics="physical", objective=_shared(0.9), turns_to_sun=True,
    ),
    "share-sun-network-8x1000": Family(
        num_satellites=8, num_targets=1000, budget_s=20.0, quick_budget_s=None,
        dynamics="physical", objective=_shared(0.9), turns_to_sun=True, num_stations=30,
    ),
    "share-sun-train-4x500": Family(
        num_satellites=4, num_targets=500, budget_s=20.0, quick_budget_s=None, num_draws=3,
        dynamics="physical", objective=_shared(0.9), turns_to_sun=True, num_stations=1,
        is_train=True,
    ),
    "quality-sun-network-4x300": Family(
        num_satellites=4, num_targets=300, budget_s=15.0, quick_budget_s=None,
        dynamics="physical", objective=_shared(0.9), has_quality=True, turns_to_sun=True,
        num_stations=30,
    ),
    "quality-sun-network-8x1000": Family(
        num_satellites=8, num_targets=1000, budget_s=20.0, quick_budget_s=None,
        dynamics="physical", objective=_shared(0.9), has_quality=True, turns_to_sun=True,
        num_stations=30,
    ),
    "weights-fleet-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=20.0, quick_budget_s=None,
        dynamics="physical", has_random_rewards=True,
    ),
    "weights-share-sun-fleet-4x500": Family(
        num_satellites=4, num_targets=500, budget_s=15.0, quick_budget_s=None,
        dynamics="physical", objective=_shared(0.9), has_random_rewards=True, turns_to_sun=True,
    ),
    "sun-fleet-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=20.0, quick_budget_s=None,
        dynamics="physical", turns_to_sun=True,
    ),
    "share-sun-250": Family(
        num_targets=250, budget_s=15.0, quick_budget_s=None, dynamics="physical",
        objective=_shared(0.9), turns_to_sun=True,
    ),
    "continuous-sun-fleet-3x500": Family(
        num_satellites=3, num_targets=500, budget_s=15.0, quick_budget_s=None,
        continuous_starts=True, dynamics="physical", objective=_shared(0.9), turns_to_sun=True,
    ),
    "continuous-sun-500": Family(
        num_targets=500, budget_s=10.0, quick_budget_s=None,
        continuous_starts=True, dynamics="physical", turns_to_sun=True,
    ),
    "spaced-sun-500": Family(
        num_targets=500, budget_s=15.0, quick_budget_s=None,
        spacing_s=15.0, dynamics="physical", turns_to_sun=True,
    ),
    "spaced-weights-1000": Family(
        num_targets=1000, budget_s=20.0, quick_budget_s=None, spacing_s=60.0, dynamics="physical",
        has_random_rewards=True,
    ),
    "half-life-3h-1000": Family(
        num_targets=1000, budget_s=10.0, quick_budget_s=8.0, dynamics="physical",
        objective=_halved_in(3.0),
    ),
    "half-life-3h-100": Family(
        num_targets=100, budget_s=8.0, quick_budget_s=None, dynamics="physical",
        objective=_halved_in(3.0),
    ),
    "half-life-12h-1000": Family(
        num_targets=1000, budget_s=10.0, quick_budget_s=10.0, dynamics="physical",
        objective=_halved_in(12.0),
    ),
    "half-life-12h-share-1000": Family(
        num_targets=1000, budget_s=10.0, quick_budget_s=None, dynamics="physical",
        objective=_halved_in(12.0, 0.9),
    ),
    "half-life-12h-share-paper-1000": Family(
        num_targets=1000, budget_s=10.0, quick_budget_s=None, dynamics="paper",
        objective=_halved_in(12.0, 0.9),
    ),
    "half-life-3h-share-paper-300": Family(
        num_targets=300, budget_s=8.0, quick_budget_s=None, dynamics="paper",
        objective=_halved_in(3.0, 0.9),
    ),
    "half-life-3h-fleet-4x80": Family(
        num_satellites=4, num_targets=80, budget_s=10.0, quick_budget_s=None, num_draws=3,
        dynamics="physical", objective=_halved_in(3.0),
    ),
    "half-life-1h-fleet-4x1000": Family(
        num_satellites=4, num_targets=1000, budget_s=15.0, quick_budget_s=None, spacing_s=30.0,
        dynamics="physical", objective=_halved_in(1.0),
    ),
    "half-life-6h-network-4x400": Family(
        num_satellites=4, num_targets=400, budget_s=20.0, quick_budget_s=None,
        dynamics="physical", objective=_halved_in(6.0, 0.5), num_stations=30,
    ),
    "half-life-12h-fleet-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=40.0, quick_budget_s=None, dynamics="physical",
        objective=_halved_in(12.0),
    ),
    "delivered-fleet-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=60.0, quick_budget_s=None, dynamics="physical",
        objective=_DELIVERED,
    ),
    "clouds-1000": Family(
        num_targets=1000, budget_s=20.0, quick_budget_s=10.0, dynamics="physical",
        has_forecast=True,
    ),
    "clouds-fleet-4x2000": Family(
        num_satellites=4, num_targets=2000, budget_s=60.0, quick_budget_s=None, dynamics="physical",
        has_forecast=True,
    ),
}  # fmt: skip


def scenario_of(family: Family, draw: int) -> Scenario:
    """Return one mission of a family."""
    scenario = paper_scenario(
        family.num_targets,
        draw,
        use_resources=family.dynamics is not None,
        dynamics=family.dynamics or "physical",
    )
    if family.num_satellites > 1:
        scenario = replace(
            scenario,
            horizon=Horizon(start=_FLEET_START, end=_FLEET_START + timedelta(days=1)),
            satellites=(_train if family.is_train else fleet)(family.num_satellites),
            targets=towns(family.num_targets, draw),
        )
    if family.has_random_rewards:
        rewards = np.random.default_rng(draw).integers(1, 11, len(scenario.targets))
        rewarded = zip(scenario.targets, rewards.tolist(), strict=True)
        scenario = replace(
            scenario, targets=tuple(replace(t, reward=float(r)) for t, r in rewarded)
        )
    if family.has_tight_battery:
        scenario = replace(scenario, satellites=tuple(map(_tight, scenario.satellites)))
    if family.turns_to_sun:
        scenario = replace(scenario, satellites=tuple(map(_turning, scenario.satellites)))
    if family.num_stations is not None:
        scenario = replace(scenario, ground_stations=_network(family.num_stations, draw))
    if family.has_quality:
        scenario = replace(scenario, quality=_OFF_NADIR)
    if family.has_forecast:
        scenario = replace(scenario, forecast=forecast_of(scenario, Weather(draw)))
    return replace(
        scenario,
        objective=family.objective,
        collect_spacing_s=family.spacing_s,
        continuous_starts=family.continuous_starts,
    )


def warm_up_of(family: Family) -> Scenario:
    """Return a small mission of the same kind, which loads the kernels that the family needs."""
    small = replace(family, num_targets=min(_WARM_UP_TARGETS, family.num_targets))
    return scenario_of(replace(small, num_satellites=min(2, family.num_satellites)), _WARM_UP_DRAW)


def fleet(number: int) -> tuple[Satellite, ...]:
    """Return satellites in evenly spread planes, each with 1 deg/s and 15 s to settle."""
    return tuple(_fleet_satellite(i, 360.0 * i / number, 180.0 * i / number) for i in range(number))


def _train(number: int) -> tuple[Satellite, ...]:
    """Return the same satellites, each some minutes behind the one before it."""
    return tuple(_fleet_satellite(i, 0.0, _APART_DEG * i) for i in range(number))


def _fleet_satellite(index: int, raan_deg: float, mean_anomaly_deg: float) -> Satellite:
    orbit = OrbitElements(
        name=f"Spacecraft {index + 1}",
        norad_cat_id=index + 1,
        object_id="",
        epoch=_FLEET_START,
        mean_motion_rev_day=15.24,
        eccentricity=0.0001,
        inclination_deg=97.4,
        raan_deg=raan_deg,
        arg_perigee_deg=0.0,
        mean_anomaly_deg=mean_anomaly_deg,
    )
    return Satellite(
        id=f"s{index + 1}",
        name=f"Spacecraft {index + 1}",
        orbit=orbit,
        agility=Agility(slew_rate_deg_s=1.0, settle_s=15.0),
        resources=Resources.paper(orbit.period_s),
    )


def towns(number: int, draw: int) -> tuple[Target, ...]:
    """Return targets in clusters, like cities, around land scenes drawn at random."""
    scenes = paper_scenario(number, draw, use_resources=False).targets
    inhabited = [scene for scene in scenes if abs(scene.lat_deg) <= _HIGHEST_TOWN_LAT_DEG]
    centres = inhabited[: -(-number // _TARGETS_PER_TOWN)]
    rng = np.random.default_rng(draw)
    chosen = rng.integers(len(centres), size=number)
    north_deg, east_deg = rng.normal(0.0, _TOWN_SPREAD_DEG, (2, number))
    lat_deg = np.array([centre.lat_deg for centre in centres])[chosen] + north_deg
    lon_deg = np.array([centre.lon_deg for centre in centres])[chosen]
    lon_deg = (lon_deg + east_deg / np.cos(np.radians(lat_deg)) + 180.0) % 360.0 - 180.0
    return tuple(
        Target(id=f"t{i + 1}", lat_deg=lat, lon_deg=lon)
        for i, (lat, lon) in enumerate(zip(lat_deg.tolist(), lon_deg.tolist(), strict=True))
    )


def _network(number: int, draw: int) -> tuple[GroundStation, ...]:
    scenes = paper_scenario(number, draw, use_resources=False).targets
    return tuple(
        GroundStation(id=f"g{i + 1}", name=scene.id, lat_deg=scene.lat_deg, lon_deg=scene.lon_deg)
        for i, scene in enumerate(scenes)
    )


def _turning(satellite: Satellite) -> Satellite:
    return replace(satellite, resources=replace(satellite.resources, sun_pointing="slew"))


def _tight(satellite: Satellite) -> Satellite:
    resources = satellite.resources
    return replace(
        satellite,
        resources=replace(
            resources,
            collect_drain_per_s=2.0 * resources.collect_drain_per_s,
            sunpoint_charge_per_s=0.5 * resources.sunpoint_charge_per_s,
        ),
    )
