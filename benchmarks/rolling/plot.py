"""Plot what policies delivered (``python -m benchmarks.rolling.plot CSV PNG``).

A dot is a week with its own random failures, a bar their mean. Policies that have not flown every
week are left out.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from benchmarks.rolling.__main__ import rows_of
from benchmarks.rolling.loop import POLICIES

NAMES = {"1": "one plan a day", "2": "two", "4": "four", "pass": "at every pass"}


def compared(rows: list[dict[str, str]]) -> list[str]:
    """Return the policies that have flown all the weeks of a table, in order."""
    weeks = {row["seed"] for row in rows}
    flown = {policy: {r["seed"] for r in rows if r["policy"] == policy} for policy in POLICIES}
    return [policy for policy in POLICIES if flown[policy] == weeks]


def main(table: str, picture: str) -> None:
    """Draw the table into a picture."""
    from matplotlib.figure import Figure  # slow to import, and not needed by ``compared``

    rows = rows_of(Path(table))
    policies = compared(rows)
    figure = Figure(figsize=(8, 3.4), layout="constrained")
    worth, urgent = figure.subplots(1, 2)
    for axes, name, scale in ((worth, "worth", 1.0), (urgent, "urgent_down_in_time", 100.0)):
        for place, policy in enumerate(policies):
            own = [scale * float(row[name]) for row in rows if row["policy"] == policy]
            mean = float(np.mean(own))
            axes.bar(place, mean, width=0.62, color="#0b6fb8")
            axes.plot([place] * len(own), own, "o", color="#17324d", markersize=4)
            axes.annotate(
                f"{mean:.0f}", (place, max(own)), xytext=(0, 5), textcoords="offset points",
                ha="center",
            )  # fmt: skip
        axes.set_xticks(range(len(policies)), [NAMES[policy] for policy in policies])
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_ylim(bottom=0)
    worth.set_ylabel("worth on the ground in seven days")
    urgent.set_ylabel("urgent, imaged in 12 h and down, %")
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    main(*sys.argv[1:])
