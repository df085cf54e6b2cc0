"""The compiled limits against the plain geometry, and their rates against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.domain import Target
from planner_core.orbits import crossings
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites, view
from tests.geometry import Floats, hours, orbit, satellite

PATH = propagate(satellite(orbit(eccentricity=0.02, inclination_deg=70.0)), hours(6))
ALL_CODES = [
    crossings.OFF_NADIR,
    crossings.ELEVATION,
    crossings.SUN_ELEVATION,
    crossings.LOCAL_TIME,
    crossings.OWN_LOCAL_TIME,
    crossings.LOOK_SIDE,
    crossings.HEADING,
    crossings.SUNLIT,
]
instants = st.floats(0.0, 21599.0)
latitudes = st.floats(-89.0, 89.0)
longitudes = st.floats(-180.0, 180.0)


def place_vectors(lat_deg: float, lon_deg: float) -> Floats:
    site = Sites.of([Target(id="t", lat_deg=lat_deg, lon_deg=lon_deg)])
    meridians = np.array([[0.6, 0.8, 0.0], [-1.0, 0.0, 0.0]])
    return np.concatenate([site.position_m, site.up, meridians])


def value_at(code: int, t_s: float, site: Floats) -> tuple[float, float]:
    k = min(int(t_s / PATH.step_s), len(PATH.node_s) - 2)
    cubic = PATH.track("geodetic")[k]
    return crossings.limit_value((code, 1.0, 0.0), cubic, site, t_s - k * PATH.step_s)


@given(instants, latitudes, longitudes)
def test_cosines_are_those_of_the_plain_geometry(t_s: float, lat: float, lon: float) -> None:
    t = np.array([t_s])
    plain = view(PATH, Sites.of([Target(id="t", lat_deg=lat, lon_deg=lon)]), t, "geodetic")
    site = place_vectors(lat, lon)
    for code, cosine in (
        (crossings.OFF_NADIR, np.cos(np.radians(plain.off_nadir_deg))),
        (crossings.ELEVATION, np.sin(np.radians(plain.elevation_deg))),
        (crossings.SUN_ELEVATION, np.sin(np.radians(plain.sun_elevation_deg))),
    ):
        assert value_at(code, t_s, site)[0] == pytest.approx(cosine[0], abs=1e-7)
    sunlit = value_at(crossings.SUNLIT, t_s, site)[0]
    assert abs(sunlit) < 1e-6 or (sunlit < 0.0) == plain.in_eclipse[0]


@pytest.mark.parametrize("code", ALL_CODES)
@given(instants, latitudes, longitudes)
def test_rates_are_those_of_the_values(code: int, t_s: float, lat: float, lon: float) -> None:
    within = t_s % PATH.step_s
    if not 0.2 < within < PATH.step_s - 0.2:
        return
    site = place_vectors(lat, lon)
    rate = value_at(code, t_s, site)[1]
    ahead, behind = value_at(code, t_s + 0.1, site)[0], value_at(code, t_s - 0.1, site)[0]
    assert rate == pytest.approx((ahead - behind) / 0.2, abs=1e-6)


@given(
    st.sampled_from(ALL_CODES),
    instants,
    latitudes,
    longitudes,
    st.floats(-0.99, 0.99),
    st.sampled_from([1.0, -1.0]),
)
def test_crossings_alternate_and_lie_on_the_threshold(
    code: int, t_s: float, lat: float, lon: float, threshold: float, sign: float
) -> None:
    k = min(int(t_s / PATH.step_s), len(PATH.node_s) - 2)
    cubic, site = PATH.track("geodetic")[k], place_vectors(lat, lon)
    limit = (code, sign, threshold)
    ends = [crossings.limit_value(limit, cubic, site, t) for t in (0.0, PATH.step_s)]
    found = np.empty(2)
    count = crossings.crossings(limit, cubic, site, PATH.step_s, ends[0], ends[1], found)
    assert count % 2 == ((ends[0][0] >= 0.0) != (ends[1][0] >= 0.0))
    for i in range(count):
        g, rate = crossings.limit_value(limit, cubic, site, float(found[i]))
        assert abs(g) <= max(abs(rate), 1e-6) * 1e-5
    assert count < 2 or 0.0 <= found[0] <= found[1] <= PATH.step_s
