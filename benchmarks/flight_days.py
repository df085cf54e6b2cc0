"""Whole days flown: each planner's timeline of a scenario file and its variants, as a table.

``python -m benchmarks.flight_days SCENARIO.json FOLDER`` plans a scenario file's mission with
and without resources, and with several starts in each access, by each given solver, flies all in
Basilisk (``benchmarks.flight``, in the interpreter given by ``--python``), and prints a Markdown
table. Scenario files, timelines and reports of the flights are left in the folder. With
``--first-release`` missions are planned as by the first release, with slews from rest to rest and
charge in all idle time, and flown by the spacecraft as it is, also those with continuous starts.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Final

Document = dict[str, Any]


def _without_resources(scenario: Document) -> Document:
    # Without them nothing is downlinked, so an objective that counts delivery has no meaning.
    return {key: scenario[key] for key in scenario if key != "objective"} | {"use_resources": False}


VARIANTS: Final[Mapping[str, Callable[[Document], Document]]] = {
    "resources": lambda scenario: scenario,
    "no resources": _without_resources,
    "15 s apart": lambda scenario: {**scenario, "collect_spacing_s": 15.0},
    "15 s apart, no resources": lambda scenario: {
        **_without_resources(scenario), "collect_spacing_s": 15.0
    },
    "continuous, no resources": lambda scenario: {
        **_without_resources(scenario), "continuous_starts": True
    },
}  # fmt: skip
SOLVERS: Final = ("rule", "forward_search", "mcts", "certified")

_FIGURES: Final = {
    "on target": r"collects on target +([\d.]+% of \d+)",
    "turns longer than gaps": r"turns longer than gaps +(\d+)",
    "contacts on station": r"contacts on station +([\d.]+% of \d+)",
    "below the curve": r"battery.* at most (\S+) below",
    "recorder within": r"recorder +within (\S+)",
    "torque": r"body rate, wheel torque .* and ([\d.]+)",
}


def known_before(scenario: Document) -> Document:
    """Return a scenario in the terms of the first release.

    Slews go from rest to rest, all idle time charges, and the constant load is added to each mode.
    """
    satellites = [
        {
            **satellite,
            "agility": {**satellite["agility"], "slew_model": "rest"},
            "resources": _net_of_idle(satellite["resources"]),
        }
        for satellite in scenario["satellites"]
    ]
    return {**scenario, "satellites": satellites}


def _net_of_idle(resources: Document) -> Document:
    idle_w = resources["idle_power_w"]
    return {
        **resources,
        "sun_pointing": "free",
        "eclipse_aware": False,
        "idle_power_w": 0.0,
        "sunpoint_power_w": resources["sunpoint_power_w"] - idle_w,
        "collect_power_w": resources["collect_power_w"] + idle_w,
        "contact_power_w": resources["contact_power_w"] + idle_w,
    }


def row_of(scenario: Path, solver: str, options: argparse.Namespace) -> str:
    """Plan and fly one day, and return its row of the table."""
    planned = scenario
    if options.first_release:
        planned = scenario.with_name(f"{scenario.stem}-before.json")
        planned.write_text(json.dumps(known_before(json.loads(scenario.read_text()))))
    timeline = planned.with_name(f"{planned.stem}-{solver}.json")
    if not timeline.exists():
        subprocess.run([sys.executable, "-m", "service", "solve", str(planned), "--solver",
                        solver, "--time-s", str(options.time_s), "--out", str(timeline)],
                       check=True, capture_output=True)  # fmt: skip
    flown = subprocess.run([options.python, "-m", "benchmarks.flight", str(scenario),
                            str(timeline), "--require", "0.995"],
                           capture_output=True, text=True, check=False)  # fmt: skip
    timeline.with_suffix(".txt").write_text(flown.stdout + flown.stderr, encoding="utf-8")
    figures = [re.search(pattern, flown.stdout) for pattern in _FIGURES.values()]
    told = [figure[1] if figure else "" for figure in figures]
    return " | ".join([solver, *told, "yes" if flown.returncode == 0 else "no"])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--python", default=sys.executable, help="an interpreter with Basilisk")
    parser.add_argument("--variants", nargs="*", choices=VARIANTS, default=list(VARIANTS))
    parser.add_argument("--solvers", nargs="*", default=list(SOLVERS))
    parser.add_argument("--first-release", action="store_true",
                        help="plan with its slews and its charge")  # fmt: skip
    parser.add_argument("--time-s", type=float, default=20.0, help="of the clock, for each plan")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    mission = json.loads(options.scenario.read_text())
    print(f"| mission | solver | {' | '.join(_FIGURES)} | flyable |")
    print(f"|{'---|' * (len(_FIGURES) + 3)}")
    with ThreadPoolExecutor(max_workers=2) as pool:
        for name in options.variants:
            # Continuous starts are refused if slews begin and end in motion.
            if name.startswith("continuous") and not options.first_release:
                continue
            path = options.folder / f"{name.replace(', ', '-').replace(' ', '-')}.json"
            path.write_text(json.dumps(VARIANTS[name](mission)), encoding="utf-8")
            for row in pool.map(partial(row_of, path, options=options), options.solvers):
                print(f"| {name} | {row} |", flush=True)


if __name__ == "__main__":
    main()
