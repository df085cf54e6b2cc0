"""Passes as a table (CSV) and as calendar entries (iCalendar)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime

from planner_core.domain import GroundStation
from service.answers.answered import chunked
from service.exports.calendar import alarm, around, entry, uid
from service.exports.table import line
from service.wire.base import dumped
from service.wire.instants import instant_text
from service.wire.passes import PassOut

COLUMNS = (
    "station_id", "station_name", "satellite_id", "satellite_name", "aos", "tca", "los",
    "duration_s", "max_elevation_deg", "planned", "volume_mbit", "conflicts", "action_ids",
)  # fmt: skip


@chunked
def write_csv(passes: Iterable[PassOut]) -> Iterator[str]:
    """Yield one row per pass."""
    yield line(COLUMNS)
    for one in passes:
        told = dumped(one) | {
            "duration_s": (one.los - one.aos).total_seconds(),
            "planned": "true" if one.planned else "false",
            "conflicts": "; ".join(other.satellite_name for other in one.conflicts),
            "action_ids": "; ".join(one.action_ids),
        }
        yield line(told[name] for name in COLUMNS)


@chunked
def write_ics(
    passes: Iterable[PassOut], stations: Mapping[str, GroundStation], made_at: datetime
) -> Iterator[str]:
    """Yield a calendar with an entry per pass.

    Parameters
    ----------
    stations
        By id.
    made_at
        When the plan was made: of two calendars, the newer counts.
    """
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
