"""Files of Orbit Mean-Elements Messages (JSON, CSV, XML and KVN), read into plain mappings.

JSON and CSV come from catalogues that add their own columns, so unknown keywords are
ignored there. XML and KVN are the standard's own forms: an unknown keyword is refused, and
the metadata that say what the elements mean must be present in each message.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from planner_core.errors import Fault
from planner_core.orbits.element_ranges import MOST_SETS, too_many_sets
from planner_core.orbits.omm import REQUIRED_KEYS
from planner_core.spreadsheets import unguarded

_METADATA = (
    "OBJECT_NAME",
    "OBJECT_ID",
    "CENTER_NAME",
    "REF_FRAME",
    "TIME_SYSTEM",
    "MEAN_ELEMENT_THEORY",
)
_MUST_STAND = ("CCSDS_OMM_VERS", "CENTER_NAME", "REF_FRAME", "TIME_SYSTEM", "MEAN_ELEMENT_THEORY")
_UNITS = {
    "SEMI_MAJOR_AXIS": "km",
    "MEAN_MOTION": "rev/day",
    "ECCENTRICITY": "n/a",
    "INCLINATION": "deg",
    "RA_OF_ASC_NODE": "deg",
    "ARG_OF_PERICENTER": "deg",
    "MEAN_ANOMALY": "deg",
    "GM": "km**3/s**2",
    "MASS": "kg",
    "SOLAR_RAD_AREA": "m**2",
    "SOLAR_RAD_COEFF": "n/a",
    "DRAG_AREA": "m**2",
    "DRAG_COEFF": "n/a",
    "BSTAR": "1/er",
    "BTERM": "m**2/kg",
    "MEAN_MOTION_DOT": "rev/day**2",
    "MEAN_MOTION_DDOT": "rev/day**3",
    "AGOM": "m**2/kg",
}
_KEYWORDS = frozenset(_UNITS).union(
    _METADATA,
    ("CCSDS_OMM_VERS", "COMMENT", "CLASSIFICATION", "CREATION_DATE", "ORIGINATOR", "MESSAGE_ID"),
    ("REF_FRAME_EPOCH", "EPOCH", "EPHEMERIS_TYPE", "CLASSIFICATION_TYPE", "NORAD_CAT_ID"),
    ("ELEMENT_SET_NO", "REV_AT_EPOCH", "COV_REF_FRAME"),
)
_COVARIANCE = re.compile(r"C[XYZ](_DOT)?_[XYZ](_DOT)?")
_XML_GROUPS = frozenset(
    ("header", "body", "segment", "metadata", "data", "meanElements", "tleParameters")
).union(("spacecraftParameters", "covarianceMatrix", "userDefinedParameters"))
_MOST_LINES = 1000
_DEEPEST = 50
_MOST_ELEMENTS = 30 * MOST_SETS
_MOST_ATTRIBUTES = 15 * MOST_SETS
_ATTRIBUTES = ("version", "units", "parameter")
_PIECE_BYTES = 65_536
_MOST_QUIET_PIECES = 3  # a parser may wait for two pieces or more before it goes on
_NDM_TEXTS = frozenset(("COMMENT", "MESSAGE_ID"))
_LONGEST_SHOWN = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """One message of a file.

    Attributes
    ----------
    fields
        Keywords and values.
    pointer
        JSON pointer to the message (for XML: its index among the messages), or None.
    row, rows
        Line where the message starts, and the line of each keyword, if the format has lines.
    """

    fields: Mapping[str, object]
    pointer: str | None = None
    row: int | None = None
    rows: Mapping[str, int] = field(default_factory=dict)


Read = tuple[list[Message], list[Fault]]
Lines = list[tuple[int, str]]


def read_json(text: str) -> Read:
    """Return the messages of one JSON object, or of an array of them."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None)
        return [], [Fault("not_json", f"The text is not JSON: {error}", row=line)]
    if isinstance(document, dict):
        return [Message(fields=document, pointer="")], []
    if not isinstance(document, list):
        return [], [Fault("omm_syntax", "Expected an object or an array of objects", pointer="")]
    if len(document) > MOST_SETS:
        return [], [too_many_sets()]
    messages, faults = [], []
    for index, item in enumerate(document):
        if isinstance(item, dict):
            messages.append(Message(fields=item, pointer=f"/{index}"))
        else:
            faults.append(Fault("omm_syntax", "Expected an object", pointer=f"/{index}"))
    return messages, faults


