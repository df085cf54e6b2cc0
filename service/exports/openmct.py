"""The plan file of Open MCT: a group for each satellite and mode, instants in milliseconds.

The form is that of its plan plugin: an object of groups, each a list of activities with name,
start, end, type, color and textColor. An ``id`` lets Open MCT keep an activity's status.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Final

from service.exports.answered import Answered, Document, compact, in_chunks, listed

_MODES: Final = {
    "collect": ("collects", "#1b7f4b", "#ffffff"),
    "contact": ("contacts", "#1f5fa8", "#ffffff"),
    "sunpoint": ("sun-pointing", "#f2c14e", "#000000"),
}
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_MILLISECOND: Final = timedelta(milliseconds=1)


def write(answered: Answered) -> Iterator[str]:
    """Yield the plan; groups that would be empty are left out."""
    return in_chunks(_parts(answered))


def _parts(answered: Answered) -> Iterator[str]:
    stations = {station.id: station.name for station in answered.scenario.ground_stations}
    names = Counter(satellite["name"] for satellite in answered.timeline["satellites"])
    yield "{\n"
    yield from listed(_groups(answered.timeline["satellites"], names, stations))
    yield "\n}\n"


def _groups(
    satellites: Iterable[Document], names: Counter[str], stations: dict[str, str]
) -> Iterator[str]:
    for satellite in satellites:
        # Group names are keys: two satellites of one name are told apart by their ids.
        is_unique = names[satellite["name"]] == 1
        title = satellite["name"] if is_unique else f"{satellite['name']} ({satellite['id']})"
        for mode, (words, color, text_color) in _MODES.items():
            group = f"{title}: {words}"
            activities = [
                {
                    "id": f"{satellite['id']}/{action['id']}",
                    "name": _name(action, stations),
                    "start": _milliseconds(action["start"]),
                    "end": _milliseconds(action["end"]),
                    "type": group,
                    "color": color,
                    "textColor": text_color,
                }
                for action in satellite["actions"]
                if action["mode"] == mode
            ]
            if activities:
                yield f"{compact(group)}:{compact(activities)}"


def _name(action: Document, stations: dict[str, str]) -> str:
    if action["mode"] == "sunpoint":
        return "sun"
    return str(action["target_id"] or stations[action["station_id"]])


def _milliseconds(instant: str) -> int:
    return (datetime.fromisoformat(instant) - _EPOCH) // _MILLISECOND
