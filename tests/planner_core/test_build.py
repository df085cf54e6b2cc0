"""Building a problem: order, completeness, storage, reasons, warnings, cancellation."""

from __future__ import annotations

import csv
import io
import zipfile
from dataclasses import fields, replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import (
    ScenarioOpportunities,
    compute_opportunities,
    view_at,
)
from planner_core.budget import Budget, Progress
from planner_core.build import build_problem
from planner_core.domain import (
    GroundStation,
    Horizon,
    Satellite,
    Scenario,
    Sensor,
    Target,
    mean_elements,
)
from planner_core.errors import Cancelled, InvalidScenario, PropagationFailed
from planner_core.orbits.checks import check_element_age, check_propagation, orbit_warnings
from planner_core.orbits.sites import View
from planner_core.problem import (
    ACCESS_FOUND,
    ACCESS_TOO_SHORT,
    COLLECT,
    CONTACT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    Opportunities,
)
from tests.geometry import (
    YEAR_2019,
    Ground,
    SkyfieldPath,
    angle_deg,
    elevation_deg,
    hours,
    off_nadir_deg,
    orbit,
    satellite,
)

STATIONS = (
    GroundStation(id="svalbard", name="Svalbard", lat_deg=78.2298391, lon_deg=15.3924483),
    GroundStation(id="troll", name="Troll", lat_deg=-72.0167, lon_deg=2.5333),
)


def targets(count: int) -> tuple[Target, ...]:
    rng = np.random.default_rng(3)
    lat = rng.uniform(-56.0, 81.0, count)  # as the Landsat grid: more towards the poles
    lon = rng.uniform(-180.0, 180.0, count)
    return tuple(
        Target(id=f"t{i}", lat_deg=float(lat[i]), lon_deg=float(lon[i])) for i in range(count)
    )


def scenario(
    *,
    span_h: float = 24.0,
    satellites: tuple[Satellite, ...] | None = None,
    num_targets: int = 60,
    use_resources: bool = True,
    spacing_s: float | None = None,
) -> Scenario:
    return Scenario(
        horizon=hours(span_h),
        satellites=satellites or (satellite(),),
        targets=targets(num_targets),
        ground_stations=STATIONS,
        use_resources=use_resources,
        collect_spacing_s=spacing_s,
    )


def two_satellites() -> tuple[Satellite, ...]:
    return satellite(name="a"), satellite(orbit(raan_deg=40.0, inclination_deg=97.5), name="b")


@pytest.fixture(scope="module")
def computed() -> ScenarioOpportunities:
    return compute_opportunities(scenario(satellites=two_satellites(), spacing_s=20.0), Budget())


def test_the_paper_scenario_has_its_thirty_contacts() -> None:
    """A published prototype of the same orbit and stations counts 30, mean 428 s."""
    table = compute_opportunities(scenario(num_targets=0), Budget()).opportunities
    assert table.kind.tolist() == [CONTACT] * 30
    assert np.mean(table.end_s - table.start_s) == pytest.approx(428.0, abs=1.0)


def test_real_land_targets_offer_about_four_collects_each(shared_data: Path) -> None:
    """Prototypes of the same orbit found 4,034 to 4,122 collects for three sets of 1,000."""
    with (shared_data / "targets/landsat_1200.csv").open() as file:
        rows = list(csv.DictReader(file))[:1000]
    real = tuple(
        Target(id=str(i), lat_deg=float(row["lat"]), lon_deg=float(row["lon"]))
        for i, row in enumerate(rows)
    )
    asked = replace(scenario(use_resources=False), targets=real)
    found = compute_opportunities(asked, Budget())
    assert 3900 < len(found.opportunities) < 4200
    assert 910 < np.count_nonzero(found.target_access == ACCESS_FOUND) < 945


def test_rows_are_in_the_order_of_the_plan_model(computed: ScenarioOpportunities) -> None:
    table = computed.opportunities
    asked = scenario(satellites=two_satellites())
    ids = [
        (asked.targets[site].id if kind == COLLECT else asked.ground_stations[site].id)
        for kind, site in zip(table.kind, table.site, strict=True)
    ]
    keys = list(zip(table.start_s, table.end_s, table.satellite, table.kind, ids, strict=True))
    assert keys == sorted(keys)
    assert len(keys) > 1000


