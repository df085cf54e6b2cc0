"""Orbit files in any supported format: detecting the format, and reading the contents.

Codes of a file that cannot be read at all: ``unsupported_media_type``, ``empty_file``,
``not_utf8``, ``not_json``, ``not_csv``, ``not_xml``, ``xml_forbidden``, ``no_elements``,
``too_many_rows``.
Codes of single sets: those of `tle.parse_tle`, `omm.elements_from_omm` and `oem`, and
``tle_name``, ``csv_columns``, ``omm_syntax``, ``omm_unknown_keyword``, ``omm_duplicate_key``,
``omm_unit``, ``unsupported_message``, ``duplicate_element_set``.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any
from xml.etree.ElementTree import Element

from planner_core.domain import Orbit, OrbitEphemeris
from planner_core.errors import Fault, InvalidElements
from planner_core.orbits.element_ranges import epoch_key
from planner_core.orbits.oem import (
    MOST_LINES,
    ephemeris_of,
    kvn_segments,
    tidy_lines,
)
from planner_core.orbits.oem_xml import xml_segments
from planner_core.orbits.omm import elements_from_omm, omm_from_elements
from planner_core.orbits.omm_files import (
    Lines,
    Message,
    Read,
    kvn_messages,
    read_csv,
    read_json,
    read_kvn,
    read_xml,
    tag_of,
    xml_messages,
)
from planner_core.orbits.tle_file import read_tle_text

_TEXT_FORMS: dict[str, Callable[[str], Read]] = {
    "application/json": read_json,
    "text/csv": read_csv,
}
_XML_TYPES = ("application/xml", "text/xml")
_OEM = "CCSDS_OEM_VERS"
_OEM_START = re.compile(rf"^\s*{_OEM}", re.MULTILINE)
_HEAD = 4096  # characters within which a message says what it is, leading comments included
_KVN_START = re.compile(r"(CCSDS_[A-Z_]+|[A-Z][A-Z0-9_]*)[ \t]*=|COMMENT[ \t\n]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One element set or ephemeris that was accepted.

    Attributes
    ----------
    orbit
        ``{"tle": [line1, line2]}`` with tidy lines, ``{"omm": {...}}``, or
        ``{"oem": [lines of KVN]}``.
    row
        Line of the file where the set starts (line 1 of a TLE), or None for JSON and XML.
    warnings
        What was corrected on reading.
    """

    elements: Orbit
    orbit: dict[str, Any]
    row: int | None = None
    warnings: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Ingested:
    """The sets of a file that were accepted, in order, and faults of all that was refused."""

    entries: tuple[Entry, ...] = ()
    faults: tuple[Fault, ...] = ()


def read_elements(data: bytes, media_type: str) -> Ingested:
    """Return the element sets of a file; never raises, whatever the file contains.

    Of two sets for the same satellite and epoch the first is kept, and the second is a fault.

    Parameters
    ----------
    data
        The file; text is UTF-8, with or without a byte order mark, lines end in LF, CRLF or CR.
    media_type
        ``text/plain`` (TLE, 2LE, 3LE, or KVN of OMM or OEM: the content decides),
        ``application/json``, ``text/csv``, ``application/xml`` or ``text/xml``; parameters are
        ignored.
    """
    kind = media_type.partition(";")[0].strip().lower()
    if kind not in (*_TEXT_FORMS, *_XML_TYPES, "text/plain"):
        return _refuse("unsupported_media_type", f"Cannot read {kind[:80]!a}")
    if not data.strip(b" \t\r\n\xef\xbb\xbf"):
        return _refuse("empty_file", "The file is empty")
    if kind in _XML_TYPES:
        elements = xml_messages(data)
        if isinstance(elements, Fault):
            return Ingested(faults=(elements,))
        if elements and tag_of(elements[0]) == "oem":
            return _from_ephemerides(map(_read_oem_element, enumerate(elements)))
        return _from_messages(read_xml(elements))
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        return _refuse("not_utf8", f"The file is not UTF-8: byte {error.start} is invalid")
    if kind in _TEXT_FORMS:
        return _from_messages(_TEXT_FORMS[kind](text))
    if not _is_kvn(text):
        return _from_tle(text)
    if _OEM_START.search(text[:_HEAD]) is not None:
        return _from_ephemerides(map(_read_oem_lines, kvn_messages(io.StringIO(text), MOST_LINES)))
    return _from_messages(read_kvn(text))


