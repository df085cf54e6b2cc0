"""Run the suite, or compare two of its files.

``python -m benchmarks.suite [--quick] [--draws N] [--into FILE] [--families ...]`` runs each case
that is not yet in the file, in a process of its own and on one core; the quick form takes some five
minutes.
``python -m benchmarks.suite compare BEFORE AFTER`` prints what has become better and worse.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Final

from benchmarks.suite import rows
from benchmarks.suite.compare import markdown
from benchmarks.suite.engine import Case, Result, run_case
from benchmarks.suite.families import FAMILIES

_ATTEMPTS: Final = 3  # of runs within which something was compiled


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.suite", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one draw of each, smaller budgets")
    parser.add_argument("--draws", type=int, metavar="N", help="number of draws of each family")
    parser.add_argument("--into", type=Path, default=Path("build/suite.csv"), metavar="FILE")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    commands = parser.add_subparsers(dest="command")
    compare = commands.add_parser("compare", help="print a table of two files")
    compare.add_argument("before", type=Path)
    compare.add_argument("after", type=Path)
    one = commands.add_parser("one")
    one.add_argument("case")
    options = parser.parse_args()
    if options.command == "compare":
        print(markdown(_read(options.before), _read(options.after)), end="")
    elif options.command == "one":
        print(json.dumps(asdict(run_case(Case(**json.loads(options.case))))))
    else:
        run(cases(options.families, options.draws, is_quick=options.quick), options.into)


def _read(path: Path) -> list[rows.Row]:
    found = rows.read(path, rows.Row)
    if not found:
        sys.exit(f"{path} holds no rows.")
    return found


def cases(families: list[str], num_draws: int | None = None, *, is_quick: bool) -> list[Case]:
    """Return the cases of the full or the quick form, with this number of draws of each family."""
    found = []
    for name in families:
        family = FAMILIES[name]
        budget_s = family.quick_budget_s if is_quick else family.budget_s
        if budget_s is not None:
            for draw in range(num_draws or (1 if is_quick else family.num_draws)):
                found.append(Case(family=name, draw=draw, seed=draw, budget_s=budget_s))
    # The first draws of all come first: a file of a run stopped early still has every family.
    return sorted(found, key=lambda case: case.draw)


def run(wanted: list[Case], path: Path) -> None:
    """Run missing cases and write each row at once."""
    known = {row.case for row in rows.read(path, rows.Row)}
    for case in wanted:
        if case in known:
            continue
        row = rows.row_of(case, apart(case), rows.Row)
        rows.append(path, row)
        gap = row.failure or (f"{row.gap_percent:.2f} %" if row.gap_percent is not None else "-")
        print(f"{case.family:>22} draw {case.draw}: {gap} ({row.used_s} s)", flush=True)


def apart(case: Case) -> Result | str:
    """Return the result of a case from a process of its own, or how it failed."""
    command = [sys.executable, "-m", "benchmarks.suite", "one", json.dumps(asdict(case))]
    for _ in range(_ATTEMPTS):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return (done.stderr.strip().splitlines() or [f"status {done.returncode}"])[-1]
        result = Result(**json.loads(done.stdout.splitlines()[-1]))
        if result.compiled_s == 0.0:
            return result
    return "compiles kernels in every run"


if __name__ == "__main__":
    main()
