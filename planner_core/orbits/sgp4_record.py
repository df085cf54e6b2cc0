"""Element sets as SGP4 takes them: the only module that knows python-sgp4's units."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta

from sgp4.api import WGS72, Satrec

from planner_core.domain import OrbitElements

GRAVITY = "WGS72"
_LARGEST_SATNUM = 339_999  # python-sgp4 refuses more, even though SGP4 never uses it
_MIN_PER_RAD_DAY = 1440.0 / (2.0 * math.pi)  # rev/day over this is rad/min
_JD_1950 = 2433281.5  # 1949-12-31 00:00 UT, from which ``sgp4init`` counts days
_MIDNIGHT_1950 = datetime(1949, 12, 31, tzinfo=UTC)


def epoch_jd(epoch: datetime) -> tuple[float, float]:
    """Return the Julian date of an epoch: that of its midnight, and the fraction of the day.

    A TLE gives its epoch to 1e-8 day (864 microseconds). The fraction of such an epoch is
    exactly the number in the TLE, so that an OMM made from it gives the same record.
    """
    elapsed = epoch.astimezone(UTC) - _MIDNIGHT_1950
    fraction = (elapsed - timedelta(days=elapsed.days)) / timedelta(days=1)
    as_tle = round(fraction, 8)
    if abs(as_tle - fraction) * 86400e6 <= 0.51:
        fraction = as_tle
    return _JD_1950 + elapsed.days, fraction


def satrec(elements: OrbitElements) -> Satrec:
    """Return the SGP4 record of an element set (gravity WGS72, improved mode).

    Numbers are converted in the order in which python-sgp4 converts those of a TLE, so
    that records made from the same TLE give the same positions to the last bit.
    """
    midnight_jd, fraction = epoch_jd(elements.epoch)
    record = Satrec()
    record.sgp4init(
        WGS72,
        "i",
        elements.norad_cat_id if 0 <= elements.norad_cat_id <= _LARGEST_SATNUM else 0,
        (midnight_jd + fraction) - _JD_1950,
        elements.bstar,
        elements.mean_motion_dot / (_MIN_PER_RAD_DAY * 1440.0),
        elements.mean_motion_ddot / (_MIN_PER_RAD_DAY * 1440.0 * 1440.0),
        elements.eccentricity,
        math.radians(elements.arg_perigee_deg),
        math.radians(elements.inclination_deg),
        math.radians(elements.mean_anomaly_deg),
        elements.mean_motion_rev_day / _MIN_PER_RAD_DAY,
        math.radians(elements.raan_deg),
    )
    # The sum above is good to 20 microseconds: enough for sun and moon, not for propagation.
    record.jdsatepoch, record.jdsatepochF = midnight_jd, fraction
    return record
