"""AOS and LOS equal those of contacts; TCA and conflicts are compared with plain searches."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from planner_core.access.limits import Limits
from planner_core.access.station_passes import StationPass, overlapping, station_passes
from planner_core.access.windows import find_accesses
from planner_core.domain import GroundStation, Horizon
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites
from tests.geometry import Ground, SkyfieldTable, orbit_from_omm, satellite
from tests.missions import PAPER_ORBIT

START = datetime(2019, 1, 1, tzinfo=UTC)
DAY = Horizon(start=START, end=START + timedelta(days=1))
STATIONS = (
    GroundStation(id="svalbard", name="Svalbard", lat_deg=78.2, lon_deg=15.4),
    GroundStation(
        id="bern", name="Bern", lat_deg=46.9, lon_deg=7.4, min_elevation_deg=5.0,
        elevation_mask=((0.0, 8.0), (90.0, 8.0), (91.0, 80.0), (270.0, 80.0), (271.0, 8.0)),
    ),
    GroundStation(id="equator", name="Equator", lat_deg=0.0, lon_deg=100.0, min_elevation_deg=10.0),
)  # fmt: skip
ORBITS = (
    PAPER_ORBIT,
    PAPER_ORBIT | {"NORAD_CAT_ID": 2, "INCLINATION": 51.6, "MEAN_MOTION": 14.5},
    # An eccentric orbit of twelve hours: the elevation may rise more than once in one window.
    PAPER_ORBIT
    | {"NORAD_CAT_ID": 3, "INCLINATION": 63.4, "MEAN_MOTION": 2.0056, "ECCENTRICITY": 0.72},
)
SATELLITES = tuple(
    satellite(orbit_from_omm(orbit), name=f"EYE {number}") for number, orbit in enumerate(ORBITS)
)


@pytest.fixture(scope="module")
def passes() -> list[StationPass]:
    return station_passes(SATELLITES, STATIONS, DAY)


def test_passes_are_the_accesses(passes: list[StationPass]) -> None:
    wanted = set()
    for index, one in enumerate(SATELLITES):
        found = find_accesses(propagate(one, DAY), Sites.of(STATIONS), Limits.of_stations(STATIONS))
        wanted |= {
            (index, int(site), float(start_s), float(end_s))
            for site, start_s, end_s in zip(found.site, found.start_s, found.end_s, strict=True)
        }
    assert {(one.satellite, one.station, one.aos_s, one.los_s) for one in passes} == wanted
    assert {one.station for one in passes} == {0, 1, 2}
    assert [one.aos_s for one in passes] == sorted(one.aos_s for one in passes)


def test_the_highest_point_is_where_skyfield_has_it_second_by_second(
    passes: list[StationPass],
) -> None:
    for index, orbit in enumerate(ORBITS):
        table = SkyfieldTable(orbit_from_omm(orbit), DAY)
        for one in (each for each in passes if each.satellite == index):
            station = STATIONS[one.station]
            ground = Ground.at(station.lat_deg, station.lon_deg)
            t_s = np.arange(np.ceil(one.aos_s), one.los_s)
            heights = np.append(elevation_deg(table, ground, t_s), -90.0)
            at_tca = float(elevation_deg(table, ground, np.array([one.tca_s]))[0])
            assert one.aos_s <= one.tca_s <= one.los_s
            assert at_tca == pytest.approx(one.max_elevation_deg, abs=2e-3)
            assert heights.max() <= at_tca + 2e-4


def elevation_deg(table: SkyfieldTable, ground: Ground, t_s: np.ndarray) -> np.ndarray:
    sight = table.position_m(t_s) - ground.position_m
    sine = sight @ ground.up / np.linalg.norm(sight, axis=1)
    return np.asarray(np.degrees(np.arcsin(sine)))


def test_a_mask_that_cuts_the_rise_off_leaves_the_highest_point_at_an_end(
    passes: list[StationPass],
) -> None:
    cut = [one for one in passes if one.station == 1 and one.tca_s in (one.aos_s, one.los_s)]
    assert cut


def test_conflicts_are_all_pairs_that_overlap_at_a_station(passes: list[StationPass]) -> None:
    others = overlapping(passes)
    wanted = [
        [
            j
            for j, other in enumerate(passes)
            if j != i
            and other.station == one.station
            and other.aos_s < one.los_s
            and one.aos_s < other.los_s
        ]
        for i, one in enumerate(passes)
    ]
    assert others == wanted
    assert any(wanted)


def test_passes_that_touch_do_not_overlap(passes: list[StationPass]) -> None:
    def over(aos_s: float, los_s: float) -> StationPass:
        return StationPass(
            satellite=0, station=0, aos_s=aos_s, tca_s=aos_s, los_s=los_s, max_elevation_deg=1.0,
            aos_cut=False, los_cut=False,
        )  # fmt: skip

    assert overlapping([over(0.0, 10.0), over(10.0, 20.0), over(19.0, 30.0)]) == [[], [2], [1]]


def test_no_station_has_no_pass() -> None:
    assert station_passes(SATELLITES, (), DAY) == []
