"""A fleet planned with all defaults, compared with plans that count images alone.

Run as ``python -m benchmarks.default_fleet SATELLITES.tle CITIES.csv STATIONS.geojson``, with
element sets of Earth-observation satellites, cities as ``id,lat,lon`` and stations as GeoJSON
points. It prints a table: the second release's defaults, the same satellites planned for the number
of images, and the defaults of the first release, whose satellites know neither night nor turns to
the sun.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.solver import Certified
from planner_core.orbits.tle import parse_tle
from planner_core.run import Judged, plan_scenario
from service.scenarios.translate import scenario_from_content

_CASES: dict[str, dict[str, Any]] = {
    "all defaults": {"release": 2},
    "images counted": {"release": 2, "objective": "collected"},
    "first release": {"objective": "collected", "resources": "paper"},
}


def _satellites(path: Path, number: int) -> Iterator[dict[str, Any]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    for name, first, second in list(zip(lines[::3], lines[1::3], lines[2::3], strict=True))[
        :number
    ]:
        yield {"name": name.strip(), "tle": [first.rstrip(), second.rstrip()]}


def _targets(path: Path) -> Iterator[dict[str, Any]]:
    with path.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines):
            yield {"id": row["id"], "lat_deg": float(row["lat"]), "lon_deg": float(row["lon"])}


def _stations(path: Path) -> Iterator[dict[str, Any]]:
    for feature in json.loads(path.read_text(encoding="utf-8"))["features"]:
        lon_deg, lat_deg = feature["geometry"]["coordinates"][:2]
        yield {"name": feature["properties"]["name"], "lat_deg": lat_deg, "lon_deg": lon_deg}


def _document(arguments: argparse.Namespace, case: dict[str, Any]) -> dict[str, Any]:
    satellites = list(_satellites(arguments.satellites, arguments.num_satellites))
    epochs = [parse_tle(satellite["tle"]).epoch for satellite in satellites]
    start = max(epochs).replace(hour=0, minute=0, second=0, microsecond=0) + timedelta(days=1)
    case = dict(case)
    resources = case.pop("resources", None)
    if resources is not None:
        satellites = [{**satellite, "resources": resources} for satellite in satellites]
    return {
        **case,
        "horizon": {
            "start": start.isoformat(),
            "end": (start + timedelta(days=arguments.days)).isoformat(),
        },
        "satellites": satellites,
        "targets": list(_targets(arguments.cities)),
        "ground_stations": list(_stations(arguments.stations)),
    }


def _row(name: str, judged: Judged, spent_s: float) -> str:
    timeline, table = judged.timeline, judged.problem.opportunities
    rows = [
        judged.solution.plan.actions[c.position].opportunity for c in timeline.collected.values()
    ]
    ages_h = [c.age_s / 3600.0 for c in timeline.collected.values() if c.age_s is not None]
    counts = np.bincount(table.satellite[rows], minlength=len(judged.problem.satellites))
    bound = judged.bound.value if judged.bound else float("nan")
    gap = 1.0 - timeline.reward / bound if bound else 0.0
    return (
        f"| {name} | {len(rows)} | {np.count_nonzero(table.sun_elevation_deg[rows] < 0.0)} "
        f"| {len(ages_h)} | {median(ages_h):.1f} | {max(ages_h):.1f} | {np.median(counts):g} "
        f"| {counts.max()} | {np.abs(table.off_nadir_deg[rows]).mean():.0f} | {100 * gap:.1f} "
        f"| {timeline.validity} | {spent_s:.0f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("satellites", type=Path)
    parser.add_argument("cities", type=Path)
    parser.add_argument("stations", type=Path)
    parser.add_argument("--num-satellites", type=int, default=20)
    parser.add_argument("--days", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each search")
    parser.add_argument("--case", choices=_CASES, action="append")
    arguments = parser.parse_args()
    print(
        "| plan | images | at night | on the ground | median age h | oldest h "
        "| images of a satellite: median | most | off nadir deg | gap % | validity | CPU s |\n|"
        + "---|"
        * 12
    )
    for name in arguments.case or _CASES:
        scenario = scenario_from_content(_document(arguments, _CASES[name]))
        began = time.process_time()
        judged = plan_scenario(scenario, Certified(), 0, Budget(arguments.seconds))
        print(_row(name, judged, time.process_time() - began), flush=True)


if __name__ == "__main__":
    main()
