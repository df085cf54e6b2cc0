"""CSV (RFC 4180): one row for each action, sun-pointing included.

Spreadsheets run a cell that begins with =, +, - or @. Texts that do are written behind an
apostrophe, as spreadsheets themselves show text, and so are those that begin with apostrophes
and then such a sign: reading takes exactly one apostrophe away, and no id is lost.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from datetime import datetime
from typing import Any

from planner_core.spreadsheets import guarded
from service.answers.answered import Answered, Document, in_chunks

COLUMNS = (
    "action_id", "satellite_id", "satellite_name", "mode", "start", "end", "duration_s",
    "target_id", "station_id", "opportunity_id", "off_nadir_deg", "azimuth_deg",
    "slew_angle_deg", "slew_needed_s", "slew_available_s", "reward",
    "battery_fraction_end", "recorder_fraction_end", "worth", "quality", "station_name",
    "delivered_at", "age_s", "clear_probability", "target_name",
)  # fmt: skip


def write(answered: Answered) -> Iterator[str]:
    """Yield the table, satellite by satellite, in order of start."""
    return in_chunks(_lines(answered))


def _lines(answered: Answered) -> Iterator[str]:
    yield line(COLUMNS)
    for satellite, action in answered.each_action():
        station_name = guarded(_station_name(answered, action))
        # Answers of earlier releases do not have them.
        behind = (action.get(name) for name in ("delivered_at", "age_s", "clear_probability"))
        target_name = guarded(action.get("target_name"))
        yield line((*_cells(satellite, action), station_name, *behind, target_name))


def _station_name(answered: Answered, action: Document) -> str | None:
    if action["station_id"] is None or "station_name" in action:
        return action.get("station_name")
    # Answers of the first release have no names of stations; their questions do.
    stations = answered.question.ground_stations
    return next((one.name for one in stations if one.id == action["station_id"]), None)


def line(cells: Iterable[object]) -> str:
    """Return a line of a table."""
    written = io.StringIO(newline="")
    csv.writer(written).writerow(cells)
    return written.getvalue()


def _cells(satellite: Document, action: Document) -> tuple[Any, ...]:
    start, end = (datetime.fromisoformat(action[name]) for name in ("start", "end"))
    slew = action["slew"] or {}
    return (
        action["id"],
        guarded(satellite["id"]),
        guarded(satellite["name"]),
        action["mode"],
        action["start"],
        action["end"],
        (end - start).total_seconds(),
        guarded(action["target_id"]),
        guarded(action["station_id"]),
        action["opportunity_id"],
        action["off_nadir_deg"],
        action["azimuth_deg"],
        slew.get("angle_deg"),
        slew.get("needed_s"),
        slew.get("available_s"),
        action["reward"],
        action["battery_fraction_end"],
        action["recorder_fraction_end"],
        # Answers of the first release do not have them.
        action.get("worth"),
        action.get("quality"),
    )
