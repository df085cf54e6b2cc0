"""Every parser of files that the service has, and what must hold for any input.

A parser never raises, and accepts nothing that the planner could stumble over: all accepted data
is finite, within its limits, and can be stored and read again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import astuple
from typing import Any, Final

from planner_core.domain import OrbitEphemeris
from planner_core.errors import Fault
from planner_core.orbits.ingest import Entry, read_elements
from planner_core.orbits.oem import read_oem, tidy_lines
from planner_core.orbits.omm import elements_from_omm
from planner_core.orbits.tle import read_tle
from service.api.ground_stations import read_stations
from service.api.target_catalogs import read_targets
from service.problems.kinds import ServiceError

ELEMENT_TYPES: Final = (
    "text/plain",
    "application/json",
    "text/csv",
    "application/xml",
)
POINT_TYPES: Final = ("text/csv", "application/geo+json", "application/json")

Parser = Callable[[bytes], int]
"""Reads a file, checks what must hold, and returns how many records were accepted."""


def _elements(media_type: str) -> Parser:
    def parse(data: bytes) -> int:
        ingested = read_elements(data, media_type)
        _check_faults(ingested.faults)
        for entry in ingested.entries:
            _check_entry(entry)
        return len(ingested.entries)

    return parse


def _check_entry(entry: Entry) -> None:
    _check_storable(entry.orbit)
    if isinstance(entry.elements, OrbitEphemeris):
        assert tidy_lines(read_oem(entry.orbit["oem"])) == entry.orbit["oem"]
        assert math.isfinite(entry.elements.period_s)
        return
    for value in astuple(entry.elements):
        assert not isinstance(value, float) or math.isfinite(value)
    if "tle" in entry.orbit:
        again = read_tle(entry.orbit["tle"]).elements
        assert astuple(again)[1:] == astuple(entry.elements)[1:]  # the name is stored beside it
    else:
        assert elements_from_omm(json.loads(json.dumps(entry.orbit["omm"]))) == entry.elements
    _check_faults(entry.warnings)


def _targets(media_type: str) -> Parser:
    return _points(lambda data: [one.model_dump() for one in read_targets(media_type, data)[1]])


def _stations(media_type: str) -> Parser:
    def read(data: bytes) -> list[dict[str, Any]]:
        good, faults = read_stations(media_type, data)
        _check_faults(faults)
        return [one.body.model_dump() for one in good]

    return _points(read)


def _points(read: Callable[[bytes], list[dict[str, Any]]]) -> Parser:
    def parse(data: bytes) -> int:
        try:
            bodies = read(data)
        except ServiceError as error:
            _check_faults(error.faults)
            return 0
        for body in bodies:
            _check_storable(body)
            assert -90.0 <= body["lat_deg"] <= 90.0
            assert -180.0 <= body["lon_deg"] <= 360.0
        return len(bodies)

    return parse


def _check_storable(document: object) -> None:
    json.dumps(document, allow_nan=False, ensure_ascii=False).encode()
    assert "\x00" not in json.dumps(document, ensure_ascii=False)  # PostgreSQL cannot store it


def _check_faults(faults: Sequence[Fault]) -> None:
    for fault in faults:
        assert fault.code.isidentifier()
        assert fault.detail
        assert len(fault.detail) < 1000


PARSERS: Final[dict[str, Parser]] = (
    {f"elements {kind}": _elements(kind) for kind in ELEMENT_TYPES}
    | {f"targets {kind}": _targets(kind) for kind in POINT_TYPES}
    | {f"stations {kind}": _stations(kind) for kind in POINT_TYPES[:2]}
)
