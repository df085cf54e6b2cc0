"""iCalendar (RFC 5545): the contacts, each with an alarm ten minutes before.

A contact keeps its UID from plan to plan, so that a calendar moves an entry instead of adding
one: the UID is made of satellite, station and the half hour of UTC that contains the middle of
the pass. A satellite in low orbit returns to a station after more than an hour, and newer
elements move a pass by seconds. SEQUENCE and DTSTAMP say when the plan was made: the newer counts.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Final
from uuid import NAMESPACE_URL, uuid5

from icalendar import Alarm, Calendar, Event

import planner_core
from planner_core.domain import GroundStation
from service.answers.answered import Answered, Document, chunked

ALARM: Final = timedelta(minutes=10)

_HALF_HOUR: Final = timedelta(minutes=30)
_SECOND: Final = timedelta(seconds=1)
_EPOCH: Final = datetime(2020, 1, 1, tzinfo=UTC)


@chunked
def write(answered: Answered) -> Iterator[str]:
    """Yield the calendar of all contacts."""
    head, tail = around("Contacts")
    yield head
    stations = {station.id: station for station in answered.question.ground_stations}
    seen: Counter[str] = Counter()
    for satellite, action in answered.each_action():
        if action["mode"] == "contact":
            event = _event(answered, satellite, action, stations[action["station_id"]], seen)
            yield event.to_ical().decode()
    yield tail


def around(name: str) -> tuple[str, str]:
    """Return the text before and after the events of a calendar with this name."""
    calendar = Calendar()
    calendar.add("prodid", f"-//Slewline//{planner_core.__version__}//EN")
    calendar.add("version", "2.0")
    calendar.add("method", "PUBLISH")
    calendar.add("name", name)
    calendar.add("x-wr-calname", name)  # for calendars that do not know NAME
    head, end, rest = calendar.to_ical().decode().partition("END:VCALENDAR")
    return head, end + rest


def _event(
    answered: Answered,
    satellite: Document,
    action: Document,
    station: GroundStation,
    seen: Counter[str],
) -> Event:
    start, end = (datetime.fromisoformat(action[name]) for name in ("start", "end"))
    what = f"{satellite['name']} over {station.name}"
    event = entry(start, end, station, answered.finished_at)
    event.add("uid", uid("contact", satellite["id"], station.id, start + (end - start) / 2, seen))
    event.add("summary", what)
    event.add("description", _description(answered.head, action))
    event.add("categories", ["Contact"])
    event.add_component(alarm(what))
    return event


def entry(start: datetime, end: datetime, station: GroundStation, made_at: datetime) -> Event:
    """Return an event at a station, for a plan made at an instant."""
    event = Event()
    event.add("sequence", (made_at - _EPOCH) // _SECOND)
    event.add("dtstamp", made_at.replace(microsecond=0))
    # Calendars have whole seconds: the entry covers the whole contact or pass.
    event.add("dtstart", start.replace(microsecond=0))
    event.add("dtend", end.replace(microsecond=0) + _SECOND * (end.microsecond > 0))
    event.add("location", station.name)
    east_deg = station.lon_deg - 360.0 if station.lon_deg > 180.0 else station.lon_deg
    event.add("geo", (round(station.lat_deg, 6), round(east_deg, 6)))
    return event


def alarm(what: str) -> Alarm:
    """Return the alarm before an event."""
    found = Alarm()
    found.add("action", "DISPLAY")
    found.add("trigger", -ALARM)
    found.add("description", what)
    return found


def uid(kind: str, satellite_id: str, station_id: str, middle: datetime, seen: Counter[str]) -> str:
    """Return the id that identifies an entry to a calendar from plan to plan."""
    # A mask may cut a pass into parts, which are separate contacts.
    key = json.dumps([satellite_id, station_id, (middle - _EPOCH) // _HALF_HOUR])
    part = seen[key]
    seen[key] += 1
    return str(uuid5(NAMESPACE_URL, f"slewline:{kind}:{key}:{part}"))


def _description(head: Document, action: Document) -> str:
    return (
        f"{action['start']} to {action['end']}, azimuth {action['azimuth_deg']:.0f} deg at the "
        f"middle.\nAction {action['id']} of job {head['job']}."
    )