def _refuse(code: str, detail: str) -> Ingested:
    return Ingested(faults=(Fault(code, detail),))


def _is_kvn(text: str) -> bool:
    return _KVN_START.match(text.lstrip()) is not None


def _from_tle(text: str) -> Ingested:
    records, faults = read_tle_text(text)
    entries = [
        Entry(
            elements=record.reading.elements,
            orbit={"tle": list(record.reading.lines)},
            row=record.row,
            warnings=record.reading.warnings,
        )
        for record in records
    ]
    return _without_duplicates([(entry, f"row {entry.row}", None) for entry in entries], faults)


def _read_oem_lines(lines: Lines) -> tuple[OrbitEphemeris | Fault, str, int | None]:
    row = lines[0][0]
    try:
        if not lines[0][1].startswith(_OEM):
            detail = f"Expected an OEM, got a message that starts with {lines[0][1][:40]!a}"
            raise InvalidElements("unsupported_message", detail, row=row)
        return ephemeris_of(kvn_segments(lines)), f"row {row}", row
    except InvalidElements as error:
        return replace(error.fault, pointer=None, row=error.fault.row or row), f"row {row}", row


def _read_oem_element(at: tuple[int, Element]) -> tuple[OrbitEphemeris | Fault, str, None]:
    pointer = f"/{at[0]}"
    try:
        if tag_of(at[1]) != "oem":
            detail = f"Expected an oem message, got {tag_of(at[1])[:40]!a}"
            raise InvalidElements("unsupported_message", detail)
        return ephemeris_of(xml_segments(at[1])), f"entry {pointer}", None
    except InvalidElements as error:
        return replace(error.fault, pointer=pointer, row=None), f"entry {pointer}", None


def _from_ephemerides(
    read: Iterable[tuple[OrbitEphemeris | Fault, str, int | None]],
) -> Ingested:
    placed: list[tuple[Entry, str, str | None]] = []
    faults = []
    for orbit, place, row in read:
        if isinstance(orbit, Fault):
            faults.append(orbit)
        else:
            entry = Entry(elements=orbit, orbit={"oem": tidy_lines(orbit)}, row=row)
            placed.append((entry, place, None if row is not None else place.removeprefix("entry ")))
    return _without_duplicates(placed, faults)


def _from_messages(read: Read) -> Ingested:
    messages, faults = read
    if not messages and not faults:
        return _refuse("no_elements", "The file holds no element set")
    placed = []
    for message in messages:
        try:
            elements = elements_from_omm(message.fields)
        except InvalidElements as error:
            faults.append(_at_message(error.fault, message))
            continue
        orbit = {"omm": omm_from_elements(elements)}
        place = f"row {message.row}" if message.row is not None else f"entry {message.pointer}"
        entry = Entry(elements=elements, orbit=orbit, row=message.row)
        placed.append((entry, place, message.pointer))
    return _without_duplicates(placed, faults)


def _at_message(fault: Fault, message: Message) -> Fault:
    key = (fault.pointer or "").removeprefix("/omm/")
    pointer = None if message.pointer is None else f"{message.pointer}/{key}"
    return replace(fault, pointer=pointer, row=message.rows.get(key, message.row))


def _without_duplicates(
    placed: list[tuple[Entry, str, str | None]], faults: list[Fault]
) -> Ingested:
    kept: dict[object, str] = {}
    entries = []
    for entry, place, pointer in placed:
        key = epoch_key(entry.elements)
        if key not in kept:
            kept[key] = place
            entries.append(entry)
            continue
        detail = (
            f"{place[0].upper()}{place[1:]} repeats satellite {key[0]} at the epoch of "
            f"{kept[key]}; the first is kept"
        )
        faults.append(Fault("duplicate_element_set", detail, pointer=pointer, row=entry.row))
    in_order = sorted(faults, key=lambda fault: math.inf if fault.row is None else fault.row)
    return Ingested(entries=tuple(entries), faults=tuple(in_order))
