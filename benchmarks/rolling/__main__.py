"""Fly seven days in closed loop (``python -m benchmarks.rolling CSV``).

Writes a row for each policy and seed as soon as it is done; existing rows are not run again.
Several processes may write the same file, each with its own policies or seeds.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import asdict, fields
from pathlib import Path

from benchmarks.rolling.loop import POLICIES, Case, Loop, Outcome
from planner_core.domain import Objective

OBJECTIVES = {
    "collected": Objective.collected(),
    "delivered": Objective.delivered(),
    "default": Objective(collected_share=0.9),
}
KEY = ("objective", "satellites", "days", "policy", "seed")


def run(path: Path, objective: str, case: Case) -> None:
    """Run a case and append its row, unless it exists."""
    key = (objective, case.num_satellites, case.days, case.policy, case.seed)
    named = {name: str(value) for name, value in zip(KEY, key, strict=True)}
    if path.exists() and any(named.items() <= row.items() for row in rows_of(path)):
        return
    outcome = Loop(case).run()
    is_new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        names = [*KEY, *(field.name for field in fields(Outcome))]
        writer = csv.DictWriter(file, names, lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow({**named, **{k: _short(v) for k, v in asdict(outcome).items()}})


def rows_of(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _short(value: float | str) -> float | str:
    return round(value, 4) if isinstance(value, float) else value


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--policies", nargs="+", choices=POLICIES, default=list(POLICIES))
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(5)))
    parser.add_argument("--satellites", type=int, default=1)
    parser.add_argument("--days", type=int, default=7)
    parser.add_argument("--objective", choices=OBJECTIVES, default="collected")
    asked = parser.parse_args()
    for seed in asked.seeds:
        for policy in asked.policies:
            case = Case(
                policy=policy, seed=seed, num_satellites=asked.satellites, days=asked.days,
                objective=OBJECTIVES[asked.objective],
            )  # fmt: skip
            run(asked.table, asked.objective, case)


if __name__ == "__main__":
    main()
