"""Timelines as a few lines of text for people at a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

HEADER = (
    "solver", "reward", "bound", "gap", "collects", "contacts", "downlinked",
    "capacities", "battery", "recorder", "search", "total", "validity",
)  # fmt: skip
LEGEND = (
    "downlinked: targets whose image is on the ground; capacities: data downlinked, in recorder "
    "capacities;\nbattery: lowest; recorder: highest; search and total: seconds."
)


def summary_row(timeline: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the cells of one timeline document, in the order of ``HEADER``."""
    totals, runtime_s = timeline["totals"], timeline["runtime_s"]
    return (
        timeline["solver"]["name"],
        f"{totals['reward']:g}",
        cell(totals["bound"], "g"),
        cell(totals["gap"], ".2%"),
        str(totals["collects"]),
        str(totals["contacts"]),
        str(totals["targets"]["downlinked"]),
        cell(totals["downlinked_fraction"], ".2f"),
        cell(totals["battery_min_fraction"], ".1%"),
        cell(totals["recorder_max_fraction"], ".1%"),
        f"{runtime_s['solve']:.3f}",
        f"{sum(runtime_s.values()):.2f}",
        timeline["validity"],
    )


def summary(timeline: Mapping[str, Any]) -> str:
    """Return one timeline document as a table with its legend, and how the search ended."""
    ended = f"ended: {timeline['termination']}; plan {timeline['plan_sha256']}"
    return "\n".join([table([HEADER, summary_row(timeline)]), LEGEND, ended])


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as lines with aligned columns, the first column left-aligned.

    >>> print(table([("solver", "reward"), ("rule", "7")]))
    solver  reward
    rule         7
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows
    )


def cell(value: float | None, layout: str) -> str:
    """Return a number for a table, or a dash for None."""
    return "-" if value is None else format(value, layout)
