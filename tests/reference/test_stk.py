"""Contacts agree with STK's: an engine that shares no code with ours or with Skyfield.

Fifteen passes over Svalbard on 2020-01-01, elevation 0, of a polar satellite given by a TLE:
STK's answer as brahe's test suite quotes it (tests/access/test_stk_validation.py, MIT). STK's
gravity constants and Earth orientation are not stated: hence the tolerance.
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from planner_core.access.limits import Limits
from planner_core.access.windows import find_accesses
from planner_core.domain import GroundStation
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites
from tests.geometry import hours, orbit, satellite

STK = """
00:19:59.776 00:30:39.293
01:55:16.331 02:06:35.211
03:30:13.201 03:41:55.695
05:04:54.081 05:16:30.793
06:39:19.083 06:50:22.980
08:13:24.935 08:23:45.935
09:47:07.465 09:57:01.775
11:20:29.103 11:30:31.919
12:53:45.755 13:04:25.698
14:27:20.723 14:38:41.177
16:01:32.672 16:13:14.011
17:36:30.019 17:48:02.441
19:12:09.407 19:23:08.406
20:48:14.588 20:58:36.775
22:24:20.109 22:34:30.297
"""


def seconds(clock: str) -> float:
    hour, minute, second = clock.split(":")
    return int(hour) * 3600.0 + int(minute) * 60.0 + float(second)


def test_contacts_agree_with_stk_within_15_ms_in_the_median() -> None:
    start = datetime(2020, 1, 1, tzinfo=UTC)
    elements = orbit(epoch=start, mean_motion_rev_day=15.21936719)
    svalbard = GroundStation(
        id="svalbard", name="", lat_deg=78.230306, lon_deg=15.396518, min_elevation_deg=0.0
    )
    path = propagate(satellite(elements), hours(24, start))
    found = find_accesses(path, Sites.of([svalbard]), Limits.of_stations([svalbard]))
    expected = np.array([seconds(clock) for clock in STK.split()]).reshape(-1, 2)
    assert len(found) == 15
    errors_s = np.stack([found.start_s, found.end_s], axis=1) - expected
    assert np.median(np.abs(errors_s)) <= 0.015
    assert np.abs(errors_s).max() <= 0.030
