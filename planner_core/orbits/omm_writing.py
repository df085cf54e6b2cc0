"""Orbit Mean-Elements Messages written as JSON, CSV, XML and KVN, for one element set or many.

JSON and CSV are as CelesTrak serves them. XML (an ``ndm`` of ``omm`` messages) and KVN are the
standard's own forms (CCSDS 502.0, version 2.0, which readers of 3.0 accept too). `omm_files`
reads all of them back to the same element sets.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from planner_core.domain import OrbitElements
from planner_core.orbits.omm import omm_from_elements
from planner_core.spreadsheets import guarded

VERSION: Final = "2.0"
ORIGINATOR: Final = "SLEWLINE"

_METADATA: Final = {
    "CENTER_NAME": "EARTH",
    "REF_FRAME": "TEME",
    "TIME_SYSTEM": "UTC",
    "MEAN_ELEMENT_THEORY": "SGP4",
}
_MEAN_ELEMENTS: Final = (
    "EPOCH", "MEAN_MOTION", "ECCENTRICITY", "INCLINATION", "RA_OF_ASC_NODE",
    "ARG_OF_PERICENTER", "MEAN_ANOMALY",
)  # fmt: skip
_TLE_PARAMETERS: Final = (
    "EPHEMERIS_TYPE", "CLASSIFICATION_TYPE", "NORAD_CAT_ID", "ELEMENT_SET_NO", "REV_AT_EPOCH",
    "BSTAR", "MEAN_MOTION_DOT", "MEAN_MOTION_DDOT",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Outgoing:
    """An element set to write, and when it was stored (aware)."""

    elements: OrbitElements
    created_at: datetime


def write_json(messages: Sequence[Outgoing]) -> str:
    """Return an array of messages."""
    return json.dumps([omm_from_elements(m.elements) for m in messages], indent=1) + "\n"


def write_csv(messages: Sequence[Outgoing]) -> str:
    """Return a table of messages, empty for none; names that look like formulas are guarded."""
    rows = [
        {key: guarded(v) if isinstance(v, str) else v for key, v in fields.items()}
        for fields in (omm_from_elements(message.elements) for message in messages)
    ]
    text = io.StringIO(newline="")
    if rows:
        table = csv.DictWriter(text, rows[0])
        table.writeheader()
        table.writerows(rows)
    return text.getvalue()


def write_kvn(messages: Sequence[Outgoing]) -> str:
    """Return messages of ``KEYWORD = value`` lines, one after the other."""
    return "\n".join(
        "".join(f"{key} = {value}\n" for key, value in _lines(message)) for message in messages
    )


def _lines(message: Outgoing) -> Iterator[tuple[str, object]]:
    fields = omm_from_elements(message.elements)
    yield "CCSDS_OMM_VERS", VERSION
    yield from _header(message)
    yield from _metadata(fields)
    for key in (*_MEAN_ELEMENTS, *_TLE_PARAMETERS):
        yield key, fields[key]


def write_xml(messages: Sequence[Outgoing]) -> str:
    """Return one ``ndm`` document."""
    root = Element("ndm")
    for message in messages:
        fields = omm_from_elements(message.elements)
        omm = SubElement(root, "omm", id="CCSDS_OMM_VERS", version=VERSION)
        _add(SubElement(omm, "header"), _header(message))
        segment = SubElement(SubElement(omm, "body"), "segment")
        _add(SubElement(segment, "metadata"), _metadata(fields))
        data = SubElement(segment, "data")
        _add(SubElement(data, "meanElements"), ((key, fields[key]) for key in _MEAN_ELEMENTS))
        _add(SubElement(data, "tleParameters"), ((key, fields[key]) for key in _TLE_PARAMETERS))
    indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, encoding="unicode")}\n'


def _add(parent: Element, fields: Iterator[tuple[str, object]]) -> None:
    for key, value in fields:
        SubElement(parent, key).text = str(value)


def _header(message: Outgoing) -> Iterator[tuple[str, object]]:
    at = message.created_at.astimezone(UTC).replace(tzinfo=None)
    yield "CREATION_DATE", at.isoformat(timespec="seconds")
    yield "ORIGINATOR", ORIGINATOR


def _metadata(fields: dict[str, object]) -> Iterator[tuple[str, object]]:
    # The standard requires a value even if nothing is known.
    for key in ("OBJECT_NAME", "OBJECT_ID"):
        yield key, fields[key] or "UNKNOWN"
    yield from _METADATA.items()
