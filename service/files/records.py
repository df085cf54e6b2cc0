"""CSV and GeoJSON files of points: from bytes to checked bodies, each fault with its location."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from planner_core.errors import Fault, PlannerError
from service.files.tables import Table, decoded, has_decimal_comma, read_table
from service.problems.faults import faults_of_validation, refuse, refuse_one

B = TypeVar("B", bound=BaseModel)

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d{1,18}", re.ASCII)
_TEXT_COLUMNS = (
    "id", "name", "satellite_id", "target_id", "station_id", "release", "due", "sensor_type",
    "action_id", "outcome", "at", "detail",
)  # fmt: skip
_ALIASES = {
    **dict.fromkeys(("lat", "latitude"), "lat_deg"),
    **dict.fromkeys(("lon", "lng", "long", "longitude"), "lon_deg"),
}
_MISSPELT = 0.75
MOST_COLUMNS = 200
_MOST_FAULTS = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One record of a file, not yet checked.

    Attributes
    ----------
    row
        Line of the file where it starts, for CSV.
    pointer
        Location of its fields, for JSON.
    pointers
        Locations of fields that are elsewhere.
    """

    fields: Mapping[str, object]
    row: int | None = None
    pointer: str = ""
    pointers: Mapping[str, str] = field(default_factory=dict)

    def place(self, fault: Fault) -> Fault:
        """Return a fault of one field with its location in the file."""
        name = (fault.pointer or "").removeprefix("/").partition("/")[0]
        if self.row is None:
            own = f"{self.pointer}/{name}" if name else self.pointer
            return replace(fault, pointer=self.pointers.get(name, own))
        detail = f"{name}: {fault.detail}" if name else fault.detail
        return replace(fault, row=self.row, pointer=None, detail=detail)


@dataclass(frozen=True, slots=True, kw_only=True)
class Records:
    """The content of a file; ``ignored`` lists unknown columns."""

    records: tuple[Record, ...] = ()
    faults: tuple[Fault, ...] = ()
    ignored: tuple[str, ...] = ()
    name: str | None = None


@dataclass(frozen=True, slots=True)
class Checked(Generic[B]):
    """A record that fits its schema."""

    record: Record
    body: B


def check(
    records: Sequence[Record], schema: type[B], build: Callable[[B], object]
) -> tuple[list[Checked[B]], list[Fault]]:
    """Return the bodies that fit, and the faults of the others.

    Parameters
    ----------
    build
        Makes the domain type from a body, which makes the final check of its values.

    Raises
    ------
    ServiceError
        ``too_many_errors``: so many that the file must be of another kind.
    """
    good: list[Checked[B]] = []
    faults: list[Fault] = []
    for record in records:
        if len(faults) > _MOST_FAULTS:
            raise refuse(faults, code="too_many_errors")
        try:
            body = schema.model_validate(record.fields)
            build(body)
        except ValidationError as error:
            found = faults_of_validation(error, record.fields)
            faults += [record.place(_with_hint(fault, record.fields)) for fault in found]
        except PlannerError as error:
            faults.append(record.place(error.fault))
        else:
            good.append(Checked(record, body))
    return good, faults


def _with_hint(fault: Fault, fields: Mapping[str, object]) -> Fault:
    value = fields.get((fault.pointer or "").removeprefix("/"))
    if isinstance(value, str) and has_decimal_comma(value):
        hint = "Write it with a decimal point, or separate cells with semicolons"
        return replace(fault, detail=f"{fault.detail} {hint}.")
    lat, lon = fields.get("lat_deg"), fields.get("lon_deg")
    if fault.pointer != "/lat_deg" or not isinstance(lat, float) or not isinstance(lon, float):
        return fault
    if 90.0 < abs(lat) <= 360.0 and abs(lon) <= 90.0:
        hint = f"{fault.detail} It is {lat}: are latitude and longitude swapped?"
        return replace(fault, detail=hint)
    return fault


