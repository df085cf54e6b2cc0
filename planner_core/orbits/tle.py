"""One two-line element set: its columns, read and written.

A line has 69 columns; every field has its own, and the last is a checksum. Catalogue numbers
above 99999 are written in Alpha-5: a letter (not I, not O) for the first two digits.

Blanks for zeros
----------------
Some programs, the paper's among them, pad with blanks where the format has zeros: in the
catalogue number, the year and day of the epoch (``19  1.00000000``), and the eccentricity.
Such a line is read as if it had the zeros, its checksum is recomputed, and the reading has the
warning ``tle_normalised``. A wrong or missing checksum is accepted only on such a line, whatever
the other line is: everywhere else it means that a digit is wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from planner_core.domain import OrbitElements
from planner_core.errors import Fault, InvalidElements
from planner_core.orbits.element_ranges import require_in_range

_WIDTH = 69
_ALPHA5 = "ABCDEFGHJKLMNPQRSTUVWXYZ"
_LARGEST_ALPHA5 = 339_999
_PIVOT_YEAR = 57  # two-digit years from here on belong to the twentieth century
_TICK_US = 864  # 1e-8 day, the last digit of an epoch, is a whole number of microseconds


@dataclass(frozen=True, slots=True, kw_only=True)
class TleReading:
    """An element set that was read, and its two lines as they should have been written."""

    elements: OrbitElements
    lines: tuple[str, str]
    warnings: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class _Field:
    name: str
    start: int
    end: int
    pattern: str
    has_zeros: bool = False  # padded with zeros by the format, with blanks by some programs


# A decimal point has its own column, which the lookahead enforces.
_ANGLE = r"(?=...\.) *\d*\.\d+ *"
_POWER = r"[ +-]\d{5}[ +-]\d"
_NUMBER = _Field("catalogue number", 2, 7, r"[0-9A-HJ-NP-Z]\d{4}| +\d+", has_zeros=True)

_FIELDS = (
    (
        _NUMBER,
        _Field("classification", 7, 8, r"[A-Z ]"),
        _Field("designator", 9, 17, r"[ -~]{8}"),
        _Field("epoch year", 18, 20, r" ?\d+", has_zeros=True),
        _Field("epoch day", 20, 32, r"(?=...\.) *\d+\.\d* *", has_zeros=True),
        _Field("mean motion dot", 33, 43, r"[ +\-0]\.\d+ *"),
        _Field("mean motion ddot", 44, 52, _POWER),
        _Field("bstar", 53, 61, _POWER),
        _Field("ephemeris type", 62, 63, r"[\d ]"),
        _Field("element set number", 64, 68, r" *\d*"),
    ),
    (
        _NUMBER,
        _Field("inclination", 8, 16, _ANGLE),
        _Field("right ascension", 17, 25, _ANGLE),
        _Field("eccentricity", 26, 33, r" *\d+ *", has_zeros=True),
        _Field("argument of perigee", 34, 42, _ANGLE),
        _Field("mean anomaly", 43, 51, _ANGLE),
        _Field("mean motion", 52, 63, r"(?=..\.) *\d*\.\d+ *"),
        _Field("revolution number", 63, 68, r" *\d*"),
    ),
)
_BLANKS = ((1, 8, 17, 32, 43, 52, 61, 63), (1, 7, 16, 25, 33, 42, 51))

_POINTERS = {
    "epoch": "/tle/0",
    "inclination_deg": "/tle/1",
    "raan_deg": "/tle/1",
    "arg_perigee_deg": "/tle/1",
    "mean_anomaly_deg": "/tle/1",
    "eccentricity": "/tle/1",
    "mean_motion_rev_day": "/tle/1",
}
_RATES = ("bstar", "mean_motion_dot", "mean_motion_ddot")


def parse_tle(lines: Sequence[str]) -> OrbitElements:
    """Return the elements of one set of exactly two lines.

    The values are those that python-sgp4 reads from the same lines, to the last bit.

    Raises
    ------
    InvalidElements
        With pointer ``/tle/0`` or ``/tle/1`` and one of the codes ``tle_missing_line``,
        ``tle_line_order``, ``tle_line_number``, ``tle_tabs``, ``tle_not_ascii``,
        ``tle_line_length``, ``tle_columns``, ``tle_number_format``, ``tle_checksum``,
        ``tle_number_mismatch``, ``tle_epoch``, ``unsupported_theory``, ``value_out_of_range``.
    """
    return read_tle(lines).elements


def read_tle(lines: Sequence[str]) -> TleReading:
    """Return elements, tidy lines and warnings of one set of two lines.

    Raises
    ------
    InvalidElements
        As `parse_tle`.
    """
    if len(lines) != 2:
        raise InvalidElements(
            "tle_missing_line", f"An element set has 2 lines, got {len(lines)}", pointer="/tle"
        )
    if lines[0][:2] == "2 " and lines[1][:2] == "1 ":
        raise InvalidElements("tle_line_order", "Line 2 comes before line 1", pointer="/tle/0")
    tidy = []
    warnings = []
    for index, text in enumerate(lines):
        line, warning = _tidy_line(text.rstrip(), index)
        tidy.append(line)
        if warning is not None:
            warnings.append(warning)
    elements = _elements(_fields(tidy[0], 0), _fields(tidy[1], 1))
    require_in_range(elements, _POINTERS)
    return TleReading(elements=elements, lines=(tidy[0], tidy[1]), warnings=tuple(warnings))


def checksum(line: str) -> int:
    """Return the checksum of the first 68 columns: digits count themselves, a minus counts 1."""
    return sum(int(c) if c.isdigit() else c == "-" for c in line[:68]) % 10


def _refuse(code: str, index: int, detail: str) -> InvalidElements:
    return InvalidElements(code, f"Line {index + 1}: {detail}", pointer=f"/tle/{index}")


def _tidy_line(line: str, index: int) -> tuple[str, Fault | None]:
    """Return the line with zeros for blanks and its checksum, and what was changed."""
    if "\t" in line:
        raise _refuse("tle_tabs", index, "has tabs, which shift its fixed columns")
    if not (line.isascii() and line.isprintable()):
        raise _refuse("tle_not_ascii", index, "has a character that is not printable ASCII")
    if line[:1] != str(index + 1):
        raise _refuse("tle_line_number", index, f"must start with {index + 1}")
    if not _WIDTH - 1 <= len(line) <= _WIDTH:
        raise _refuse("tle_line_length", index, f"expected {_WIDTH} columns, got {len(line)}")
    _require_layout(line, index)
    padded = [field for field in _FIELDS[index] if _is_padded(field, line)]
    for field in padded:
        zeros = line[field.start : field.end].replace(" ", "0")
        line = line[: field.start] + zeros + line[field.end :]
    if not padded:
        _require_checksum(line, index)
        return line, None
    names = ", ".join(field.name for field in padded)
    detail = f"Line {index + 1}: blanks taken as zeros in {names}; checksum recomputed"
    warning = Fault("tle_normalised", detail, pointer=f"/tle/{index}")
    return line[:68] + str(checksum(line)), warning


def _require_layout(line: str, index: int) -> None:
    for column in _BLANKS[index]:
        if line[column] != " ":
            raise _refuse(
                "tle_columns", index, f"column {column + 1} must be blank, got {line[column]!r}"
            )
    for field in _FIELDS[index]:
        text = line[field.start : field.end]
        if re.fullmatch(field.pattern, text, re.ASCII) is None:
            where = f"columns {field.start + 1} to {field.end}"
            raise _refuse("tle_number_format", index, f"{field.name} ({where}) is {text!r}")


def _is_padded(field: _Field, line: str) -> bool:
    return field.has_zeros and " " in line[field.start : field.end]


def _require_checksum(line: str, index: int) -> None:
    if len(line) < _WIDTH:
        raise _refuse("tle_line_length", index, f"expected {_WIDTH} columns, got {len(line)}")
    expected = checksum(line)
    if line[68] != str(expected):
        raise _refuse("tle_checksum", index, f"expected {expected}, got {line[68]}")


def _fields(line: str, index: int) -> dict[str, str]:
    return {field.name: line[field.start : field.end] for field in _FIELDS[index]}


def _elements(one: dict[str, str], two: dict[str, str]) -> OrbitElements:
    number, number_two = (_number(fields["catalogue number"]) for fields in (one, two))
    if number != number_two:
        detail = f"catalogue number is {number_two}, line 1 says {number}"
        raise _refuse("tle_number_mismatch", 1, detail)
    if one["ephemeris type"] not in " 0":
        raise _refuse("unsupported_theory", 0, theory_of_type(one["ephemeris type"]))
    return OrbitElements(
        name=None,
        norad_cat_id=number,
        object_id=_object_id(one["designator"].strip()),
        epoch=_epoch(one["epoch year"], one["epoch day"]),
        mean_motion_rev_day=float(two["mean motion"]),
        eccentricity=float("0." + two["eccentricity"]),
        inclination_deg=float(two["inclination"]),
        raan_deg=float(two["right ascension"]),
        arg_perigee_deg=float(two["argument of perigee"]),
        mean_anomaly_deg=float(two["mean anomaly"]),
        bstar=_power(one["bstar"]),
        mean_motion_dot=float(one["mean motion dot"]),
        mean_motion_ddot=_power(one["mean motion ddot"]),
        element_set_no=int(one["element set number"].strip() or 0),
        rev_at_epoch=int(two["revolution number"].strip() or 0),
        classification=one["classification"].strip() or "U",
    )


def theory_of_type(ephemeris_type: str) -> str:
    """Return the sentence that refuses an ephemeris type other than 0.

    Sources disagree about 1, 2 and 3, and in some of them 2 means a different mean motion from
    the one SGP4 takes; guessing wrong would move the satellite by degrees.
    """
    name = {"4": "SGP4-XP", "6": "special perturbations"}.get(ephemeris_type, "another theory")
    return f"ephemeris type {ephemeris_type} ({name}) is not supported, only 0 (SGP4)"


def _number(text: str) -> int:
    if text[0].isalpha():
        return (10 + _ALPHA5.index(text[0])) * 10_000 + int(text[1:])
    return int(text)


def _object_id(designator: str) -> str:
    if re.fullmatch(r"\d{5}[A-Z]{1,3}", designator, re.ASCII) is None:
        return designator
    return f"{_full_year(designator[:2])}-{designator[2:]}"


def _full_year(text: str) -> int:
    year = int(text)
    return year + (1900 if year >= _PIVOT_YEAR else 2000)


def _epoch(year: str, day_text: str) -> datetime:
    day, _, decimals = day_text.partition(".")
    if not 1 <= int(day) <= 366:
        raise _refuse("tle_epoch", 0, f"day of the year is {int(day)}, must be from 1 to 366")
    start = datetime(_full_year(year), 1, 1, tzinfo=UTC)
    return start + timedelta(days=int(day) - 1, microseconds=int(decimals) * _TICK_US)


def _power(text: str) -> float:
    """Return the value of ``-12345-6`` = -0.12345e-6, with python-sgp4's own rounding."""
    mantissa = float(f"{text[0]}.{text[1:6]}".strip())
    return mantissa * math.pow(10.0, int(text[6:].strip()))


