"""The shipped table of UT1 and the pole: its values, its leap seconds, its ends."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from planner_core.domain import Horizon
from planner_core.orbits.earth_orientation import EarthOrientation, shipped
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.frames import ARCSEC_RAD, julian_date
from tests.geometry import hours, satellite


def dut1_s(instant: datetime) -> float:
    jd, fraction = julian_date(instant)
    return float(shipped().at(jd, np.array([fraction]))[0][0])


def test_a_day_of_the_table_has_the_published_values() -> None:
    """IERS Bulletin values for 2004-04-06, as Vallado's example quotes them."""
    jd, _ = julian_date(datetime(2004, 4, 6, tzinfo=UTC))
    dut1, xp, yp = shipped().at(jd, np.array([0.0]))
    assert dut1[0] == pytest.approx(-0.439962, abs=1e-4)
    assert xp[0] / ARCSEC_RAD == pytest.approx(-0.140682, abs=1e-3)
    assert yp[0] / ARCSEC_RAD == pytest.approx(0.333309, abs=1e-3)


def test_ut1_does_not_slide_towards_a_leap_second() -> None:
    """At the end of 2016, UT1 - UTC jumped from -0.41 s to +0.59 s at midnight."""
    midnight = datetime(2017, 1, 1, tzinfo=UTC)
    assert dut1_s(midnight - timedelta(hours=12)) == pytest.approx(-0.408, abs=0.002)
    assert dut1_s(midnight - timedelta(seconds=1)) == pytest.approx(-0.409, abs=0.002)
    assert dut1_s(midnight) == pytest.approx(0.591, abs=0.002)


def test_values_are_held_outside_the_table_and_it_says_so() -> None:
    late = datetime(2060, 1, 1, tzinfo=UTC)
    assert dut1_s(late) == pytest.approx(shipped().dut1_s[-1])
    assert abs(dut1_s(datetime(1990, 1, 1, tzinfo=UTC))) < 0.9
    day = timedelta(days=1)
    assert shipped().covers(hours(24))
    assert not shipped().covers(Horizon(start=late, end=late + day))
    assert not shipped().covers(
        Horizon(start=datetime(1999, 12, 31, tzinfo=UTC), end=datetime(2000, 1, 2, tzinfo=UTC))
    )


def test_another_orientation_turns_the_earth_by_its_ut1() -> None:
    """A whole second of UT1 is 15 arc seconds of longitude."""
    plain = propagate(satellite(), hours(1), EarthOrientation.none())
    ahead = propagate(
        satellite(),
        hours(1),
        EarthOrientation(
            mjd=np.zeros(1),
            tai_utc_s=np.zeros(1),
            dut1_s=np.ones(1),
            xp_rad=np.zeros(1),
            yp_rad=np.zeros(1),
        ),
    )
    turned = np.degrees(ahead.gmst_rad - plain.gmst_rad) * 3600.0
    assert turned == pytest.approx(15.041, abs=0.001)
