"""CZML 1.0, for Cesium: satellites on their orbits, targets by outcome, contacts in progress.

Positions are Earth-fixed nodes of the planner's own ephemeris, a minute apart. Between nodes,
Lagrange polynomials of the fifth degree are accurate to a metre.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import groupby
from operator import itemgetter
from typing import Any, Final

import numpy as np

from planner_core.domain import GroundStation, Horizon, Satellite, Target
from planner_core.orbits.ephemeris import propagate
from service.answers.answered import Answered, Document, chunked, compact, listed
from service.wire.instants import instant_text

_DEGREE: Final = 5
_SPEED: Final = 60
_TRAIL_S: Final = 2700.0

_WHITE: Final = (255, 255, 255, 255)
_STATION: Final = (80, 180, 255, 255)
_OUTCOMES: Final = {
    "downlinked": (46, 204, 113, 255),
    "collected": (241, 196, 15, 255),
    "unscheduled": (231, 76, 60, 255),
    "excluded": (127, 140, 141, 255),
}
# Distinct hues, after Paul Tol's muted scheme.
_TRACKS: Final = (
    (136, 204, 238), (204, 102, 119), (221, 204, 119), (68, 170, 153), (170, 68, 153),
    (153, 153, 51), (102, 153, 204), (136, 34, 85),
)  # fmt: skip


@chunked
def write(answered: Answered) -> Iterator[str]:
    """Yield an array of packets, the document packet first."""
    yield "[\n"
    yield from listed(compact(packet) for packet in _packets(answered))
    yield "\n]\n"


def _packets(answered: Answered) -> Iterator[Document]:
    question = answered.question
    yield _document(answered)
    for number, satellite in enumerate(question.satellites):
        yield _satellite(satellite, question.horizon, _TRACKS[number % len(_TRACKS)])
    for station in question.ground_stations:
        yield _station(station)
    names = {satellite["id"]: satellite["name"] for satellite in answered.satellites}
    for target, told in zip(question.each_target(), answered.each_target(), strict=True):
        yield _target(target, told, names)
    for number, about in enumerate(answered.satellites):
        contacts = [a for a in answered.actions_of(number) if a["mode"] == "contact"]
        yield from _contacts(about, contacts, question.ground_stations)


def _document(answered: Answered) -> Document:
    horizon = answered.question.horizon
    return {
        "id": "document",
        "name": f"Timeline of job {answered.head['job']}",
        "version": "1.0",
        "clock": {
            "interval": _interval(instant_text(horizon.start), instant_text(horizon.end)),
            "currentTime": instant_text(horizon.start),
            "multiplier": _SPEED,
            "range": "LOOP_STOP",
            "step": "SYSTEM_CLOCK_MULTIPLIER",
        },
    }


def _satellite(satellite: Satellite, horizon: Horizon, color: tuple[int, int, int]) -> Document:
    path = propagate(satellite, horizon)
    samples = np.column_stack([path.node_s.round(3), path.position_itrf_m.round(1)])
    start = instant_text(horizon.start)
    return {
        "id": f"satellite/{satellite.id}",
        "name": satellite.name,
        "availability": _interval(start, instant_text(horizon.end)),
        "position": {
            "epoch": start,
            "cartesian": samples.ravel().tolist(),
            "referenceFrame": "FIXED",
            "interpolationAlgorithm": "LAGRANGE",
            "interpolationDegree": _DEGREE,
        },
        "point": {"color": {"rgba": [*color, 255]}, "pixelSize": 9},
        "label": _label(satellite.name),
        "path": {
            "material": {"solidColor": {"color": {"rgba": [*color, 180]}}},
            "width": 1.5,
            "leadTime": 0,
            "trailTime": _TRAIL_S,
            "resolution": 60,
        },
    }


def _station(station: GroundStation) -> Document:
    return {
        "id": f"station/{station.id}",
        "name": station.name,
        "position": _at(station.lon_deg, station.lat_deg, station.alt_m),
        "point": {"color": {"rgba": list(_STATION)}, "pixelSize": 8},
        "label": _label(station.name),
    }


def _target(target: Target, told: Document, names: dict[str, str]) -> Document:
    reason = told["reason"]
    properties = {
        "outcome": told["outcome"],
        "reason": reason and reason["code"],
        "action_id": told["action_id"],
        "satellite_id": told["satellite_id"],
        "satellite_name": names.get(told["satellite_id"]),
    }
    return {
        "id": f"target/{target.id}",
        "name": target.name or target.id,
        "position": _at(target.lon_deg, target.lat_deg, target.alt_m),
        "point": {"color": {"rgba": list(_OUTCOMES[told["outcome"]])}, "pixelSize": 5},
        "properties": {name: value for name, value in properties.items() if value is not None},
    }


def _contacts(
    satellite: Document, contacts: list[Document], stations: Iterable[GroundStation]
) -> Iterator[Document]:
    """Yield a line to each station that the satellite contacts, shown during its contacts."""
    names = {station.id: station.name for station in stations}
    contacts.sort(key=itemgetter("station_id", "start"))
    for station_id, actions in groupby(contacts, key=itemgetter("station_id")):
        yield {
            "id": f"contact/{satellite['id']}/{station_id}",
            "name": f"{satellite['name']} over {names[station_id]}",
            "availability": [_interval(a["start"], a["end"]) for a in actions],
            "polyline": {
                "positions": {
                    "references": [
                        _reference(f"satellite/{satellite['id']}"),
                        _reference(f"station/{station_id}"),
                    ]
                },
                "arcType": "NONE",
                "width": 2,
                "material": {"solidColor": {"color": {"rgba": list(_STATION)}}},
            },
        }


def _reference(packet_id: str) -> str:
    r"""Return the reference to the position of another packet.

    >>> print(_reference("station/a#1.b"))
    station/a\#1\.b#position
    """
    return re.sub(r"([\\#.])", r"\\\1", packet_id) + "#position"


def _interval(start: str, end: str) -> str:
    return f"{start}/{end}"


def _at(lon_deg: float, lat_deg: float, alt_m: float) -> Document:
    return {"cartographicDegrees": [lon_deg, lat_deg, alt_m]}


def _label(text: str) -> dict[str, Any]:
    return {
        "text": text,
        "font": "12px sans-serif",
        "fillColor": {"rgba": list(_WHITE)},
        "horizontalOrigin": "LEFT",
        "pixelOffset": {"cartesian2": [10, 0]},
    }
