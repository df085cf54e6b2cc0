"""Orbits that flight dynamics gives as states over time, in place of mean elements."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Frame = Literal["TEME", "EME2000", "GCRF", "ITRF"]
Interpolation = Literal["LAGRANGE", "HERMITE"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EphemerisSegment:
    """States between which one interpolation rule holds.

    Attributes
    ----------
    interpolation, degree
        Of the polynomials; LINEAR is LAGRANGE of degree 1.
    first
        Instant of the first state, in UTC.
    start, stop
        The span within which the segment may be used.
    t_s
        Seconds since ``first``, ascending. Shape ``(n,)``.
    position_km, velocity_km_s
        In ``frame``; Earth-fixed velocities are relative to the rotating Earth. Shape ``(n, 3)``.
    """

    frame: Frame
    interpolation: Interpolation
    degree: int
    first: datetime
    start: datetime
    stop: datetime
    t_s: Floats
    position_km: Floats
    velocity_km_s: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrbitEphemeris:
    """The states of one object, as a CCSDS Orbit Ephemeris Message gives them.

    Attributes
    ----------
    segments
        In order of time.
    semi_major_axis_km, eccentricity, period_s
        Osculating, at the first state.
    """

    name: str | None
    object_id: str
    segments: tuple[EphemerisSegment, ...]
    semi_major_axis_km: float
    eccentricity: float
    period_s: float

    @property
    def norad_cat_id(self) -> int:
        """Always 0: messages of this kind have no catalogue number."""
        return 0

    @property
    def epoch(self) -> datetime:
        """First instant at which the states may be used."""
        return self.segments[0].start
