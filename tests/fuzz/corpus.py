"""Files that parsers accept, or nearly: the starting points of mutations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

from service.api.examples import FILES
from tests.fuzz.nasty import CSV, GEO, JSON, TEXT, XML
from tests.fuzz.odd_values import ODD_FILES
from tests.planner_core.orbits.element_sets import LINE_1, LINE_2, PAPER_LINE_1, PAPER_LINE_2

_ROUTES: Final = {
    "elements": "/v1/satellites/import",
    "targets": "/v1/target-catalogs",
    "stations": "/v1/ground-stations/import",
}
_KINDS: Final = {
    ".tle": TEXT,
    ".kvn": TEXT,
    ".txt": TEXT,
    ".csv": CSV,
    ".json": JSON,
    ".geojson": GEO,
    ".xml": XML,
}
_LONGEST: Final = 3000


def seeds(parser: str) -> list[bytes]:
    """Return our own files for a parser."""
    what, _, kind = parser.partition(" ")
    found = [data for _, kinds, data in ODD_FILES if kind in kinds]
    example = FILES.get((_ROUTES[what], kind))
    if example is not None:
        text = example if isinstance(example, str) else json.dumps(example)
        found.append(text.encode())
    if parser == f"elements {TEXT}":
        found += [f"A\n{a}\n{b}\n".encode() for a, b in _TLES] + [_KVN.encode(), _OEM.encode()]
    return found


def shared_seeds(parser: str, folder: Path) -> list[bytes]:
    """Return the beginnings of the shared files that a parser might receive."""
    what, _, kind = parser.partition(" ")
    places = {"elements": ("elements", "omm"), "targets": ("targets",), "stations": ("stations",)}
    return [
        path.read_bytes()[:_LONGEST]
        for place in places[what]
        for path in sorted((folder / place).rglob("*"))
        if _KINDS.get(path.suffix) == kind
    ]


_TLES: Final = ((LINE_1, LINE_2), (PAPER_LINE_1, PAPER_LINE_2))
_OEM: Final = """CCSDS_OEM_VERS = 2.0
META_START
OBJECT_NAME = MADE UP
OBJECT_ID = 2016-001A
CENTER_NAME = EARTH
REF_FRAME = TEME
TIME_SYSTEM = UTC
START_TIME = 2022-08-15T06:00:00
STOP_TIME = 2022-08-15T06:01:00
INTERPOLATION = HERMITE
INTERPOLATION_DEGREE = 3
META_STOP
2022-08-15T06:00:00 7000.0 0.0 0.0 0.0 1.0 7.4
2022-227T06:01:00 6985.0 60.0 444.0 -0.5 1.0 7.4
"""
_KVN: Final = """CCSDS_OMM_VERS = 2.0
OBJECT_NAME = MADE UP
OBJECT_ID = 2016-001A
CENTER_NAME = EARTH
REF_FRAME = TEME
TIME_SYSTEM = UTC
MEAN_ELEMENT_THEORY = SGP4
EPOCH = 2022-08-15T06:00:00
MEAN_MOTION = 14.57 [rev/day]
ECCENTRICITY = 0.0012
INCLINATION = 98.2 [deg]
RA_OF_ASC_NODE = 296.6 [deg]
ARG_OF_PERICENTER = 96.6 [deg]
MEAN_ANOMALY = 263.4 [deg]
NORAD_CAT_ID = 41001
BSTAR = 0.0001
"""
