"""Fleets over cities: the public benchmark's satellites, and larger fleets modelled on it.

The benchmark is Eddy and Kochenderfer's ("A Maximum Independent Set Method for Scheduling
Earth-Observing Satellite Constellations", 2021): circular orbits of 97.4 degrees, a day from
2020-01-01 on, images of 30 s, one in each access, 1 deg/s and 15 s to settle.
"""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

import numpy as np

from planner_core.domain import (
    Agility,
    Dynamics,
    GroundStation,
    Horizon,
    Resources,
    Satellite,
    Scenario,
    Target,
    mean_elements,
)
from planner_core.orbits.tle import parse_tle

START: Final = datetime(2020, 1, 1, tzinfo=UTC)
_SPREAD_DEG: Final = 2.0  # of additional targets around the cities


@dataclass(frozen=True, slots=True, kw_only=True)
class Files:
    """Paths of the benchmark's satellites and cities."""

    spacecraft: Path
    cities: Path
    stations: Path | None = None


def fleet_scenario(
    files: Files,
    num_satellites: int,
    num_targets: int,
    *,
    use_resources: bool = False,
    dynamics: Dynamics = "physical",
    spacing_s: float | None = None,
) -> Scenario:
    """Return one day of a fleet over cities; see ``satellites`` and ``targets``."""
    return Scenario(
        horizon=Horizon(start=START, end=START + timedelta(days=1)),
        satellites=satellites(files.spacecraft, num_satellites),
        targets=targets(files.cities, num_targets),
        ground_stations=stations(files.stations) if use_resources else (),
        use_resources=use_resources,
        dynamics=dynamics,
        collect_spacing_s=spacing_s,
    )


def satellites(path: Path, number: int) -> tuple[Satellite, ...]:
    """Return the file's satellites, or copies of the first in evenly spread planes."""
    known = []
    for record in json.loads(path.read_text(encoding="utf-8")):
        orbit = replace(parse_tle([record["line1"], record["line2"]]), name=record["name"])
        known.append(
            Satellite(
                id=f"s{record['id']}",
                name=record["name"],
                orbit=orbit,
                agility=Agility(
                    slew_rate_deg_s=record["model"]["slew_rate"],
                    settle_s=record["model"]["settling_time"],
                ),
                resources=Resources.paper(orbit.period_s),
            )
        )
    if number == len(known):
        return tuple(known)
    first = known[0]
    return tuple(
        replace(
            first,
            id=f"s{i + 1}",
            name=f"Spacecraft {i + 1}",
            orbit=replace(
                mean_elements(first.orbit),
                name=f"Spacecraft {i + 1}",
                norad_cat_id=i + 1,
                raan_deg=360.0 * i / number,
            ),
        )
        for i in range(number)
    )


def targets(path: Path, number: int) -> tuple[Target, ...]:
    """Return the largest cities, then seeded points around them once the file has no more."""
    with path.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    lat = np.array([float(row["lat"]) for row in rows])
    lon = np.array([float(row["lon"]) for row in rows])
    ids = [row["id"] for row in rows]
    more = max(0, number - len(rows))
    rng = np.random.default_rng(0)
    near = rng.integers(len(rows), size=more)
    north, east = rng.normal(0.0, _SPREAD_DEG, (2, more))
    further_lat = np.clip(lat[near] + north, -85.0, 85.0)
    further_lon = lon[near] + east / np.cos(np.radians(lat[near]))
    lat = np.concatenate([lat, further_lat])[:number]
    lon = np.concatenate([lon, (further_lon + 180.0) % 360.0 - 180.0])[:number]
    ids = [*ids, *(f"near-{ids[city]}-{i}" for i, city in enumerate(near.tolist()))][:number]
    return tuple(
        Target(id=own_id, lat_deg=float(a), lon_deg=float(b))
        for own_id, a, b in zip(ids, lat, lon, strict=True)
    )


def stations(path: Path | None) -> tuple[GroundStation, ...]:
    """Return the file's stations."""
    if path is None:
        return ()
    return tuple(
        GroundStation(
            id=f"g{i + 1}",
            name=f"Station {i + 1}",
            lat_deg=record["lat"],
            lon_deg=record["lon"],
            min_elevation_deg=record["elevation_min"],
        )
        for i, record in enumerate(json.loads(path.read_text(encoding="utf-8")))
    )
