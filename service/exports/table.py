"""CSV (RFC 4180): one row per action, including sun-pointing.

Spreadsheets execute a cell that begins with =, +, - or @. An apostrophe is put before such texts,
as spreadsheets themselves mark text, and also before texts that begin with apostrophes followed by
such a sign: reading removes exactly one apostrophe, so that no id is changed.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from datetime import datetime

from planner_core.spreadsheets import guarded
from service.answers.answered import Answered, Document, chunked

COLUMNS = (
    "action_id", "satellite_id", "satellite_name", "mode", "start", "end", "duration_s",
    "target_id", "station_id", "opportunity_id", "off_nadir_deg", "azimuth_deg",
    "slew_angle_deg", "slew_needed_s", "slew_available_s", "reward",
    "battery_fraction_end", "recorder_fraction_end", "worth", "quality", "station_name",
    "delivered_at", "age_s", "clear_probability", "target_name",
)  # fmt: skip


@chunked
def write(answered: Answered) -> Iterator[str]:
    """Yield the table, satellite by satellite, in order of start."""
    yield line(COLUMNS)
    for satellite, action in answered.each_action():
        start, end = (datetime.fromisoformat(action[name]) for name in ("start", "end"))
        told = {
            **action,
            "action_id": action["id"],
            "satellite_id": satellite["id"],
            "satellite_name": satellite["name"],
            "duration_s": (end - start).total_seconds(),
            "station_name": _station_name(answered, action),
            **{f"slew_{name}": value for name, value in (action["slew"] or {}).items()},
        }
        # Answers of earlier releases lack some columns.
        yield line(told.get(name) for name in COLUMNS)


def _station_name(answered: Answered, action: Document) -> str | None:
    if action["station_id"] is None or "station_name" in action:
        return action.get("station_name")
    # Answers of the first release lack names of stations; their scenarios have them.
    stations = answered.question.ground_stations
    return next((one.name for one in stations if one.id == action["station_id"]), None)


def line(cells: Iterable[object]) -> str:
    """Return a line of a table, guarding texts that a spreadsheet would execute."""
    written = io.StringIO(newline="")
    safe = (guarded(cell) if isinstance(cell, str) else cell for cell in cells)
    csv.writer(written).writerow(safe)
    return written.getvalue()
