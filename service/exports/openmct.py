"""The plan file of Open MCT: a group for each satellite and mode, instants in milliseconds.

The format is that of its plan plugin: an object of groups, each a list of activities with name,
start, end, type, color and textColor. An ``id`` lets Open MCT keep an activity's status.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Final

from service.answers.answered import Answered, Document, chunked, compact

_MODES: Final = {
    "collect": ("collects", "#1b7f4b", "#ffffff"),
    "contact": ("contacts", "#1f5fa8", "#ffffff"),
    "sunpoint": ("sun-pointing", "#f2c14e", "#000000"),
    "hold": ("holding", "#b9c0c6", "#000000"),
}
_IDLE_NAMES: Final = {"sunpoint": "sun", "hold": "hold"}
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_MILLISECOND: Final = timedelta(milliseconds=1)


@chunked
def write(answered: Answered) -> Iterator[str]:
    """Yield the plan without empty groups."""
    stations = {station.id: station.name for station in answered.question.ground_stations}
    names = Counter(satellite["name"] for satellite in answered.satellites)
    yield "{\n"
    separator = ""
    for number, satellite in enumerate(answered.satellites):
        # Group names are keys: satellites with the same name are distinguished by id.
        is_unique = names[satellite["name"]] == 1
        title = satellite["name"] if is_unique else f"{satellite['name']} ({satellite['id']})"
        # Actions are read once per mode: a group must be complete before the next one begins.
        for mode, (words, color, text_color) in _MODES.items():
            group = f"{title}: {words}"
            before = f"{separator}{compact(group)}:["
            for action in answered.actions_of(number):
                if action["mode"] != mode:
                    continue
                activity = {
                    "id": f"{satellite['id']}/{action['id']}",
                    "name": _name(action, stations),
                    "start": _milliseconds(action["start"]),
                    "end": _milliseconds(action["end"]),
                    "type": group,
                    "color": color,
                    "textColor": text_color,
                }
                yield before + compact(activity)
                before = ","
            if before == ",":
                yield "]"
                separator = ",\n"
    yield "\n}\n"


def _name(action: Document, stations: dict[str, str]) -> str:
    if action["mode"] in _IDLE_NAMES:
        return _IDLE_NAMES[action["mode"]]
    return str(action.get("target_name") or action["target_id"] or stations[action["station_id"]])


def _milliseconds(instant: str) -> int:
    return (datetime.fromisoformat(instant) - _EPOCH) // _MILLISECOND
