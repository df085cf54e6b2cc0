"""The part of the Earth's orientation that no formula gives: UT1 and the pole, from a daily table.

The package ships the IERS table from 2000 on, with a year of predictions;
``planner_core/data/make_eop.py`` renews it. Outside the table its end values are held, which
``EarthOrientation.covers`` detects: a second of UT1 is 465 m at the equator, but UT1 is never
more than 0.9 s from UTC.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from planner_core.domain import Horizon
from planner_core.orbits.frames import ARCSEC_RAD, julian_date

Floats = npt.NDArray[np.float64]

_MJD_ZERO = 2_400_000.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EarthOrientation:
    """Daily values at 0 h UTC, ascending. Shape ``(n,)`` each.

    Attributes
    ----------
    mjd
        Modified Julian date.
    tai_utc_s, dut1_s
        TAI - UTC (whole leap seconds) and UT1 - UTC.
    xp_rad, yp_rad
        The pole.
    """

    mjd: Floats
    tai_utc_s: Floats
    dut1_s: Floats
    xp_rad: Floats
    yp_rad: Floats

    @classmethod
    def none(cls) -> EarthOrientation:
        """Return a table in which UT1 equals UTC and the pole does not move."""
        zero = np.zeros(1)
        return cls(mjd=zero, tai_utc_s=zero, dut1_s=zero, xp_rad=zero, yp_rad=zero)

    def at(self, jd_midnight: float, fraction: Floats) -> tuple[Floats, Floats, Floats]:
        """Return UT1 - UTC in seconds, and the pole in radians, at each instant.

        Parameters
        ----------
        jd_midnight, fraction
            Julian date in UTC: a day ending in .5, and the days since. ``fraction`` is ``(n,)``.
        """
        mjd = jd_midnight - _MJD_ZERO + fraction
        # UT1 - TAI is smooth; UT1 - UTC jumps at leap seconds, so it must not be interpolated
        # across midnight.
        ut1_tai_s = np.interp(mjd, self.mjd, self.dut1_s - self.tai_utc_s)
        row = np.clip(np.searchsorted(self.mjd, mjd, side="right") - 1, 0, len(self.mjd) - 1)
        return (
            np.asarray(ut1_tai_s + self.tai_utc_s[row]),
            np.asarray(np.interp(mjd, self.mjd, self.xp_rad)),
            np.asarray(np.interp(mjd, self.mjd, self.yp_rad)),
        )

    def tai_utc_at(self, jd_midnight: float, fraction: Floats) -> Floats:
        """Return TAI - UTC in seconds at each instant; parameters as those of ``at``."""
        mjd = jd_midnight - _MJD_ZERO + fraction
        row = np.clip(np.searchsorted(self.mjd, mjd, side="right") - 1, 0, len(self.mjd) - 1)
        return np.asarray(self.tai_utc_s[row])

    def covers(self, horizon: Horizon) -> bool:
        """Return whether the table covers the whole horizon."""
        first, last = (sum(julian_date(t)) - _MJD_ZERO for t in (horizon.start, horizon.end))
        return bool(self.mjd[0] <= first and last <= self.mjd[-1])


@cache
def shipped() -> EarthOrientation:
    """Return the table that comes with the package."""
    text = (files("planner_core") / "data" / "eop.csv").read_text()
    mjd, tai_utc_s, dut1_s, xp, yp = np.loadtxt(text.splitlines()[2:], delimiter=",").T.copy()
    return EarthOrientation(
        mjd=mjd,
        tai_utc_s=tai_utc_s,
        dut1_s=dut1_s,
        xp_rad=xp * ARCSEC_RAD,
        yp_rad=yp * ARCSEC_RAD,
    )
