"""Contacts of real satellites with real stations, against Skyfield's own search.

The reference lists every contact of 20 Earth-observation satellites with 12 stations on
2022-08-16 (Skyfield 1.55, ``find_events``, mask 5 deg, no refraction). Its edges are printed
to 10 ms, and its search stops within 0.2 s of the true edge.
"""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from datetime import UTC, datetime, timedelta
from pathlib import Path

from planner_core.access.limits import Limits
from planner_core.access.windows import find_accesses
from planner_core.domain import GroundStation, Horizon
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites
from tests.geometry import orbit_from_omm, satellite

DAY = Horizon(start=datetime(2022, 8, 16, tzinfo=UTC), end=datetime(2022, 8, 17, tzinfo=UTC))
Windows = dict[tuple[str, str], list[tuple[float, float]]]


def expected_contacts(folder: Path) -> Windows:
    contacts: Windows = defaultdict(list)
    with (folder / "refs/skyfield_contacts/eo20_aws_2022-08-16_mask5.csv").open() as file:
        for row in csv.DictReader(file):
            start, end = (
                DAY.offset_s(datetime.fromisoformat(row[name])) for name in ("start_utc", "end_utc")
            )
            contacts[row["satellite"], row["station"]].append((start, end))
    return contacts


def stations(folder: Path) -> list[GroundStation]:
    features = json.loads((folder / "stations/aws.geojson").read_text())["features"]
    return [
        GroundStation(
            id=feature["properties"]["name"],
            name=feature["properties"]["name"],
            lon_deg=feature["geometry"]["coordinates"][0],
            lat_deg=feature["geometry"]["coordinates"][1],
        )
        for feature in features
    ]


def found_contacts(folder: Path) -> Windows:
    ground = stations(folder)
    contacts: Windows = defaultdict(list)
    for record in json.loads((folder / "omm/derived_eo_2022-08-15.json").read_text()):
        name = record["OBJECT_NAME"]
        path = propagate(satellite(orbit_from_omm(record), name=name), DAY)
        found = find_accesses(path, Sites.of(ground), Limits.of_stations(ground))
        for site, start, end in zip(found.site, found.start_s, found.end_s, strict=True):
            contacts[name, ground[site].id].append((float(start), float(end)))
    return contacts


def test_all_1280_contacts_are_found_and_no_other(shared_data: Path) -> None:
    expected, found = expected_contacts(shared_data), found_contacts(shared_data)
    assert sum(map(len, expected.values())) == 1280
    assert {pair: len(windows) for pair, windows in found.items()} == {
        pair: len(windows) for pair, windows in expected.items()
    }
    for pair, windows in expected.items():
        for (start, end), (found_start, found_end) in zip(windows, found[pair], strict=True):
            assert abs(start - found_start) < 0.25, (pair, DAY.start + timedelta(seconds=start))
            assert abs(end - found_end) < 0.25, (pair, DAY.start + timedelta(seconds=end))
