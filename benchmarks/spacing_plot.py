"""Plot a table of ``slewline compare-spacing`` (``python -m benchmarks.spacing_plot CSV PNG``).

Bars are plans; the line above each is the bound for that choice of starts.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from matplotlib.figure import Figure


def main(table: str, picture: str) -> None:
    """Plot the table into a picture."""
    with Path(table).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    rewards = [float(row["reward"]) for row in rows]
    figure = Figure(figsize=(8, 3.6), layout="constrained")
    axes = figure.add_subplot()
    axes.bar(range(len(rows)), rewards, width=0.62, color="#0b6fb8", label="plan")
    for place, row in enumerate(rows):
        top = rewards[place]
        if row["bound"] != "-":
            top = float(row["bound"])
            axes.hlines(
                top, place - 0.31, place + 0.31, color="#b3261e", linewidth=2,
                label="proven bound" if place == 0 else "_",
            )  # fmt: skip
        axes.annotate(
            f"{rewards[place]:g}" + (f"  {row['gain']}" if place else ""),
            (place, top), xytext=(0, 4), textcoords="offset points", ha="center",
        )  # fmt: skip
    axes.set_xticks(range(len(rows)), [row["starts"] for row in rows])
    axes.set_ylabel("reward")
    axes.set_ylim(0, 1.13 * max(rewards))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower right", framealpha=1.0)
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    main(*sys.argv[1:])