def format_tle(elements: OrbitElements) -> tuple[str, str]:
    """Return the two lines of an element set that a TLE can express.

    Raises
    ------
    ValueError
        A value needs more digits than its columns have (epochs may be 1 microsecond off) or
        lies outside what they can express, or the catalogue number is above 339999.
    """
    try:
        require_in_range(elements, _POINTERS | dict.fromkeys(_RATES, "/tle/0"))
    except InvalidElements as error:
        raise ValueError(error.detail) from error
    number = _alpha5(elements.norad_cat_id)
    if re.fullmatch("[A-Z]", elements.classification) is None:
        raise ValueError(f"classification {elements.classification!r} is not one capital letter")
    one = (
        f"1 {number}{elements.classification} {_designator(elements.object_id):8} "
        f"{_epoch_text(elements.epoch)} {_rate_text(elements.mean_motion_dot)} "
        f"{_power_text(elements.mean_motion_ddot)} {_power_text(elements.bstar)} "
        f"0 {_count(elements.element_set_no, 4)}"
    )
    two = (
        f"2 {number} {_fixed(elements.inclination_deg, 8, 4)} {_fixed(elements.raan_deg, 8, 4)} "
        f"{_fraction_text(elements.eccentricity)} {_fixed(elements.arg_perigee_deg, 8, 4)} "
        f"{_fixed(elements.mean_anomaly_deg, 8, 4)} {_fixed(elements.mean_motion_rev_day, 11, 8)}"
        f"{_count(elements.rev_at_epoch, 5)}"
    )
    return one + str(checksum(one)), two + str(checksum(two))


