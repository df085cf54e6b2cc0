"""Images taken, images downlinked and their age, over ``collected_share`` and ``half_life_s``.

Run as ``python -m benchmarks.objective CSV PNG``. It plans the demonstration's mission, and the
same with four such satellites in planes 45 deg apart, for every objective below, and plots both.
Rows that the CSV already holds are not planned again.
"""

from __future__ import annotations

import argparse
import csv
import io
import itertools
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any

from matplotlib.figure import Figure

from benchmarks.cpu_budget import CpuBudget
from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.certified.solver import Certified
from planner_core.run import plan_scenario
from service.commands import demo_mission
from service.scenarios.translate import scenario_from_content

_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
_HALF_LIVES_H = (None, 12.0, 6.0, 3.0)
_MISSIONS = {"one satellite": 1, "four satellites": 4}
_LONGEST_S = 3600.0
_COLUMNS = (
    "mission", "collected_share", "half_life_h", "images", "on_the_ground", "median_age_h",
    "gap_percent", "cpu_s",
)  # fmt: skip


def document(num_satellites: int, share: float, half_life_h: float | None) -> dict[str, Any]:
    """Return the demonstration's mission with some satellites and an objective."""
    own = demo_mission.SATELLITE
    rows = csv.DictReader(io.StringIO(demo_mission.targets_csv()))
    return {
        "release": 2,
        "objective": {
            "collected_share": share,
            "half_life_s": None if half_life_h is None else 3600.0 * half_life_h,
        },
        "horizon": demo_mission.HORIZON,
        "satellites": [
            {
                **own,
                "name": f"{own['name']}-{i + 1}",
                "omm": own["omm"] | {"RA_OF_ASC_NODE": 45.0 * i, "NORAD_CAT_ID": i + 1},
            }
            for i in range(num_satellites)
        ],
        "targets": [
            {"id": row["id"], "lat_deg": float(row["lat_deg"]), "lon_deg": float(row["lon_deg"])}
            for row in rows
        ],
        "ground_stations": list(demo_mission.GROUND_STATIONS),
    }


@cache
def _computed(num_satellites: int) -> ScenarioOpportunities:
    """Return the opportunities, which are the same for every objective."""
    return compute_opportunities(
        scenario_from_content(document(num_satellites, 1.0, None)), Budget()
    )


def _figures(num_satellites: int, share: float, half_life_h: float | None, cpu_s: float) -> Any:
    scenario = scenario_from_content(document(num_satellites, share, half_life_h))
    computed = _computed(num_satellites)
    began_s = time.process_time()
    budget = CpuBudget(cpu_s, time.time() + _LONGEST_S)
    judged = plan_scenario(scenario, Certified(), 0, budget, computed)
    spent_s = time.process_time() - began_s
    taken = judged.timeline.collected.values()
    ages_h = [image.age_s / 3600.0 for image in taken if image.age_s is not None]
    if judged.bound is None or judged.timeline.validity != "valid":
        raise AssertionError("a plan without a bound, or one that is not valid")
    return (
        len(taken), len(ages_h), f"{median(ages_h):.2f}",
        f"{100.0 * (1.0 - judged.timeline.reward / judged.bound.value):.2f}", f"{spent_s:.0f}",
    )  # fmt: skip


def _asked(missions: list[str]) -> Iterator[tuple[str, float, float | None]]:
    for mission, share, half_life_h in itertools.product(missions, _SHARES, _HALF_LIVES_H):
        # If images earn everything when taken, nothing is left to decay.
        if share < 1.0 or half_life_h is None:
            yield mission, share, half_life_h


def _rows(table: Path) -> list[dict[str, str]]:
    if not table.exists():
        return []
    with table.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _plan_all(table: Path, missions: list[str], cpu_s: float) -> None:
    known = {(row["mission"], row["collected_share"], row["half_life_h"]) for row in _rows(table)}
    with table.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if not known:
            writer.writerow(_COLUMNS)
        for mission, share, half_life_h in _asked(missions):
            key = mission, f"{share:g}", "" if half_life_h is None else f"{half_life_h:g}"
            if key not in known:
                figures = _figures(_MISSIONS[mission], share, half_life_h, cpu_s)
                writer.writerow((*key, *figures))
                file.flush()


def _draw(rows: list[dict[str, str]], picture: Path) -> None:
    missions = list(dict.fromkeys(row["mission"] for row in rows))
    figure = Figure(figsize=(1 + 4 * len(missions), 6.4), layout="constrained")
    grid = figure.subplots(2, len(missions), sharex=True, squeeze=False)
    colours = dict(zip(_HALF_LIVES_H, ("#1b1b1b", "#0b6fb8", "#c26a00", "#b3261e"), strict=True))
    for column, mission in enumerate(missions):
        counts, ages = grid[0][column], grid[1][column]
        counts.set_title(mission)
        for half_life_h, colour in colours.items():
            name = "" if half_life_h is None else f"{half_life_h:g}"
            own = [
                row for row in rows
                if row["mission"] == mission
                and (row["half_life_h"] == name or row["collected_share"] == "1")
            ]  # fmt: skip
            own.sort(key=lambda row: float(row["collected_share"]))
            shares = [float(row["collected_share"]) for row in own]
            label = "no decay" if half_life_h is None else f"half-life {name} h"
            counts.plot(
                shares, [int(row["images"]) for row in own], "--", color=colour, linewidth=1
            )
            counts.plot(shares, [int(row["on_the_ground"]) for row in own], "o-", color=colour,
                        markersize=3, label=label)  # fmt: skip
            ages.plot(shares, [float(row["median_age_h"]) for row in own], "o-", color=colour,
                      markersize=3)  # fmt: skip
        counts.set_ylim(bottom=0)
        ages.set_ylim(bottom=0)
        ages.set_xlabel("collected_share")
        for axes in (counts, ages):
            axes.spines[["top", "right"]].set_visible(False)
    grid[0][0].set_ylabel("images: taken (dashed), on the ground")
    grid[1][0].set_ylabel("median age of those on the ground, h")
    grid[0][0].legend(loc="lower right", framealpha=1.0)
    figure.savefig(picture, dpi=110)


def main() -> None:
    """Plan what is missing in the table, and plot it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--mission", choices=_MISSIONS, action="append", help="(all)")
    parser.add_argument("--cpu-s", type=float, default=8.0, help="CPU, of each search")
    arguments = parser.parse_args()
    _plan_all(arguments.table, arguments.mission or list(_MISSIONS), arguments.cpu_s)
    _draw(_rows(arguments.table), arguments.picture)


if __name__ == "__main__":
    main()