def read_csv(text: str) -> Read:
    """Return one message per record of a CSV file whose header names the keywords."""
    messages: list[Message] = []
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        return messages, _read_records(reader, messages)
    except csv.Error as error:
        return messages, [Fault("not_csv", f"The text is not CSV: {error}", row=reader.line_num)]


def _read_records(reader: Any, messages: list[Message]) -> list[Fault]:
    header: list[str] = []
    faults = []
    end = 0
    for number, cells in enumerate(reader):
        if number > MOST_SETS:
            messages.clear()
            return [too_many_sets()]
        row, end = end + 1, reader.line_num
        if not any(cell.strip() for cell in cells):
            continue
        if not header:
            header = [cell.strip() for cell in cells]
            fault = _header_fault(header, row)
            if fault is not None:
                return [fault]
        elif len(cells) != len(header):
            detail = f"Expected {len(header)} columns, got {len(cells)}"
            faults.append(Fault("csv_columns", detail, row=row))
        else:
            values = map(unguarded, cells)
            messages.append(Message(fields=dict(zip(header, values, strict=True)), row=row))
    return faults


def _header_fault(header: list[str], row: int) -> Fault | None:
    twice = [name for name, count in Counter(header).items() if name and count > 1]
    if twice:
        return Fault("omm_duplicate_key", f"The header names {_shown(twice[0])} twice", row=row)
    missing = [key for key in REQUIRED_KEYS if key not in header]
    if missing:
        return Fault("omm_missing_key", f"The header lacks {', '.join(missing)}", row=row)
    return None


def read_kvn(text: str) -> Read:
    """Return the messages of a text of ``KEYWORD = value [unit]`` lines.

    A message starts at its ``CCSDS_OMM_VERS``. A bad line invalidates only its own message.
    """
    parts = kvn_messages(io.StringIO(text), _MOST_LINES)
    return _sorted_out(_kvn_message(lines) for lines in parts)


def _sorted_out(read: Iterable[Message | Fault]) -> Read:
    messages: list[Message] = []
    faults: list[Fault] = []
    for number, item in enumerate(read):
        if number == MOST_SETS:
            return [], [too_many_sets()]
        if isinstance(item, Message):
            messages.append(item)
        else:
            faults.append(item)
    return messages, faults


def _kvn_message(lines: Lines) -> Message | Fault:
    if len(lines) > _MOST_LINES:
        detail = f"The message has more than {_MOST_LINES} lines"
        return Fault("omm_syntax", detail, row=lines[0][0])
    draft = _Draft(row=lines[0][0])
    for row, line in lines:
        draft.add_line(row, line)
    return draft.finish()


def kvn_messages(text: Iterable[str], most_lines: int) -> Iterator[Lines]:
    """Yield the lines of each message, numbered from 1; comments and blank lines are left out.

    A message that is too long is cut to one line more than the limit.
    """
    lines: Lines = []
    for row, line in enumerate(text, start=1):
        stripped = line.strip()
        if not stripped or stripped.split(maxsplit=1)[0] == "COMMENT":
            continue
        if stripped.startswith("CCSDS_") and lines:
            yield lines
            lines = []
        if len(lines) <= most_lines:
            lines.append((row, stripped))
    if lines:
        yield lines


def read_xml(elements: Iterable[Element]) -> Read:
    """Return the messages of the elements of a document."""
    return _sorted_out(_xml_message(element, f"/{at}") for at, element in enumerate(elements))


def xml_messages(data: bytes) -> list[Element] | Fault:
    """Return the messages of a document: its root, or the children of an ``ndm`` root.

    Document types are refused, and with them entities of every kind.
    """
    try:
        builder = _Builder()
        parser = DefusedXMLParser(target=builder, forbid_dtd=True)
        for start in range(0, len(data), _PIECE_BYTES):
            parser.feed(data[start : start + _PIECE_BYTES])
            builder.note_piece()
        root: Element = parser.close()
    except DefusedXmlException:
        return Fault("xml_forbidden", "The XML declares a document type or an entity")
    except ParseError as error:
        return Fault("not_xml", f"The text is not XML: {error}", row=error.position[0])
    except (ValueError, LookupError) as error:
        return Fault("not_xml", f"The text is not XML: {error}")
    return [root] if tag_of(root) != "ndm" else [e for e in root if tag_of(e) not in _NDM_TEXTS]