def _alpha5(number: int) -> str:
    if not 0 <= number <= _LARGEST_ALPHA5:
        raise ValueError(f"catalogue number {number} does not fit a TLE (largest is 339999)")
    if number < 100_000:
        return f"{number:05d}"
    return f"{_ALPHA5[number // 10_000 - 10]}{number % 10_000:04d}"


def _designator(object_id: str) -> str:
    match = re.fullmatch(r"(\d{4})-(\d{3}[A-Z]{1,3})", object_id, re.ASCII)
    text = match[1][2:] + match[2] if match else object_id
    is_text = text.isascii() and text.isprintable() and len(text) <= 8
    if not is_text or _object_id(text.strip()) != object_id:
        raise ValueError(f"object id {object_id!r} does not fit a TLE")
    return text


def _epoch_text(epoch: datetime) -> str:
    instant = epoch.astimezone(UTC)
    midnight = instant.replace(hour=0, minute=0, second=0, microsecond=0)
    microseconds = (instant - midnight) // timedelta(microseconds=1)
    ticks = round(microseconds / _TICK_US)
    if abs(ticks * _TICK_US - microseconds) > 1:
        raise ValueError(f"epoch {instant.isoformat()} needs more digits than a TLE has")
    rounded = midnight + timedelta(microseconds=ticks * _TICK_US)
    if not 1900 + _PIVOT_YEAR <= rounded.year < 2000 + _PIVOT_YEAR:
        raise ValueError(f"epoch year {rounded.year} does not fit a TLE")
    return f"{rounded:%y%j}.{ticks % 100_000_000:08d}"


