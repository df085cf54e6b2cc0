"""How good images are."""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner_core.domain.checks import require

Curve = tuple[tuple[float, float], ...]
"""Knots of an angle in degrees and a value, in ascending order; linear between, constant beyond."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """How good an image is, from 0 to 1, by how it is taken: the product of all curves.

    Angles are those at the middle of the collect. A curve without knots is 1 everywhere.

    Attributes
    ----------
    off_nadir_deg
        At the satellite.
    sun_elevation_deg
        At the target.
    """

    off_nadir_deg: Curve = ()
    sun_elevation_deg: Curve = ()

    def __post_init__(self) -> None:
        _check_curve("off_nadir_deg", self.off_nadir_deg, 0.0, 90.0)
        _check_curve("sun_elevation_deg", self.sun_elevation_deg, -90.0, 90.0)

    def __bool__(self) -> bool:
        """Return whether it makes any difference between images."""
        return bool(self.off_nadir_deg or self.sun_elevation_deg)


def _check_curve(name: str, knots: Curve, lowest_deg: float, highest_deg: float) -> None:
    before_deg = -math.inf
    for row, (angle_deg, value) in enumerate(knots):
        where = f"quality/{name}/{row}"
        require(
            lowest_deg <= angle_deg <= highest_deg,
            where,
            f"the angle must be between {lowest_deg:g} and {highest_deg:g}",
        )
        require(angle_deg > before_deg, where, "the angle must be greater than the one before")
        require(0.0 <= value <= 1.0, where, "the value must be between 0 and 1")
        before_deg = angle_deg