def test_ties_are_ordered_by_place_id_as_text() -> None:
    """A satellite that sees all sites all day: every collect starts at the same time."""
    fixed = satellite(orbit(mean_motion_rev_day=1.0027379, eccentricity=1e-5, inclination_deg=0.01))
    lon = float(
        np.degrees(
            np.arctan2(
                *SkyfieldPath(mean_elements(fixed.orbit), hours(1)).position_m(np.zeros(1))[
                    0, 1::-1
                ]
            )
        )
    )
    sites = tuple(Target(id=name, lat_deg=5.0, lon_deg=lon) for name in ("10", "9", "1", "a"))
    asked = replace(
        scenario(span_h=1.0, satellites=(replace(fixed, sensor=Sensor(off_nadir_min_deg=0.0)),)),
        targets=sites,
        use_resources=False,
    )
    table = compute_opportunities(asked, Budget()).opportunities
    assert [sites[i].id for i in table.site] == ["1", "10", "9", "a"]


def test_tasks_lie_in_their_accesses_on_whole_milliseconds(
    computed: ScenarioOpportunities,
) -> None:
    table = computed.opportunities
    assert (table.access_start_s <= table.start_s).all()
    assert (table.end_s <= table.access_end_s).all()
    for column in (table.start_s, table.end_s, table.access_start_s, table.access_end_s):
        assert (np.round(column * 1000.0) / 1000.0 == column).all()
    collects = table.kind == COLLECT
    assert np.allclose((table.end_s - table.start_s)[collects], 30.0)
    is_whole = (table.start_s == table.access_start_s) & (table.end_s == table.access_end_s)
    assert set(table.access[~collects & is_whole]) == set(table.access[~collects])


def test_an_access_number_belongs_to_one_access(computed: ScenarioOpportunities) -> None:
    table = computed.opportunities
    by_number: dict[int, tuple[int, ...]] = {}
    columns = zip(
        table.access, table.satellite, table.kind, table.site, table.access_start_s, strict=True
    )
    for number, *rest in columns:
        assert by_number.setdefault(number, tuple(rest)) == tuple(rest)
    assert len(set(by_number.values())) == len(by_number)


def test_angles_agree_with_skyfield(computed: ScenarioOpportunities) -> None:
    asked = scenario(satellites=two_satellites())
    table = computed.opportunities
    rng = np.random.default_rng(1)
    paths = [SkyfieldPath(mean_elements(s.orbit), asked.horizon) for s in asked.satellites]
    for i in rng.choice(len(table), 60, replace=False):
        site = (asked.targets if table.kind[i] == COLLECT else asked.ground_stations)[table.site[i]]
        ground = Ground.at(site.lat_deg, site.lon_deg)
        middle = np.array([0.5 * (table.start_s[i] + table.end_s[i])])
        position = paths[table.satellite[i]].position_m(middle)
        assert table.elevation_deg[i] == pytest.approx(elevation_deg(position, ground)[0], abs=3e-3)
        assert table.off_nadir_deg[i] == pytest.approx(
            off_nadir_deg(position, ground, "geodetic")[0], abs=3e-3
        )
        assert table.range_m[i] == pytest.approx(
            np.linalg.norm(position - ground.position_m), abs=30.0
        )


def test_the_view_at_any_instant_can_be_asked_for(computed: ScenarioOpportunities) -> None:
    """At an opportunity's middle it equals the table; contacts begin and end at 5 deg elevation."""
    asked = scenario(satellites=two_satellites(), spacing_s=20.0)
    table = computed.opportunities
    rows = np.arange(0, len(table), 7)
    middle = view_at(asked, table, rows, 0.5 * (table.start_s[rows] + table.end_s[rows]))
    for field in fields(View):
        in_table = getattr(table, field.name)[rows]
        assert np.allclose(getattr(middle, field.name), in_table, rtol=1e-6, atol=1e-4)
    whole = (table.access_start_s > 0.0) & (table.access_end_s < 86400.0)
    whole &= (table.start_s == table.access_start_s) & (table.end_s == table.access_end_s)
    contacts = np.flatnonzero((table.kind == CONTACT) & whole)
    for instants in (table.start_s, table.end_s):
        edge = view_at(asked, table, contacts, instants[contacts])
        assert edge.elevation_deg == pytest.approx(np.full(len(contacts), 5.0), abs=1e-3)


