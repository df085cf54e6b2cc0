"""Limits on the values of an element set, whatever format it came in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import UTC, datetime

from planner_core.domain import Orbit, OrbitElements
from planner_core.errors import Fault, InvalidElements

LARGEST_NORAD_CAT_ID = 999_999_999
LONGEST_TEXT = 200
MOST_SETS = 100_000
"""In one file; everything in orbit is about a third of this."""
# The largest drag term or derivative that a TLE can express; no real one comes near it.
_LARGEST_RATE = 1e9
_FIRST_YEAR, _LAST_YEAR = 1957, 2199


def require_in_range(elements: OrbitElements, pointers: Mapping[str, str]) -> None:
    """Refuse an element set that no orbit about the Earth can have.

    Parameters
    ----------
    elements
        What was read.
    pointers
        Where each attribute stood, as a JSON pointer; attributes not named are not checked.

    Raises
    ------
    InvalidElements
        ``value_out_of_range`` for the first value outside its limits.
    """
    for name, (is_fine, limits) in _CHECKS.items():
        value = getattr(elements, name)
        if name in pointers and not (math.isfinite(value) and is_fine(value)):
            raise InvalidElements(
                "value_out_of_range", f"{name} is {value}, {limits}", pointer=pointers[name]
            )
    year = elements.epoch.astimezone(UTC).year
    if not _FIRST_YEAR <= year <= _LAST_YEAR:
        detail = f"epoch is in {year}, must be between {_FIRST_YEAR} and {_LAST_YEAR}"
        raise InvalidElements("value_out_of_range", detail, pointer=pointers["epoch"])


def too_many_sets() -> Fault:
    """Return the fault of a file that is refused for its size."""
    detail = f"The file holds more than {MOST_SETS} element sets; split it"
    return Fault("too_many_rows", detail)


def is_plain_text(text: str) -> bool:
    """Return whether a name can be stored and shown: printable, and not too long."""
    return len(text) <= LONGEST_TEXT and text.isprintable()


def epoch_key(elements: Orbit) -> tuple[int | str, datetime]:
    """Return the key that identifies an element set: its satellite and its epoch.

    Number 0 means "not catalogued"; such satellites are identified by name or object id.
    """
    return (elements.norad_cat_id or elements.name or elements.object_id, elements.epoch)


def _is_angle(value: float) -> bool:
    return -360.0 <= value <= 360.0


def _is_rate(value: float) -> bool:
    return abs(value) < _LARGEST_RATE


_ANGLE = (_is_angle, "must be between -360 and 360")
_RATE = (_is_rate, "must be smaller than 1e9 in magnitude")
_CHECKS: dict[str, tuple[Callable[[float], bool], str]] = {
    "mean_motion_rev_day": (lambda n: 0.0 < n < 20.0, "must be above 0 and below 20"),
    "eccentricity": (lambda e: 0.0 <= e < 1.0, "must be at least 0 and below 1"),
    "inclination_deg": (lambda i: 0.0 <= i <= 180.0, "must be between 0 and 180"),
    "raan_deg": _ANGLE,
    "arg_perigee_deg": _ANGLE,
    "mean_anomaly_deg": _ANGLE,
    "bstar": _RATE,
    "mean_motion_dot": _RATE,
    "mean_motion_ddot": _RATE,
}
