"""Messages that we write, read back by us and by python-sgp4."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sgp4 import omm as reference
from sgp4.api import Satrec

from planner_core.domain import OrbitElements, mean_elements
from planner_core.orbits.ingest import read_elements
from planner_core.orbits.omm_writing import (
    Outgoing,
    write_csv,
    write_json,
    write_kvn,
    write_xml,
)
from planner_core.orbits.sgp4_record import satrec
from tests.planner_core.orbits.element_sets import ELEMENTS, omm_elements

FORMS = [
    (write_json, "application/json"),
    (write_csv, "text/csv"),
    (write_xml, "application/xml"),
    (write_kvn, "text/plain"),
]
CREATED_AT = datetime(2026, 1, 2, 3, 4, 5, 678_000, tzinfo=UTC)
NAMED = replace(ELEMENTS, name='A = "B", <C> & [D]')


def outgoing(*elements: OrbitElements) -> list[Outgoing]:
    return [Outgoing(elements=one, created_at=CREATED_AT) for one in elements]


def without_unknown(elements: OrbitElements) -> OrbitElements:
    """Return the element set without the word that is written for blanks."""
    return replace(
        elements,
        name=None if elements.name == "UNKNOWN" else elements.name,
        object_id=elements.object_id.replace("UNKNOWN", ""),
    )


@pytest.mark.parametrize(("write", "media_type"), FORMS)
@given(elements=omm_elements)
def test_every_element_set_comes_back(
    write: object, media_type: str, elements: OrbitElements
) -> None:
    assert callable(write)
    text = write(outgoing(elements))
    found = read_elements(text.encode(), media_type)
    assert found.faults == ()
    (entry,) = found.entries
    assert without_unknown(mean_elements(entry.elements)) == without_unknown(elements)


@pytest.mark.parametrize(("write", "media_type"), FORMS)
def test_a_file_holds_many(write: object, media_type: str) -> None:
    assert callable(write)
    others = [replace(NAMED, norad_cat_id=n) for n in (7, 123_456_789)]
    found = read_elements(write(outgoing(NAMED, *others)).encode(), media_type)
    assert [entry.elements for entry in found.entries] == [NAMED, *others]


def same_orbit(fields: dict[str, str]) -> bool:
    """Return whether python-sgp4 reads these keywords into the same record as we do."""
    theirs, ours = Satrec(), satrec(NAMED)
    reference.initialize(theirs, fields)
    at = (2459807.5, 0.75)
    return bool(theirs.sgp4(*at) == ours.sgp4(*at))


def test_another_reader_takes_the_xml() -> None:
    (fields,) = reference.parse_xml(io.StringIO(write_xml(outgoing(NAMED))))
    assert fields["OBJECT_NAME"] == NAMED.name
    assert fields["MEAN_ELEMENT_THEORY"] == "SGP4"
    assert same_orbit(fields)


def test_another_reader_takes_csv_and_json() -> None:
    (row,) = reference.parse_csv(io.StringIO(write_csv(outgoing(NAMED))))
    assert row["OBJECT_NAME"] == NAMED.name
    assert same_orbit(row)
    (message,) = json.loads(write_json(outgoing(NAMED)))
    assert same_orbit(message)


def test_kvn_is_of_the_standard() -> None:
    lines = write_kvn(outgoing(NAMED)).splitlines()
    fields = dict(line.split(" = ", 1) for line in lines)
    assert lines[0] == "CCSDS_OMM_VERS = 2.0"
    assert list(fields)[1:9] == [
        "CREATION_DATE", "ORIGINATOR", "OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME",
        "TIME_SYSTEM", "MEAN_ELEMENT_THEORY",
    ]  # fmt: skip
    assert fields["CREATION_DATE"] == "2026-01-02T03:04:05"
    assert same_orbit(fields)


@given(st.sampled_from(FORMS))
def test_of_no_satellites_there_is_a_file_without_any(form: tuple[object, str]) -> None:
    write, media_type = form
    assert callable(write)
    assert read_elements(write([]).encode(), media_type).entries == ()