def _close(text: str, value: float) -> bool:
    # Values that came through other formats carry binary rounding errors.
    return math.isclose(float(text), value, rel_tol=1e-12, abs_tol=1e-15)


def _fixed(value: float, width: int, digits: int) -> str:
    text = f"{value:{width}.{digits}f}"
    if len(text) > width or text.lstrip().startswith("-") or not _close(text, value):
        raise ValueError(f"{value} does not fit a TLE field of {width} columns")
    return text


def _fraction_text(value: float) -> str:
    text = _fixed(value, 9, 7)
    if not text.startswith("0."):
        raise ValueError(f"eccentricity {value} rounds to 1")
    return text[2:]


def _rate_text(value: float) -> str:
    text = f"{value:+.8f}"
    if len(text) != 11 or not _close(text, value) or text[1] != "0":
        raise ValueError(f"{value} does not fit a TLE field of 10 columns")
    return (" " if value >= 0 else "-") + text[2:]


def _power_text(value: float) -> str:
    if value == 0:
        return " 00000+0"
    exponent = max(-9, math.floor(math.log10(abs(value))) + 1)
    digits = round(abs(value) / math.pow(10.0, exponent) * 1e5)
    if digits == 100_000:
        digits, exponent = 10_000, exponent + 1
    text = f"{' ' if value > 0 else '-'}{digits:05d}{exponent:+d}"
    if len(text) != 8 or not math.isclose(_power(text), value, rel_tol=1e-12):
        raise ValueError(f"{value} needs more digits than a TLE has")
    return text


def _count(value: int, width: int) -> str:
    text = f"{value:{width}d}"
    if value < 0 or len(text) > width:
        raise ValueError(f"{value} does not fit a TLE field of {width} columns")
    return text
