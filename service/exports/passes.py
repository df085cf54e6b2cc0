"""Passes as a table (CSV) and as calendar entries (iCalendar)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime

from planner_core.domain import GroundStation
from planner_core.spreadsheets import guarded
from service.answers.answered import in_chunks
from service.exports.calendar import alarm, around, entry, uid
from service.exports.table import line
from service.wire.instants import instant_text
from service.wire.passes import PassOut

COLUMNS = (
    "station_id", "station_name", "satellite_id", "satellite_name", "aos", "tca", "los",
    "duration_s", "max_elevation_deg", "planned", "volume_mbit", "conflicts", "action_ids",
)  # fmt: skip


def write_csv(passes: Iterable[PassOut]) -> Iterator[str]:
    """Yield one row for each pass; names that a spreadsheet would run are guarded."""
    return in_chunks(_lines(passes))


def write_ics(
    passes: Iterable[PassOut], stations: Mapping[str, GroundStation], made_at: datetime
) -> Iterator[str]:
    """Yield a calendar with an entry for each pass.

    Parameters
    ----------
    stations
        By id.
    made_at
        When the plan was made: of two calendars, the newer one counts.
    """
    return in_chunks(_entries(passes, stations, made_at))


def _lines(passes: Iterable[PassOut]) -> Iterator[str]:
    yield line(COLUMNS)
    for one in passes:
        yield line(
            (
                guarded(one.station_id),
                guarded(one.station_name),
                guarded(one.satellite_id),
                guarded(one.satellite_name),
                *map(instant_text, (one.aos, one.tca, one.los)),
                (one.los - one.aos).total_seconds(),
                one.max_elevation_deg,
                "true" if one.planned else "false",
                one.volume_mbit,
                guarded("; ".join(other.satellite_name for other in one.conflicts)),
                "; ".join(one.action_ids),
            )
        )


def _entries(
    passes: Iterable[PassOut], stations: Mapping[str, GroundStation], made_at: datetime
) -> Iterator[str]:
    head, tail = around("Passes")
    yield head
    seen: Counter[str] = Counter()
    for one in passes:
        what = f"{one.satellite_name} over {one.station_name}"
        event = entry(one.aos, one.los, stations[one.station_id], made_at)
        event.add("uid", uid("pass", one.satellite_id, one.station_id, one.tca, seen))
        event.add("summary", what if one.planned else f"{what} (not planned)")
        event.add("description", _description(one))
        event.add("categories", ["Pass"])
        if one.planned:
            event.add_component(alarm(what))
        yield event.to_ical().decode()
    yield tail


def _description(one: PassOut) -> str:
    lines = [
        f"AOS {instant_text(one.aos)}, TCA {instant_text(one.tca)}, LOS {instant_text(one.los)}, "
        f"maximum elevation {one.max_elevation_deg:.1f} deg."
    ]
    if one.volume_mbit is not None:
        lines.append(f"Planned volume: {one.volume_mbit:.0f} Mbit.")
    if one.conflicts:
        lines.append("At the same time: " + ", ".join(o.satellite_name for o in one.conflicts))
    return "\n".join(lines)