def read_csv(
    data: bytes, known: Collection[str], required: Collection[str], *, most: int
) -> Records:
    """Return the records, at most ``most``, of a CSV file with a header.

    Columns may be in any order; ``lat``, ``latitude``, ``lon``, ``lng``, ``long`` and
    ``longitude`` are accepted too, and ``city`` if there is no ``name``. Other columns are
    ignored, unless they look like a misspelt one. An empty cell means the default. Cells are
    separated by commas, or by semicolons or tabs if the header shows it; in the latter case, a
    comma may be the decimal sign.
    """
    try:
        table, line, columns = open_table(data, required)
    except NoTable as error:
        return Records(faults=(error.fault,))
    faults = faults_of_header(line, columns, known, required)
    if faults:
        return Records(faults=tuple(faults))
    records: list[Record] = []
    for number, row in enumerate(islice(table.rows, 1, None)):
        if number == most:
            return _too_many_rows(most)
        if isinstance(row, Fault):
            faults.append(row)
        elif len(row[1]) != len(columns):
            detail = f"The line has {len(row[1])} cells, the header {len(columns)}."
            if table.delimiter == "," and len(row[1]) > len(columns):
                detail += " If commas are decimal signs, separate cells with semicolons."
            faults.append(Fault(code="malformed_csv", detail=detail, row=row[0]))
        else:
            cells = zip(columns, (cell.strip() for cell in row[1]), strict=True)
            fields = {
                name: _value(name, cell, table) for name, cell in cells if cell and name in known
            }
            records.append(Record(fields=fields, row=row[0]))
    if not records and not faults:
        faults.append(Fault(code="empty_file", detail="The file has a header and no records."))
    ignored = tuple(column for column in columns if column not in known)
    return Records(records=tuple(records), faults=tuple(faults), ignored=ignored)


class NoTable(Exception):
    """A file does not hold a table; ``fault`` says why."""

    def __init__(self, code: str, detail: str, row: int | None = None):
        super().__init__(detail)
        self.fault = Fault(code=code, detail=detail, row=row)


def open_table(data: bytes, required: Collection[str]) -> tuple[Table, int, list[str]]:
    """Return the table in a file, the line of its header, and our names of its columns."""
    text = decoded(data)
    if isinstance(text, Fault):
        raise NoTable(text.code, text.detail)
    table = read_table(text, column_names, required)
    first = next(table.rows, None)
    if first is None:
        raise NoTable("empty_file", "The file is empty.")
    if isinstance(first, Fault):
        raise NoTable(first.code, first.detail, first.row)
    line, header = first
    if len(header) > MOST_COLUMNS:
        detail = f"The header has {len(header)} columns; the limit is {MOST_COLUMNS}."
        raise NoTable("malformed_csv", detail, line)
    return table, line, column_names(header)


def column_names(header: Sequence[str]) -> list[str]:
    """Return our names of a file's columns."""
    names = [cell.strip().lower() for cell in header]
    # Lists of cities use this column for the name.
    aliases = _ALIASES if "name" in names else _ALIASES | {"city": "name"}
    return [aliases.get(name, name) for name in names]


def _too_many_rows(most: int) -> Records:
    detail = f"The file holds more than {most} records; split it."
    return Records(faults=(Fault(code="too_many_rows", detail=detail),))


def faults_of_header(
    row: int, columns: Sequence[str], known: Collection[str], required: Collection[str]
) -> list[Fault]:
    """Return faults for columns given twice, misspelt or missing; ``row`` is the header's line."""
    faults = []
    for position, column in enumerate(columns):
        missing = [name for name in known if name not in columns]
        meant = difflib.get_close_matches(column, missing, 1, _MISSPELT)
        if column in columns[:position]:
            faults.append(
                Fault(code="malformed_csv", detail=f"Column {column!r} is given twice.", row=row)
            )
        elif column not in known and meant:
            detail = f"There is no column {column!r}; did you mean {meant[0]!r}?"
            faults.append(Fault(code="unknown_field", detail=detail, row=row))
    lacking = [name for name in required if name not in columns]
    if lacking:
        detail = f"The header lacks {', '.join(lacking)}; it has {', '.join(columns)[:200]}."
        faults.append(Fault(code="missing_field", detail=detail, row=row))
    return faults


