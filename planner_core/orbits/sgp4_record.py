"""Element sets as SGP4 takes them: the only place that knows python-sgp4's units."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta

from sgp4.api import WGS72, Satrec

from planner_core.domain import OrbitElements

GRAVITY = "WGS72"
_LARGEST_SATNUM = 339_999  # python-sgp4 refuses more, even though SGP4 never uses it
_RAD_MIN_PER_REV_DAY = 2.0 * math.pi / 1440.0


def epoch_days_1950(epoch: datetime) -> float:
    """Return days from 1949-12-31 00:00 UT, as ``sgp4init`` counts them.

    A TLE gives its epoch to 1e-8 day (864 microseconds), an OMM made from it to the
    microsecond. Where the instant is such a TLE epoch, it is rounded back to it, so that
    both forms give the same record to the last bit.
    """
    elapsed = epoch.astimezone(UTC) - datetime(1949, 12, 31, tzinfo=UTC)
    fraction = (elapsed - timedelta(days=elapsed.days)) / timedelta(days=1)
    as_tle = round(fraction, 8)
    if abs(as_tle - fraction) * 86400e6 <= 0.51:
        fraction = as_tle
    return elapsed.days + fraction


def satrec(elements: OrbitElements) -> Satrec:
    """Return the SGP4 record of an element set (gravity WGS72, improved mode)."""
    record = Satrec()
    record.sgp4init(
        WGS72,
        "i",
        elements.norad_cat_id if 0 <= elements.norad_cat_id <= _LARGEST_SATNUM else 0,
        epoch_days_1950(elements.epoch),
        elements.bstar,
        elements.mean_motion_dot * _RAD_MIN_PER_REV_DAY / 1440.0,
        elements.mean_motion_ddot * _RAD_MIN_PER_REV_DAY / 1440.0**2,
        elements.eccentricity,
        math.radians(elements.arg_perigee_deg),
        math.radians(elements.inclination_deg),
        math.radians(elements.mean_anomaly_deg),
        elements.mean_motion_rev_day * _RAD_MIN_PER_REV_DAY,
        math.radians(elements.raan_deg),
    )
    return record