def test_lines_of_sight_are_inertial_unit_vectors(computed: ScenarioOpportunities) -> None:
    """During a contact they turn as far as in the pass; tracking keeps them on the station."""
    table = computed.opportunities
    for sight in (table.los_start, table.los_end):
        assert np.allclose(np.linalg.norm(sight, axis=1), 1.0, atol=1e-12)
    turn_deg = angle_deg(table.los_start, table.los_end)
    collects = table.kind == COLLECT
    assert (turn_deg[collects] > 0.5).all()
    assert (turn_deg[collects] < 30.0).all()
    assert turn_deg[~collects].max() > 60.0


def test_storage_gives_back_every_bit(computed: ScenarioOpportunities) -> None:
    again = ScenarioOpportunities.from_bytes(computed.to_bytes())
    for field in fields(Opportunities):
        before = getattr(computed.opportunities, field.name)
        after = getattr(again.opportunities, field.name)
        assert before.dtype == after.dtype
        assert before.tobytes() == after.tobytes()
    assert again.target_access.tobytes() == computed.target_access.tobytes()
    assert again.warnings == computed.warnings
    for one, other in zip(computed.sunlight, again.sunlight, strict=True):
        assert one.enter_s.tobytes() == other.enter_s.tobytes()
        assert one.exit_s.tobytes() == other.exit_s.tobytes()
    assert computed.to_bytes() == again.to_bytes()


def test_columns_are_compressed_where_that_makes_them_smaller(
    computed: ScenarioOpportunities,
) -> None:
    with zipfile.ZipFile(io.BytesIO(computed.to_bytes())) as archive:
        methods = {member.filename: member.compress_type for member in archive.infolist()}
    assert methods["satellite.npy"] == methods["start_s.npy"] == zipfile.ZIP_DEFLATED
    assert methods["los_rate_end.npy"] == zipfile.ZIP_DEFLATED  # all zeros
    assert methods["los_start.npy"] == methods["azimuth_deg.npy"] == zipfile.ZIP_STORED


def test_a_problem_has_every_row_once_and_its_satellites_rows(
    computed: ScenarioOpportunities,
) -> None:
    problem = build_problem(scenario(satellites=two_satellites()), computed, Budget())
    rows = np.concatenate([part.rows for part in problem.satellites])
    assert sorted(rows.tolist()) == list(range(len(computed.opportunities)))
    assert problem.target_ids[0] == "t0"
    assert problem.station_ids == ("svalbard", "troll")
    assert problem.horizon_s == 86400.0


def test_each_target_without_collects_has_its_reason() -> None:
    """Equatorial orbit, 490 km up: the horizon is 22 deg of latitude away."""
    low = satellite(orbit(inclination_deg=0.01))
    sites = {
        "pole": Target(id="pole", lat_deg=90.0, lon_deg=0.0),
        "edge": Target(id="edge", lat_deg=20.0, lon_deg=0.0),
        "long": Target(id="long", lat_deg=3.0, lon_deg=0.0, collect_s=3000.0),
        "good": Target(id="good", lat_deg=3.0, lon_deg=0.0),
    }
    asked = replace(scenario(satellites=(low,)), targets=tuple(sites.values()), use_resources=False)
    found = compute_opportunities(asked, Budget())
    assert found.target_access.tolist() == [
        NEVER_VISIBLE,
        OUTSIDE_LIMITS,
        ACCESS_TOO_SHORT,
        ACCESS_FOUND,
    ]
    polar = replace(asked, satellites=(low, satellite(name="polar")))
    assert compute_opportunities(polar, Budget()).target_access[0] == ACCESS_FOUND


