"""Files of element sets in any form we take: which form it is, and what stands in it.

Codes of a file that cannot be read as a whole: ``unsupported_media_type``, ``empty_file``,
``not_utf8``, ``not_json``, ``not_csv``, ``not_xml``, ``xml_forbidden``, ``no_elements``,
``too_many_rows``.
Codes of single sets: those of `tle.parse_tle` and `omm.elements_from_omm`, and
``tle_name``, ``csv_columns``, ``omm_syntax``, ``omm_unknown_keyword``, ``omm_duplicate_key``,
``omm_unit``, ``unsupported_message``, ``duplicate_element_set``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from planner_core.domain import OrbitElements
from planner_core.errors import Fault, InvalidElements
from planner_core.orbits.element_ranges import epoch_key
from planner_core.orbits.omm import elements_from_omm, omm_from_elements
from planner_core.orbits.omm_files import (
    Message,
    Read,
    read_csv,
    read_json,
    read_kvn,
    read_xml,
)
from planner_core.orbits.tle_file import read_tle_text

_TEXT_FORMS: dict[str, Callable[[str], Read]] = {
    "application/json": read_json,
    "text/csv": read_csv,
}
_XML_TYPES = ("application/xml", "text/xml")
_KVN_START = re.compile(r"(CCSDS_[A-Z_]+|[A-Z][A-Z0-9_]*)[ \t]*=|COMMENT[ \t\n]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One element set that was accepted.

    Attributes
    ----------
    orbit
        ``{"tle": [line1, line2]}`` with tidy lines, or ``{"omm": {...}}``.
    row
        Line of the file where the set starts (line 1 of a TLE), or None for JSON and XML.
    warnings
        What was put right on the way in.
    """

    elements: OrbitElements
    orbit: dict[str, Any]
    row: int | None = None
    warnings: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Ingested:
    """What a file held: the sets accepted, in order, and everything that was refused."""

    entries: tuple[Entry, ...] = ()
    faults: tuple[Fault, ...] = ()


def read_elements(data: bytes, media_type: str) -> Ingested:
    """Return the element sets of a file; nothing in it can make this raise.

    Of two sets for the same satellite and epoch the first is kept and the second is a fault.

    Parameters
    ----------
    data
        The file; text is UTF-8, with or without a byte order mark, lines end in LF, CRLF or CR.
    media_type
        ``text/plain`` (TLE, 2LE, 3LE, or OMM KVN: the content decides), ``application/json``,
        ``text/csv``, ``application/xml`` or ``text/xml``; parameters are ignored.
    """
    kind = media_type.partition(";")[0].strip().lower()
    if kind not in (*_TEXT_FORMS, *_XML_TYPES, "text/plain"):
        return _refuse("unsupported_media_type", f"Cannot read {kind[:80]!a}")
    if not data.strip(b" \t\r\n\xef\xbb\xbf"):
        return _refuse("empty_file", "The file is empty")
    if kind in _XML_TYPES:
        return _from_messages(read_xml(data))
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        return _refuse("not_utf8", f"The file is not UTF-8: byte {error.start} does not fit")
    if kind in _TEXT_FORMS:
        return _from_messages(_TEXT_FORMS[kind](text))
    return _from_messages(read_kvn(text)) if _is_kvn(text) else _from_tle(text)


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
