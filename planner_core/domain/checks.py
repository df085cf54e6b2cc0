"""Checks that the types of the domain make on themselves when they are created."""

from __future__ import annotations

import math
from typing import Final, Protocol

from planner_core.errors import InvalidScenario

_LONGEST_SENSOR_TYPE: Final = 100


class LightLimits(Protocol):
    """Limits of sun and local time, which sensors and targets share."""

    @property
    def sun_elevation_min_deg(self) -> float | None:
        """Lowest elevation of the sun, as the target sees it."""

    @property
    def sun_elevation_max_deg(self) -> float | None:
        """Highest elevation of the sun."""

    @property
    def local_time_from_h(self) -> float | None:
        """Start of the span of local solar time."""

    @property
    def local_time_to_h(self) -> float | None:
        """End of the span of local solar time."""


def require(condition: bool, where: str, message: str) -> None:
    """Raise ``InvalidScenario`` at a field unless the condition holds."""
    if not condition:
        raise InvalidScenario("value_out_of_range", f"{where}: {message}", pointer="/" + where)


def make_real(owner: object, *names: str) -> None:
    """Convert integers in these fields of a frozen object to floats.

    To a kernel they are another type, for which it is compiled anew. A recursive kernel compiled
    for them crashes the process when Numba loads it from disk.
    """
    for name in names:
        value = getattr(owner, name)
        if value is not None:
            object.__setattr__(owner, name, float(value))


def require_finite(owner: object, *names: str) -> None:
    """Check that these fields are finite numbers, or None."""
    for name in names:
        value = getattr(owner, name)
        if value is not None:
            require(math.isfinite(value), name, "must be a finite number")


def check_light(limits: LightLimits) -> None:
    """Check the limits of sun and local time that sensors and targets share."""
    lowest, highest = limits.sun_elevation_min_deg, limits.sun_elevation_max_deg
    for name, value in (("sun_elevation_min_deg", lowest), ("sun_elevation_max_deg", highest)):
        require(value is None or -90 <= value <= 90, name, "must be between -90 and 90")
    require(
        lowest is None or highest is None or lowest <= highest,
        "sun_elevation_max_deg",
        "must not be below sun_elevation_min_deg",
    )
    begin, end = limits.local_time_from_h, limits.local_time_to_h
    for name, hour in (("local_time_from_h", begin), ("local_time_to_h", end)):
        require(hour is None or 0 <= hour <= 24, name, "must be between 0 and 24")
    require(
        (begin is None) == (end is None) and (begin is None or begin != end),
        "local_time_to_h",
        "needs a different local_time_from_h, and vice versa",
    )


def check_sun_exclusion(angle_deg: float | None) -> None:
    """Check the least angle between boresight and sun."""
    require(
        angle_deg is None or 0 <= angle_deg <= 180,
        "sun_exclusion_deg",
        "must be between 0 and 180, or null for no limit",
    )


def check_sensor_type(sensor_type: str | None) -> None:
    """Check the name of a type of sensor."""
    require(
        sensor_type is None
        or (0 < len(sensor_type) <= _LONGEST_SENSOR_TYPE and sensor_type.isprintable()),
        "sensor_type",
        f"must be 1 to {_LONGEST_SENSOR_TYPE} printable characters, or null for none",
    )


def check_downlink(knots: tuple[tuple[float, float], ...]) -> None:
    """Check the knots of a downlink's rate: elevations ascend, rates are magnitudes."""
    before_deg = -math.inf
    for row, (elevation_deg, per_s) in enumerate(knots):
        where = f"downlink_by_elevation/{row}"
        require(0.0 <= elevation_deg <= 90.0, where, "the elevation must be between 0 and 90")
        require(
            elevation_deg > before_deg, where, "the elevation must be greater than the one before"
        )
        require(math.isfinite(per_s) and per_s >= 0.0, where, "the rate must be 0 or more")
        before_deg = elevation_deg