def test_contacts_exist_only_with_resources() -> None:
    with_resources = compute_opportunities(scenario(), Budget()).opportunities
    without = compute_opportunities(scenario(use_resources=False), Budget()).opportunities
    assert CONTACT in with_resources.kind
    assert CONTACT not in without.kind


def test_eclipses_are_known_of_all_and_count_only_for_who_asks() -> None:
    plain = satellite()
    aware = replace(plain, id="aware", resources=replace(plain.resources, eclipse_aware=True))
    asked = scenario(satellites=(plain, aware))
    found = compute_opportunities(asked, Budget())
    problem = build_problem(asked, found, Budget())
    counted = problem.satellites[0].sunlight
    assert (counted.enter_s.tolist(), counted.exit_s.tolist()) == ([0.0], [86400.0])
    assert problem.satellites[1].sunlight is found.sunlight[1]
    lit = found.sunlight
    assert lit[0].enter_s.tolist() == lit[1].enter_s.tolist()
    assert len(lit[1].enter_s) >= 15
    sunlit_s = float((lit[1].exit_s - lit[1].enter_s).sum())
    assert 0.6 < sunlit_s / 86400.0 < 0.9


def test_progress_rises_and_a_cancelled_search_stops() -> None:
    seen: list[Progress] = []
    budget = Budget(report=seen.append)
    asked = scenario(satellites=two_satellites())
    build_problem(asked, compute_opportunities(asked, budget), budget)
    assert [p.fraction for p in seen if p.phase == "access"] == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert [p.fraction for p in seen if p.phase == "compile"] == [0.0, 0.5, 1.0]
    budget.cancel()
    with pytest.raises(Cancelled):
        compute_opportunities(asked, budget)


def test_a_failing_orbit_is_named_before_any_planning() -> None:
    falling = satellite(orbit(mean_motion_rev_day=16.4, bstar=0.1), name="FALLEN")
    asked = scenario(span_h=480.0, satellites=(satellite(), falling), num_targets=1)
    with pytest.raises(PropagationFailed, match="FALLEN"):
        check_propagation(asked)


def test_old_element_sets_are_warned_of() -> None:
    def warnings(days_before: float, mean_motion: float = 15.2) -> tuple[str, ...]:
        start = YEAR_2019 + timedelta(days=days_before)
        one = satellite(orbit(mean_motion_rev_day=mean_motion), name="OLD")
        asked = replace(
            scenario(satellites=(one,)),
            horizon=Horizon(start=start, end=start + timedelta(days=1)),
        )
        return orbit_warnings(asked)

    assert warnings(1.9) == ()
    assert "OLD" in warnings(2.1)[0]
    assert "3.1 days" in warnings(2.1)[0]
    assert "after the horizon" in warnings(-5.0)[0]
    assert warnings(10.0, mean_motion=1.0027) == ()


def test_a_horizon_outside_the_table_of_ut1_is_warned_of() -> None:
    start = YEAR_2019 + timedelta(days=30 * 365)
    asked = replace(
        scenario(satellites=(satellite(orbit(epoch=start)),)),
        horizon=Horizon(start=start, end=start + timedelta(days=1)),
    )
    assert "Earth's orientation" in orbit_warnings(asked)[0]
    assert orbit_warnings(scenario()) == ()


def test_very_old_element_sets_are_refused_unless_allowed() -> None:
    def aged(days: float, mean_motion: float = 15.2) -> Scenario:
        start = YEAR_2019 + timedelta(days=days)
        one = satellite(orbit(mean_motion_rev_day=mean_motion), name="OLD")
        return replace(
            scenario(satellites=(one,)),
            horizon=Horizon(start=start, end=start + timedelta(days=1)),
        )

    check_element_age(aged(28.9))
    check_element_age(aged(40.0, mean_motion=2.0))
    check_element_age(replace(aged(40.0), allow_old_elements=True))
    for days in (29.1, -31.0):
        with pytest.raises(InvalidScenario, match="OLD") as caught:
            check_element_age(aged(days))
        assert caught.value.code == "elements_too_old"
        assert caught.value.fault.pointer == "/satellites/0"
