"""Plot a table of ``benchmarks.soak`` (``python -m benchmarks.soak_plot CSV PNG``)."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from matplotlib.figure import Figure

from benchmarks.soak import KINDS


def main(table: str, picture: str) -> None:
    """Plot memory, descriptors and database size over the hours."""
    with Path(table).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    hours = [float(row["minutes"]) / 60.0 for row in rows]
    figure = Figure(figsize=(8, 8), layout="constrained")
    memory, descriptors, database, calls = figure.subplots(4, sharex=True)
    for kind in KINDS:
        name = kind.replace(" ", "_")
        memory.plot(hours, [float(row[f"{name}_mb"]) for row in rows], label=kind)
        descriptors.plot(hours, [float(row[f"{name}_descriptors"]) for row in rows], label=kind)
    database.plot(hours, [float(row["database_mb"]) for row in rows])
    for name in ("call_p50_ms", "call_p99_ms"):
        calls.plot(hours, [float(row[name]) for row in rows], label=name[5:8])
    for axes, unit in (
        (memory, "memory (MB)"), (descriptors, "descriptors"), (database, "database (MB)"),
        (calls, "a call (ms)"),
    ):  # fmt: skip
        axes.set_ylabel(unit)
        axes.set_ylim(bottom=0)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in (memory, descriptors, calls):
        axes.legend(loc="center right", framealpha=1.0)
    calls.set_xlabel("hours")
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    main(*sys.argv[1:])
