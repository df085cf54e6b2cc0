"""One Orbit Mean-Elements Message (CCSDS 502.0-B-3) as a mapping of its keywords.

Only SGP4 mean elements about the Earth, in TEME and UTC, are accepted; anything else is
refused, naming the keyword. Keywords that a mapping leaves out have these defaults, as in the
JSON and CSV of CelesTrak: theory SGP4, frame TEME, time UTC, centre EARTH. Keywords that say
nothing about the orbit are ignored.

``SEMI_MAJOR_AXIS`` in place of ``MEAN_MOTION`` is refused: SGP4 needs the mean motion, and
an axis does not say which of several mean motions it stands for.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta

from planner_core.domain import OrbitElements
from planner_core.errors import InvalidElements
from planner_core.orbits.element_ranges import (
    LARGEST_NORAD_CAT_ID,
    LONGEST_TEXT,
    is_plain_text,
    require_in_range,
)
from planner_core.orbits.tle import theory_of_type

REQUIRED_KEYS = (
    "EPOCH",
    "MEAN_MOTION",
    "ECCENTRICITY",
    "INCLINATION",
    "RA_OF_ASC_NODE",
    "ARG_OF_PERICENTER",
    "MEAN_ANOMALY",
    "NORAD_CAT_ID",
    "BSTAR",
)

_ATTRIBUTES = {
    "mean_motion_rev_day": "MEAN_MOTION",
    "eccentricity": "ECCENTRICITY",
    "inclination_deg": "INCLINATION",
    "raan_deg": "RA_OF_ASC_NODE",
    "arg_perigee_deg": "ARG_OF_PERICENTER",
    "mean_anomaly_deg": "MEAN_ANOMALY",
    "bstar": "BSTAR",
    "mean_motion_dot": "MEAN_MOTION_DOT",
    "mean_motion_ddot": "MEAN_MOTION_DDOT",
}
_POINTERS = {name: "/omm/" + key for name, key in _ATTRIBUTES.items()} | {"epoch": "/omm/EPOCH"}

# keyword: accepted values, code of the refusal
_FIXED = {
    "CCSDS_OMM_VERS": (("2.0", "3.0"), "unsupported_version"),
    "MEAN_ELEMENT_THEORY": (("SGP4", "SGP/SGP4"), "unsupported_theory"),
    "REF_FRAME": (("TEME",), "unsupported_frame"),
    "TIME_SYSTEM": (("UTC",), "unsupported_time_system"),
    "CENTER_NAME": (("EARTH",), "unsupported_center"),
}
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_INTEGER = re.compile(r"[+-]?\d+", re.ASCII)
_LONGEST_NUMBER = 64
_LONGEST_SHOWN = 40
_EPOCH = re.compile(
    r"(?P<year>\d{4})-(?:(?P<month>\d{2})-(?P<day>\d{2})|(?P<day_of_year>\d{3}))[T ]"
    r"(?P<hour>\d{2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:\.(?P<decimals>\d{0,18}))?Z?",
    re.ASCII,
)


def elements_from_omm(fields: Mapping[str, object]) -> OrbitElements:
    """Return the element set of a message.

    Parameters
    ----------
    fields
        CCSDS keywords and their values; numbers may be given as text.

    Raises
    ------
    InvalidElements
        With pointer ``/omm/KEYWORD`` and one of the codes ``omm_missing_key``,
        ``omm_number_format``, ``omm_epoch``, ``omm_text``, ``value_out_of_range``,
        ``unsupported_version``, ``unsupported_theory``, ``unsupported_frame``,
        ``unsupported_time_system``, ``unsupported_center``.
    """
    _require_sgp4(fields)
    for key in REQUIRED_KEYS:
        if not _is_present(fields, key):
            raise _refuse("omm_missing_key", key, _missing(fields, key))
    elements = OrbitElements(
        name=_text(fields, "OBJECT_NAME") or None,
        norad_cat_id=_integer(fields, "NORAD_CAT_ID", 0),
        object_id=_text(fields, "OBJECT_ID"),
        epoch=_epoch(fields["EPOCH"]),
        element_set_no=_integer(fields, "ELEMENT_SET_NO", 999),
        rev_at_epoch=_integer(fields, "REV_AT_EPOCH", 0),
        classification=_text(fields, "CLASSIFICATION_TYPE") or "U",
        **{name: _number(fields, key) for name, key in _ATTRIBUTES.items()},
    )
    require_in_range(elements, _POINTERS)
    return elements


def omm_from_elements(elements: OrbitElements) -> dict[str, object]:
    """Return the message of an element set, with the keywords of CelesTrak's JSON.

    Reading it again with `elements_from_omm` gives the same element set.
    """
    epoch = elements.epoch.astimezone(UTC).replace(tzinfo=None)
    message: dict[str, object] = {
        "OBJECT_NAME": elements.name or "",
        "OBJECT_ID": elements.object_id,
        "EPOCH": epoch.isoformat(timespec="microseconds"),
    }
    message |= {key: getattr(elements, name) for name, key in _ATTRIBUTES.items()}
    return message | {
        "EPHEMERIS_TYPE": 0,
        "CLASSIFICATION_TYPE": elements.classification,
        "NORAD_CAT_ID": elements.norad_cat_id,
        "ELEMENT_SET_NO": elements.element_set_no,
        "REV_AT_EPOCH": elements.rev_at_epoch,
    }


def _refuse(code: str, key: str, detail: str) -> InvalidElements:
    return InvalidElements(code, f"{key} {detail}", pointer="/omm/" + key)


def _shown(value: object) -> str:
    return ascii(value[:_LONGEST_SHOWN]) if isinstance(value, str) else ascii(type(value).__name__)


def _is_present(fields: Mapping[str, object], key: str) -> bool:
    value = fields.get(key)
    return value is not None and not (isinstance(value, str) and not value.strip())


def _missing(fields: Mapping[str, object], key: str) -> str:
    if key == "MEAN_MOTION" and _is_present(fields, "SEMI_MAJOR_AXIS"):
        return "is missing; SGP4 needs it, and SEMI_MAJOR_AXIS cannot replace it"
    return "is missing"


def _require_sgp4(fields: Mapping[str, object]) -> None:
    for key, (accepted, code) in _FIXED.items():
        if _is_present(fields, key):
            value = _text(fields, key)
            if value.upper() not in accepted:
                raise _refuse(code, key, f"is {_shown(value)}, must be {' or '.join(accepted)}")
    ephemeris_type = _integer(fields, "EPHEMERIS_TYPE", 0)
    if ephemeris_type != 0:
        refusal = f"is refused: {theory_of_type(str(ephemeris_type))}"
        raise _refuse("unsupported_theory", "EPHEMERIS_TYPE", refusal)
    for key in ("BTERM", "AGOM"):
        if _is_present(fields, key) and not _is_present(fields, "BSTAR"):
            raise _refuse("unsupported_theory", key, "belongs to SGP4-XP, which is not supported")


def _text(fields: Mapping[str, object], key: str) -> str:
    if not _is_present(fields, key):
        return ""
    value = fields[key]
    # A version or a name may come as a bare JSON number.
    text = str(value) if isinstance(value, float) else value
    if not isinstance(text, str) or not is_plain_text(text.strip()):
        raise _refuse(
            "omm_text", key, f"must be printable text of at most {LONGEST_TEXT} characters"
        )
    return text.strip()


def _number(fields: Mapping[str, object], key: str) -> float:
    if not _is_present(fields, key):
        return 0.0
    value = fields[key]
    if isinstance(value, str):
        text = value.strip()
        if len(text) > _LONGEST_NUMBER or _DECIMAL.fullmatch(text) is None:
            raise _refuse("omm_number_format", key, f"is {_shown(value)}, not a number")
        number = float(text)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = _finite(value)
    else:
        raise _refuse("omm_number_format", key, f"is {_shown(value)}, not a number")
    if not math.isfinite(number):
        raise _refuse("value_out_of_range", key, "must be a finite number")
    return number


def _finite(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf


def _integer(fields: Mapping[str, object], key: str, default: int) -> int:
    if not _is_present(fields, key):
        return default
    value = fields[key]
    if isinstance(value, str) and _INTEGER.fullmatch(value.strip()) is None:
        raise _refuse("omm_number_format", key, f"is {_shown(value)}, not a whole number")
    number = _number(fields, key)
    if number != math.floor(number):
        raise _refuse("omm_number_format", key, f"is {number}, not a whole number")
    if not 0 <= number <= LARGEST_NORAD_CAT_ID:
        limits = f"must be between 0 and {LARGEST_NORAD_CAT_ID}"
        raise _refuse("value_out_of_range", key, limits)
    return int(number)


def _epoch(value: object) -> datetime:
    match = _EPOCH.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None:
        detail = f"is {_shown(value)}, must look like 2022-08-15T19:30:40.879296"
        raise _refuse("omm_epoch", "EPOCH", detail)
    part = {name: int(text) for name, text in match.groupdict().items() if text}
    decimals = match["decimals"] or ""
    microseconds = round(int(decimals or "0") * 10**6 / 10 ** len(decimals))
    try:
        day = datetime(part["year"], part.get("month", 1), part.get("day", 1), tzinfo=UTC)
        day += timedelta(days=part.get("day_of_year", 1) - 1)
        second = day.replace(hour=part["hour"], minute=part["minute"], second=part["second"])
        instant = second + timedelta(microseconds=microseconds)
    except (ValueError, OverflowError) as error:
        raise _refuse(
            "omm_epoch", "EPOCH", f"is {_shown(value)}, which is not a valid instant"
        ) from error
    if day.year != part["year"]:
        raise _refuse("omm_epoch", "EPOCH", f"is {_shown(value)}, which is not a day of that year")
    return instant