def _value(column: str, cell: str, table: Table) -> object:
    if column in _TEXT_COLUMNS:
        return cell
    cell = table.number(cell)
    if column == "antennas" and _WHOLE.fullmatch(cell):
        return int(cell)
    # What is not a number stays text, so that the schema refuses it by name.
    return float(cell) if _NUMBER.fullmatch(cell) else cell


def read_json(data: bytes) -> Any:
    """Return a JSON document; 422 if the data is not JSON."""
    try:
        return json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise refuse_one("malformed_json", f"Not JSON: {error}"[:200]) from None


def read_geojson(data: bytes, known: Collection[str], *, most: int) -> Records:
    """Return the points of a GeoJSON FeatureCollection (RFC 7946: longitude, latitude, altitude).

    Properties of a feature that are fields of ours are used; others are ignored.
    """
    text = decoded(data)
    if isinstance(text, Fault):
        return Records(faults=(text,))
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        return Records(faults=(Fault(code="malformed_json", detail=f"Not JSON: {error}"[:200]),))
    if not isinstance(document, dict) or document.get("type") != "FeatureCollection":
        return _no_collection("The body must be a FeatureCollection.", "")
    features = document.get("features")
    if not isinstance(features, list):
        return _no_collection("A FeatureCollection must have a list of features.", "/features")
    if not features:
        return Records(faults=(Fault(code="empty_file", detail="The collection is empty."),))
    if len(features) > most:
        return _too_many_rows(most)
    found = [_feature(feature, f"/features/{i}", known) for i, feature in enumerate(features)]
    name = document.get("name")
    return Records(
        records=tuple(one for one in found if isinstance(one, Record)),
        faults=tuple(one for one in found if isinstance(one, Fault)),
        name=name[:200] if isinstance(name, str) and name.isprintable() and name else None,
    )


def _no_collection(detail: str, pointer: str) -> Records:
    return Records(faults=(Fault(code="malformed_geojson", detail=detail, pointer=pointer),))


def _feature(feature: object, pointer: str, known: Collection[str]) -> Record | Fault:
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        return Fault(code="malformed_geojson", detail="This is not a Feature.", pointer=pointer)
    geometry = feature.get("geometry")
    if not isinstance(geometry, dict) or geometry.get("type") != "Point":
        detail = "The geometry must be a Point."
        return Fault(code="malformed_geojson", detail=detail, pointer=f"{pointer}/geometry")
    at = f"{pointer}/geometry/coordinates"
    position = geometry.get("coordinates")
    if not isinstance(position, list) or len(position) not in (2, 3):
        detail = "A position must be [longitude, latitude] or [longitude, latitude, altitude]."
        return Fault(code="malformed_geojson", detail=detail, pointer=at)
    properties = feature.get("properties")
    fields: dict[str, Any] = dict(properties) if isinstance(properties, dict) else {}
    fields |= dict(zip(("lon_deg", "lat_deg", "alt_m"), map(_as_float, position), strict=False))
    if "id" in feature:
        fields["id"] = feature["id"]
    for name in ("id", "name"):
        if isinstance(fields.get(name), int):
            fields[name] = str(fields[name])
    pointers = {"lon_deg": f"{at}/0", "lat_deg": f"{at}/1"}
    if len(position) == 3:
        pointers["alt_m"] = f"{at}/2"
    if "id" in feature or "id" not in fields:
        pointers["id"] = f"{pointer}/id"
    kept = {name: value for name, value in fields.items() if name in known and value is not None}
    return Record(fields=kept, pointer=f"{pointer}/properties", pointers=pointers)


def _as_float(value: object) -> object:
    is_number = isinstance(value, int) and not isinstance(value, bool)
    try:
        return float(value) if is_number else value  # type: ignore[arg-type]
    except OverflowError:
        return float("inf")