class _Builder(TreeBuilder):
    """Builds a document; refuses one that is deeper or longer than messages can be."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0
        self._num_elements = 0
        self._num_attributes = 0
        self._quiet_pieces = 0

    def note_piece(self) -> None:
        """Refuse a tag or comment without end: the parser would buffer and build it whole."""
        self._quiet_pieces += 1
        if self._quiet_pieces > _MOST_QUIET_PIECES:
            raise ValueError(f"a tag or comment is longer than {_PIECE_BYTES} bytes")

    def start(self, tag: str, attrs: dict[str, str], /) -> Element:
        """Open an element."""
        self._depth += 1
        self._num_elements += 1
        self._num_attributes += len(attrs)
        self._quiet_pieces = 0
        if self._depth > _DEEPEST:
            raise ValueError(f"elements are nested more than {_DEEPEST} deep")
        if self._num_elements > _MOST_ELEMENTS:
            raise ValueError(f"it has more than {_MOST_ELEMENTS} elements")
        if self._num_attributes > _MOST_ATTRIBUTES:
            raise ValueError(f"it has more than {_MOST_ATTRIBUTES} attributes")
        return super().start(tag, {key: attrs[key] for key in _ATTRIBUTES if key in attrs})

    def end(self, tag: str, /) -> Element:
        """Close an element."""
        self._depth -= 1
        self._quiet_pieces = 0
        return super().end(tag)


def tag_of(element: Element) -> str:
    """Return the name of an element, without its namespace."""
    return element.tag.rpartition("}")[2]


def _xml_message(element: Element, pointer: str) -> Message | Fault:
    if tag_of(element) != "omm":
        detail = f"Expected an omm message, got {_shown(tag_of(element))}"
        return Fault("unsupported_message", detail, pointer=pointer)
    draft = _Draft(pointer=pointer)
    draft.add("CCSDS_OMM_VERS", element.get("version", ""))
    for leaf in element.iter():
        if leaf is element or tag_of(leaf) in _XML_GROUPS:
            continue
        key = tag_of(leaf)
        if key == "USER_DEFINED":
            key = f"USER_DEFINED_{leaf.get('parameter', '')}"
        draft.add(key, (leaf.text or "").strip(), unit=leaf.get("units"))
    return draft.finish()


class _Draft:
    """A message being read: takes keywords one by one and remembers the first fault."""

    def __init__(self, *, pointer: str | None = None, row: int | None = None):
        self._pointer = pointer
        self._row = row
        self._fields: dict[str, object] = {}
        self._rows: dict[str, int] = {}
        self._fault: Fault | None = None

    def add_line(self, row: int, line: str) -> None:
        """Take one ``KEYWORD = value [unit]`` line."""
        key, equals, value = (part.strip() for part in line.partition("="))
        if not equals:
            self._refuse("omm_syntax", f"Expected KEYWORD = value, got {_shown(line)}", "", row)
            return
        unit = None
        if key in _UNITS and value.endswith("]") and "[" in value:
            value, _, unit = value[:-1].rpartition("[")
        self.add(key, value.strip(), unit=unit, row=row)

    def add(self, key: str, value: str, *, unit: str | None = None, row: int | None = None) -> None:
        """Take one keyword with its value."""
        if key.startswith("USER_DEFINED_") or key == "COMMENT":
            return
        if key.startswith("CCSDS_") and key != "CCSDS_OMM_VERS":
            detail = f"Expected an OMM, got a message that starts with {_shown(key)}"
            self._refuse("unsupported_message", detail, key, row)
        elif key not in _KEYWORDS and _COVARIANCE.fullmatch(key) is None:
            self._refuse("omm_unknown_keyword", f"Unknown keyword {_shown(key)}", key, row)
        elif key in self._fields:
            self._refuse("omm_duplicate_key", f"{key} appears twice in one message", key, row)
        elif unit is not None and unit.strip().lower() != _UNITS.get(key):
            detail = f"{key} is in {_shown(unit)}, must be in {_UNITS.get(key)}"
            self._refuse("omm_unit", detail, key, row)
        self._fields[key] = value
        if row is not None:
            self._rows[key] = row

    def finish(self) -> Message | Fault:
        """Return the message, or the first thing that is wrong with it."""
        for key in _MUST_STAND:
            if not self._fields.get(key):
                self._refuse("omm_missing_key", f"{key} is missing", key, self._row)
        if self._fault is not None:
            return self._fault
        return Message(fields=self._fields, pointer=self._pointer, row=self._row, rows=self._rows)

    def _refuse(self, code: str, detail: str, key: str, row: int | None) -> None:
        if self._fault is None:
            pointer = None if self._pointer is None else f"{self._pointer}/{key[:_LONGEST_SHOWN]}"
            self._fault = Fault(code, detail, pointer=pointer, row=row)


def _shown(text: str) -> str:
    return ascii(text[:_LONGEST_SHOWN])
