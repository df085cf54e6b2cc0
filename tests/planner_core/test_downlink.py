"""Downlinks by elevation: volumes, parts of passes, and that all methods agree on them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.passes import Passes, _place_parts, downlinks_of, passes_of
from planner_core.access.scenario_opportunities import (
    ScenarioOpportunities,
    compute_opportunities,
)
from planner_core.access.windows import Accesses
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.certified.proofs.resource_bound import quick_bound, resource_value
from planner_core.certified.proofs.totals import totals_bound
from planner_core.domain import Dynamics, GroundStation, Resources, Scenario, Target, mean_elements
from planner_core.errors import InvalidScenario
from planner_core.mdp.resource_columns import STRICT, take
from planner_core.mdp.track import NO_TASK, compile_track
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites, azimuth_elevation_deg
from planner_core.pins import PinnedAction, Pins
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Downlinks,
    Opportunities,
    PassRate,
    PassRates,
    Problem,
    StationLinks,
)
from planner_core.problem.plan import Plan
from planner_core.referee.contact_flow import flow
from planner_core.referee.replay import replay
from planner_core.solvers.registry import SOLVERS, Certified, Milp
from tests.examples import examples
from tests.geometry import Ground, SkyfieldPath, elevation_deg, hours, orbit, satellite
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, Task, make_problem
from tests.planner_core.verdicts import require_accepted

SEEDS = st.integers(0, 10**6)
KNOTS = ((5.0, 0.001), (20.0, 0.002), (60.0, 0.005))
BY_ELEVATION = replace(Resources.paper(5668.7), downlink_by_elevation=KNOTS, downlink_per_s=0.005)
SVALBARD = GroundStation(id="sv", name="Svalbard", lat_deg=78.23, lon_deg=15.39)
TROLL = GroundStation(
    id="tr", name="Troll", lat_deg=-72.02, lon_deg=2.53, setup_s=60.0, downlink_gain=0.5
)


def _mission(**changes: Any) -> Scenario:
    flown = replace(satellite(orbit()), resources=BY_ELEVATION)
    return replace(
        Scenario(
            horizon=hours(6),
            satellites=(flown,),
            targets=(Target(id="a", lat_deg=10.0, lon_deg=20.0),),
            ground_stations=(SVALBARD, TROLL),
        ),
        **changes,
    )


def _built(scenario: Scenario) -> Problem:
    return build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())


def passes_problem(seed: int, dynamics: Dynamics = "physical") -> Problem:
    """Return a small crowded problem: passes with drawn rates, each whole and in two parts."""
    rng = np.random.default_rng(seed)
    tasks = []
    for _ in range(7):
        start_s = round(float(rng.uniform(0, 940)), 3)
        tasks.append(
            Task(kind=COLLECT, site=int(rng.integers(5)), start_s=start_s, end_s=start_s + 30.0,
                 angle_deg=float(rng.uniform(-55, 55)))
        )  # fmt: skip
    rates = []
    for number in range(2):
        start_s, length_s = round(float(rng.uniform(0, 850)), 3), float(rng.integers(60, 140))
        time_s = np.linspace(start_s, start_s + length_s, 12)
        # Never slower than the telemetry rate.
        rates.append(PassRate(time_s=time_s, per_s=rng.uniform(3e-5, 1 / 100, 12)))
        for cut in (0.0, 0.15, 0.3):
            begin_s, end_s = (round(start_s + part * length_s, 3) for part in (cut, 1.0 - cut))
            tasks.append(
                Task(kind=CONTACT, site=number % 2, start_s=begin_s, end_s=end_s,
                     angle_deg=float(rng.uniform(-60, 60)), access=number)
            )  # fmt: skip
    links = StationLinks(gain=rng.uniform(0.5, 2.0, 2), setup_s=rng.choice([0.0, 12.0, 25.0], 2))
    passes = {len(tasks) + number: rate for number, rate in enumerate(rates)}
    if rng.integers(4) == 0:
        passes = {}
    resources = replace(
        TIGHT,
        recorder_max_fraction=float(rng.choice([0.25037, 0.40037])),
        telemetry_per_s=float(rng.choice([0.0, 2e-5])),
    )
    return make_problem(
        tasks,
        num_targets=5,
        num_stations=2,
        dynamics=dynamics,
        resources=resources,
        downlinks=Downlinks(stations=links, passes=passes),
        rewards=[float(r) for r in rng.integers(1, 9, 5)],
    )


@given(seed=SEEDS)
def test_a_pass_adds_up_to_what_many_small_steps_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    time_s = np.sort(rng.uniform(0.0, 600.0, 20))
    rate = PassRate(time_s=time_s, per_s=rng.uniform(0.0, 1.0, 20))
    ends_s = np.sort(rng.uniform(time_s[0], time_s[-1], 2))
    middle_s = ends_s[0] + (np.arange(20_000) + 0.5) * (ends_s[1] - ends_s[0]) / 20_000
    steps = np.interp(middle_s, time_s, rate.per_s) * (ends_s[1] - ends_s[0]) / 20_000
    assert float(np.diff(rate.until(ends_s))[0]) == pytest.approx(steps.sum(), rel=1e-4, abs=1e-6)


@given(seed=SEEDS)
def test_an_amount_is_down_when_the_pass_says_so_and_not_before(seed: int) -> None:
    rng = np.random.default_rng(seed)
    time_s = np.sort(rng.uniform(0.0, 600.0, 20))
    # Nothing is downlinked between two instants without a rate.
    rate = PassRate(time_s=time_s, per_s=rng.uniform(0.0, 1.0, 20) * (rng.random(20) > 0.3))
    whole = float(rate.until(time_s[-1:])[0])
    amount = np.array([0.0, *rng.uniform(0.0, whole, 5), whole])
    when_s = rate.when(amount)
    assert rate.until(when_s) == pytest.approx(amount, abs=1e-9 * max(1.0, whole))
    later = when_s > time_s[0]
    before_s = np.maximum(when_s[later] - 0.01, time_s[0])
    assert np.all(rate.until(before_s) < amount[later])


def _drawn_rate(rng: np.random.Generator) -> PassRate:
    start_s, length_s = round(float(rng.uniform(0.0, 900.0)), 3), float(rng.uniform(0.5, 600.0))
    num = int(rng.integers(2, 40))
    # Nothing is downlinked between two instants without a rate.
    per_s = rng.uniform(0.0, 1.0, num) * (rng.random(num) > 0.2)
    return PassRate(time_s=np.linspace(start_s, start_s + length_s, num), per_s=per_s)


@given(seed=SEEDS)
def test_many_passes_at_once_say_what_each_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    each = [_drawn_rate(rng) for _ in range(rng.integers(0, 6))]
    joined = PassRates.joined(each)
    which = rng.integers(0, len(each), 30) if each else np.empty(0, dtype=np.int64)
    t_s = np.array([rng.uniform(each[i].time_s[0] - 5.0, each[i].time_s[-1] + 5.0) for i in which])
    down = [float(each[i].until(t)[0]) for i, t in zip(which, t_s[:, None], strict=True)]
    assert joined.until(which, t_s).tolist() == down
    when_s = [float(each[i].when(np.array([d]))[0]) for i, d in zip(which, down, strict=True)]
    assert joined.when(which, np.array(down)).tolist() == when_s
    assert [one.time_s.tolist() for one in joined.each()] == [one.time_s.tolist() for one in each]
    assert [one.per_s.tolist() for one in joined.each()] == [one.per_s.tolist() for one in each]


def _part_ms(rate: PassRate, culmination_s: float, setup_s: float, share: float) -> tuple[int, int]:
    first_s = float(rate.time_s[0]) + setup_s
    edges = rate.until(np.array([first_s, max(first_s, culmination_s), rate.time_s[-1]]))
    first, top, last = edges.tolist()
    cut_s = rate.when(np.array([top - share * (top - first), top + share * (last - top)]))
    start_s = max(float(cut_s[0]) - setup_s, float(rate.time_s[0]))
    return math.ceil(start_s * 1000), math.floor(float(cut_s[1]) * 1000)


def _halves_ms(rate: PassRate, setup_s: float) -> list[tuple[int, int]]:
    begin_s, end_s = float(rate.time_s[0]) + 2.0, float(rate.time_s[-1])
    first, last = rate.until(np.array([begin_s + setup_s, end_s])).tolist()
    middle_s = float(rate.when(np.array([0.5 * (first + last)]))[0])
    if middle_s - setup_s < begin_s + 2.0:
        return []
    spans_s = (begin_s, middle_s), (middle_s - setup_s, end_s)
    return [(math.ceil(a * 1000), math.floor(b * 1000)) for a, b in spans_s]


@given(seed=SEEDS, has_parts=st.booleans(), has_halves=st.booleans())
def test_parts_of_many_passes_are_those_of_each(
    seed: int, has_parts: bool, has_halves: bool
) -> None:
    rng = np.random.default_rng(seed)
    stations = [
        replace(SVALBARD, setup_s=0.0, min_contact_s=20.0),
        replace(TROLL, setup_s=float(rng.uniform(0.0, 90.0)), min_contact_s=0.001),
    ]
    rates = [_drawn_rate(rng) for _ in range(rng.integers(0, 8))]
    ends_s = np.array([(rate.time_s[0], rate.time_s[-1]) for rate in rates]).reshape(-1, 2)
    nothing = np.zeros(len(rates), dtype=np.bool_)
    site = rng.integers(0, 2, len(rates)).astype(np.int32)
    accesses = Accesses(site=site, start_s=ends_s[:, 0], end_s=ends_s[:, 1],
                        starts_cut=nothing, ends_cut=nothing)  # fmt: skip
    top_s = rng.uniform(ends_s[:, 0], ends_s[:, 1])
    passes = Passes(PassRates.joined(rates), top_s)
    placed = _place_parts(accesses, stations, passes, has_parts=has_parts, has_halves=has_halves)
    wanted = set[tuple[int, int, int, bool]]()
    whole = {int(row) for row, _, _ in zip(*placed.placed, strict=True)}
    for row in whole:
        station = stations[site[row]]
        spans = [(*(round(s * 1000) for s in ends_s[row].tolist()), False)]
        parts = [_part_ms(rates[row], top_s[row], station.setup_s, s) for s in (0.3, 0.6)]
        halves = _halves_ms(rates[row], station.setup_s)
        offered = [(*one, False) for one in parts * has_parts]
        offered += [(*one, True) for one in halves * has_halves]
        shortest_ms = max(1.0, station.min_contact_s * 1000 - 1e-3)
        spans += [one for one in offered if one[1] - one[0] >= shortest_ms]
        wanted |= {(row, *span) for span in spans}
    found = zip(*(column.tolist() for column in (*placed.placed, placed.is_half)), strict=True)
    assert set(found) == wanted


def test_passes_of_a_satellite_are_sampled_as_each_alone() -> None:
    scenario = _mission()
    path = propagate(scenario.satellites[0], scenario.horizon)
    sites = Sites.of(scenario.ground_stations)
    table = compute_opportunities(scenario, Budget()).opportunities
    rows = np.flatnonzero(table.kind == CONTACT)
    nothing = np.zeros(len(rows), dtype=np.bool_)
    accesses = Accesses(site=table.site[rows], start_s=table.access_start_s[rows],
                        end_s=table.access_end_s[rows], starts_cut=nothing,
                        ends_cut=nothing)  # fmt: skip
    passes = passes_of(BY_ELEVATION, scenario.ground_stations, path, sites, accesses)
    assert len(rows) > 0
    for row, rate in enumerate(passes.rates.each()):
        station = int(accesses.site[row])
        start_s, end_s = accesses.start_s[row], accesses.end_s[row]
        time_s = np.linspace(start_s, end_s, max(2, math.ceil((end_s - start_s) / 4.0) + 1))
        _, height_deg = azimuth_elevation_deg(path, sites.at(np.full(len(time_s), station)), time_s)
        gain = scenario.ground_stations[station].downlink_gain
        assert (rate.time_s == time_s).all()
        assert (rate.per_s == gain * BY_ELEVATION.downlink_at(height_deg)).all()
        assert passes.culmination_s[row] == time_s[np.argmax(height_deg)]


@pytest.mark.parametrize("num_satellites", [1, 3])
def test_rates_that_are_at_hand_are_those_that_the_table_tells(num_satellites: int) -> None:
    plain = replace(
        satellite(orbit(raan_deg=40.0), name="plain"), resources=Resources.paper(5668.7)
    )
    flown = [
        replace(satellite(orbit(mean_anomaly_deg=5.0 * i), name=str(i)), resources=BY_ELEVATION)
        for i in range(num_satellites)
    ]
    scenario = _mission(satellites=(plain, *flown)[-num_satellites:])
    found = compute_opportunities(scenario, Budget())
    assert found.rates is not None
    at_hand, wanted = found.rates.downlinks, downlinks_of(scenario, found.opportunities)
    assert found.downlinks_of(scenario) is at_hand
    assert at_hand.passes.keys() == wanted.passes.keys()
    assert len(wanted.passes) > 0
    for number, rate in wanted.passes.items():
        assert at_hand.passes[number].time_s.tolist() == rate.time_s.tolist()
        assert at_hand.passes[number].per_s.tolist() == rate.per_s.tolist()
    assert ScenarioOpportunities.from_bytes(found.to_bytes()).rates is None
    better = [replace(s, downlink_gain=2.0 * s.downlink_gain) for s in scenario.ground_stations]
    other = found.downlinks_of(replace(scenario, ground_stations=tuple(better)))
    for number, rate in wanted.passes.items():
        assert other.passes[number].per_s == pytest.approx(2.0 * rate.per_s)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(150)
@given(seed=SEEDS)
def test_steps_and_referee_agree_on_the_recorder(dynamics: Dynamics, seed: int) -> None:
    problem = passes_problem(seed, dynamics)
    own = problem.satellites[0]
    rng = np.random.default_rng(seed)
    chosen: list[int] = []
    for row in range(len(own)):
        if own.transitions.allows(chosen[-1] if chosen else -1, row) and rng.random() < 0.6:
            chosen.append(row)
    timeline = replay(problem, Plan.of(problem, [int(own.rows[row]) for row in chosen]))
    judged = [a for a in timeline.satellites[0].actions if a.opportunity is not None]
    track = compile_track(problem, own, np.zeros(len(own), dtype=np.uint8))
    resources = track.resources
    last, battery, recorder = NO_TASK, resources.battery_start, resources.recorder_start
    stays_within = True
    for action in judged:
        assert action.opportunity is not None
        row = int(problem.local_row[action.opportunity])
        battery, recorder, is_within = take(track.resources, last, row, battery, recorder)
        stays_within = stays_within and is_within
        last = row
        assert recorder == pytest.approx(action.recorder_end, abs=1e-9)
        if action.recorder_end == 1.0:
            # Far beyond the limit: no planner continues after a recorder has overflowed.
            assert not stays_within
            return
    waits_s = resources.data_end_s - (resources.data_from_s[last] if last >= 0 else 0.0)
    stays_within &= recorder + resources.telemetry_per_s * waits_s < resources.recorder_max - STRICT
    if stays_within:
        assert timeline.is_valid
    if any(v.code == "recorder" for v in timeline.violations):
        assert not stays_within


@examples(200)
@given(seed=SEEDS)
def test_no_plan_beats_the_bounds(seed: int) -> None:
    problem = passes_problem(seed)
    best = best_reward(problem)
    totals = totals_bound(problem)
    assert totals is not None
    assert totals.value >= best - 1e-6
    assert quick_bound(problem, 0.0).value >= best - 1e-6
    assert resource_value(problem, np.zeros(5), 1.0) >= best - 1e-6


@pytest.mark.parametrize("name", SOLVERS)
@examples(30)
@given(seed=SEEDS, dynamics=st.sampled_from(["physical", "paper"]))
def test_every_solver_plans_what_the_referee_accepts(
    name: str, seed: int, dynamics: Dynamics
) -> None:
    problem = passes_problem(seed, dynamics)
    timeline = replay(problem, SOLVERS[name]().solve(problem, Budget(), seed).plan)
    require_accepted(name, timeline)


@pytest.mark.parametrize("solver", [Milp(), Milp(formulation="pairwise"), Certified()])
@examples(40)
@given(seed=SEEDS, dynamics=st.sampled_from(["physical", "paper"]))
def test_exact_solvers_find_the_best_plan(
    solver: Milp | Certified, seed: int, dynamics: Dynamics
) -> None:
    problem = passes_problem(seed, dynamics)
    best = best_reward(problem)
    solution = solver.solve(problem, Budget(), seed)
    assert solution.proven is None or solution.proven.value >= best - 1e-6
    assert replay(problem, solution.plan).reward == pytest.approx(best)


def test_nothing_comes_down_during_setup() -> None:
    contact = Task(kind=CONTACT, site=0, start_s=100.0, end_s=200.0)
    links = StationLinks(gain=np.array([0.5]), setup_s=np.array([60.0]))
    full = replace(TIGHT, initial_recorder_fraction=0.4, telemetry_per_s=0.0)
    problem = make_problem(
        [contact], num_targets=1, resources=full, downlinks=Downlinks(stations=links)
    )
    down = 40.0 * full.downlink_per_s * 0.5
    assert problem.satellites[0].volume[0] == pytest.approx(down)
    (timeline,) = replay(problem, Plan.of(problem, (0,))).satellites
    assert timeline.resources is not None
    levels = np.interp(
        [100.0, 160.0, 200.0], timeline.resources.time_s, timeline.resources.recorder
    )
    assert levels == pytest.approx([0.4, 0.4, 0.4 - down])


def test_volumes_follow_the_elevation_that_another_library_sees() -> None:
    scenario = _mission()
    problem = _built(scenario)
    table, volume = problem.opportunities, problem.satellites[0].volume
    contacts = np.flatnonzero(table.kind == CONTACT)
    assert len(contacts) > 6
    path = SkyfieldPath(mean_elements(scenario.satellites[0].orbit), scenario.horizon)
    for row in contacts.tolist():
        station = scenario.ground_stations[int(table.site[row])]
        begin_s = float(table.start_s[row]) + station.setup_s
        steps_s = np.linspace(begin_s, float(table.end_s[row]), 201)
        ground = Ground.at(station.lat_deg, station.lon_deg)
        seen_deg = elevation_deg(path.position_m(steps_s), ground)
        rate = station.downlink_gain * np.interp(seen_deg, *np.array(KNOTS).T)
        assert volume[row] == pytest.approx(np.trapezoid(rate, steps_s), rel=2e-3)


def test_a_pass_is_offered_whole_and_in_two_parts() -> None:
    problem = _built(_mission())
    table, volume = problem.opportunities, problem.satellites[0].volume
    contacts = np.flatnonzero(table.kind == CONTACT)
    for access in np.unique(table.access[contacts]):
        rows = contacts[table.access[contacts] == access]
        whole = rows[np.argmax(table.end_s[rows] - table.start_s[rows])]
        assert whole == rows[0]
        shares = sorted((volume[rows] / volume[whole]).tolist())
        assert shares == pytest.approx([0.3, 0.6, 1.0], abs=1e-4)
        top_s = table.start_s[rows].max(), table.end_s[rows].min()
        assert table.access_start_s[whole] < top_s[0] < top_s[1] < table.access_end_s[whole]


def test_plain_passes_are_offered_whole_alone() -> None:
    plain = replace(satellite(orbit()), resources=Resources.paper(5668.7))
    problem = _built(_mission(satellites=(plain,), ground_stations=(SVALBARD,)))
    table = problem.opportunities
    contacts = np.flatnonzero(table.kind == CONTACT)
    assert len(np.unique(table.access[contacts])) == len(contacts)
    lasts_s = table.end_s[contacts] - table.start_s[contacts]
    rate = plain.resources.downlink_per_s
    assert (problem.satellites[0].volume[contacts] == lasts_s * rate).all()


def _two(antennas: int = 1, **own: Any) -> Scenario:
    """Return two plain satellites that pass over stations half a minute apart."""
    plain = satellite(orbit())
    ahead = replace(mean_elements(plain.orbit), mean_anomaly_deg=2.0, norad_cat_id=7)
    both = (plain, replace(plain, id="ahead", name="Ahead", orbit=ahead))
    return _mission(
        satellites=tuple(
            replace(one, resources=replace(Resources.paper(5668.7), **own)) for one in both
        ),
        ground_stations=tuple(replace(s, antennas=antennas) for s in (SVALBARD, TROLL)),
    )


@pytest.mark.parametrize("knots", [(), KNOTS])
def test_passes_that_two_satellites_want_at_a_time_are_offered_in_halves(
    knots: tuple[tuple[float, float], ...],
) -> None:
    problem = _built(_two(downlink_by_elevation=knots))
    table = problem.opportunities
    num_shared = 0
    for index, one in enumerate(problem.satellites):
        for access in np.unique(table.access[one.rows[one.kind == CONTACT]]):
            rows = np.flatnonzero(table.access == access)
            others = (table.site == table.site[rows[0]]) & (table.satellite != index)
            others &= (table.kind == CONTACT) & (table.access_start_s < table.access_end_s[rows[0]])
            is_shared = bool((others & (table.access_end_s > table.access_start_s[rows[0]])).any())
            halves = [
                row for row in rows.tolist()
                if (table.start_s[row] == table.access_start_s[row] + 2.0)
                or ((table.end_s[row] == table.access_end_s[row])
                and table.start_s[row] > table.access_start_s[row])
            ]  # fmt: skip
            num_shared += is_shared
            # Setup at a station may leave no time for a half.
            assert len(halves) == 2 * is_shared or (is_shared and table.site[rows[0]] == 1)
            volume = one.volume[problem.local_row[rows]]
            for row in halves:
                share = one.volume[problem.local_row[row]] / volume.max()
                assert share == pytest.approx(0.5, abs=0.02)
    assert num_shared >= 4


def test_who_has_an_antenna_needs_no_half() -> None:
    table = _built(_two(antennas=2)).opportunities
    is_contact = table.kind == CONTACT
    assert not (table.start_s == table.access_start_s + 2.0)[is_contact].any()


def test_a_booking_in_whole_seconds_tells_a_pass_from_its_first_half() -> None:
    scenario = _two()
    table = _built(scenario).opportunities
    half = int(np.flatnonzero(table.start_s == table.access_start_s + 2.0)[0])
    whole = int(
        np.flatnonzero(
            (table.access == table.access[half]) & (table.start_s == table.access_start_s)
        )[0]
    )
    for row in (half, whole):
        named = PinnedAction(
            satellite_id=scenario.satellites[int(table.satellite[row])].id,
            station_id=scenario.ground_stations[int(table.site[row])].id,
            start=scenario.horizon.instant(float(np.round(table.start_s[row]))),
        )
        kept = _built(replace(scenario, pins=Pins(keep=(named,))))
        (only,) = kept.kept_rows
        assert kept.opportunities.start_s[only] == table.start_s[row]
        assert kept.opportunities.end_s[only] == table.end_s[row]


def test_two_satellites_share_a_pass() -> None:
    """With halves both downlink an image in one pass; with whole contacts only one could."""
    problem = _built(_two(downlink_per_s=0.01))
    table = problem.opportunities
    contacts = np.flatnonzero(table.kind == CONTACT)
    first = next(r for r in contacts if table.start_s[r] == table.access_start_s[r] + 2.0)
    later = next(
        r for r in contacts
        if table.satellite[r] != table.satellite[first] and table.site[r] == table.site[first]
        and table.access_start_s[r] < table.access_end_s[first] < table.access_end_s[r] + 600.0
        and table.start_s[r] >= table.end_s[first]
    )  # fmt: skip
    assert replay(problem, Plan.of(problem, sorted((int(first), int(later))))).is_valid
    whole = [
        int(np.flatnonzero((table.access == table.access[r]) & (contacts_of_pass(table, r)))[0])
        for r in (int(first), int(later))
    ]
    assert not replay(problem, Plan.of(problem, sorted(whole))).is_valid


def contacts_of_pass(table: Opportunities, row: int) -> Bools:
    """Return which contacts cover the whole pass that a row belongs to."""
    is_its = table.access == table.access[row]
    is_whole: Bools = is_its & (table.start_s == table.access_start_s)
    is_whole &= table.end_s == table.access_end_s
    return is_whole


def test_a_pin_on_a_pass_means_all_of_it() -> None:
    scenario = _mission()
    table = _built(scenario).opportunities
    first = int(np.flatnonzero(table.kind == CONTACT)[0])
    station = scenario.ground_stations[int(table.site[first])].id
    then = scenario.horizon.instant(float(table.start_s[first]))
    named = PinnedAction(satellite_id=scenario.satellites[0].id, station_id=station, start=then)
    skipped = _built(replace(scenario, pins=Pins(skip=(named,)))).opportunities
    assert int(table.access[first]) not in skipped.access
    kept = _built(replace(scenario, pins=Pins(keep=(named,))))
    assert [k.row for k in kept.pinned.kept] == [
        int(np.flatnonzero(kept.opportunities.start_s == table.start_s[first])[0])
    ]


def test_flows_are_empty_while_a_contact_is_set_up() -> None:
    problem = passes_problem(3)
    for row in np.flatnonzero(problem.opportunities.kind == CONTACT).tolist():
        (action,) = Plan.of(problem, (row,)).actions
        pieces = flow(problem, problem.satellites[0], action)
        setup_s = problem.downlinks.stations.setup_s[problem.opportunities.site[row]]
        assert pieces[0, 0] == pytest.approx(action.start_s + setup_s)
        assert pieces[-1, 1] == action.end_s


def test_a_rate_below_telemetry_is_refused() -> None:
    slow = replace(BY_ELEVATION, downlink_by_elevation=((5.0, 0.0), (10.0, 0.001)))
    flown = replace(satellite(orbit()), resources=slow)
    with pytest.raises(InvalidScenario, match="falls below the telemetry rate"):
        _mission(satellites=(flown,))
    high = tuple(replace(s, min_elevation_deg=8.0) for s in (SVALBARD, TROLL))
    _mission(satellites=(flown,), ground_stations=high)


@pytest.mark.parametrize(
    "knots", [((91.0, 1.0),), ((5.0, 1.0), (5.0, 2.0)), ((5.0, -1.0),), ((5.0, float("inf")),)]
)
def test_knots_ascend_and_are_magnitudes(knots: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(InvalidScenario, match="downlink_by_elevation"):
        replace(BY_ELEVATION, downlink_by_elevation=knots)


def test_telemetry_may_fill_the_recorder_while_a_contact_is_set_up() -> None:
    contact = Task(kind=CONTACT, site=0, start_s=10.0, end_s=110.0)
    for setup_s, is_within in ((20.0, True), (60.0, False)):
        nearly = replace(
            TIGHT,
            initial_recorder_fraction=0.395,
            recorder_max_fraction=0.4,
            telemetry_per_s=1e-4,
            downlink_per_s=0.01,
        )
        links = StationLinks(gain=np.ones(1), setup_s=np.array([setup_s]))
        problem = make_problem(
            [contact],
            num_targets=1,
            resources=nearly,
            downlinks=Downlinks(stations=links),
            horizon_s=200.0,
        )
        track = compile_track(problem, problem.satellites[0], np.zeros(1, dtype=np.uint8))
        step = take(
            track.resources,
            NO_TASK,
            0,
            track.resources.battery_start,
            track.resources.recorder_start,
        )
        assert step[2] == is_within
        assert replay(problem, Plan.of(problem, (0,))).is_valid == is_within
