"""The referee's vectorised computations, compared with loops over single actions."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.problem import COLLECT, CONTACT, Heading, Problem
from planner_core.problem.plan import Action, Columns, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.sun_turns import sun_turns
from planner_core.referee import alone
from planner_core.referee.alone import judge_alone, judged_alone
from planner_core.referee.contact_flow import flow, flows
from planner_core.referee.idle_time import idle_spans
from planner_core.referee.replay import replay
from planner_core.referee.resource_profile import indices_of
from planner_core.referee.rules import slews, turns, windows
from planner_core.referee.sight import lines_of_sight
from planner_core.solvers.sequential import blocked_rows
from tests.planner_core.problems import random_problem, sunny_problem
from tests.planner_core.test_downlink import passes_problem

SEEDS = st.integers(0, 10**6)


def _drawn_plan(problem: Problem, rng: np.random.Generator) -> Plan:
    """Return actions that overlap, follow each other too soon, or lie outside their window."""
    rows = np.flatnonzero(rng.random(len(problem.opportunities)) < rng.choice([0.2, 0.5, 0.9]))
    actions = []
    for action in Plan.of(problem, rows.tolist()).actions:
        early_s, late_s = rng.choice([0.0, 1e-7, 0.5, -40.0], 2, p=[0.7, 0.1, 0.1, 0.1])
        actions.append(Action(action.start_s - early_s, action.end_s + late_s, action.opportunity))
    return Plan(tuple(actions))


def _own(problem: Problem, plan: Plan, index: int) -> list[int]:
    satellite = problem.opportunities.satellite
    own = [p for p, a in enumerate(plan.actions) if satellite[a.opportunity] == index]
    return sorted(own, key=plan.actions.__getitem__)


@given(seed=SEEDS, is_moving=st.booleans())
def test_turns_are_judged_as_one_after_another(seed: int, is_moving: bool) -> None:
    problem = sunny_problem(seed, num_satellites=2, is_moving=is_moving)
    plan = _drawn_plan(problem, np.random.default_rng(seed))
    for index in range(2):
        positions = _own(problem, plan, index)
        actions = [plan.actions[p] for p in positions]
        wanted = []
        busy_until_s = -np.inf
        turned = slews(problem, index, actions)
        for position, action, slew in zip(positions, actions, turned, strict=True):
            gap_s = action.start_s - busy_until_s
            if gap_s < -TIME_TOLERANCE_S:
                wanted.append(("overlap", position, 0.0, gap_s))
            elif slew is not None and slew.available_s < slew.needed_s - TIME_TOLERANCE_S:
                wanted.append(("slew", position, slew.needed_s, slew.available_s))
            busy_until_s = max(busy_until_s, action.end_s)
        found = turns(problem, plan, index, positions)
        assert [(v.code, *v.blamed, v.needed, v.available) for v in found] == wanted


@given(seed=SEEDS)
def test_windows_are_judged_as_one_by_one(seed: int) -> None:
    problem = random_problem(seed, num_satellites=2, num_contacts=4)
    problem = replace(problem, continuous_starts=bool(seed % 2))
    plan = _drawn_plan(problem, np.random.default_rng(seed))
    table = problem.opportunities
    wanted = []
    for position, a in enumerate(plan.actions):
        row = a.opportunity
        is_early = max(0.0, table.access_start_s[row]) - a.start_s > TIME_TOLERANCE_S
        is_late = a.end_s - min(problem.horizon_s, table.access_end_s[row]) > TIME_TOLERANCE_S
        length_s = table.end_s[row] - table.start_s[row]
        is_longer = abs(a.end_s - a.start_s - length_s) > TIME_TOLERANCE_S
        is_free = problem.continuous_starts and table.kind[row] != CONTACT
        is_moved = not is_free and abs(a.start_s - table.start_s[row]) > TIME_TOLERANCE_S
        if is_early or is_late or is_longer or is_moved:
            wanted.append(position)
    assert [position for v in windows(problem, plan) for position in v.blamed] == wanted


def _idle_one_by_one(
    problem: Problem, actions: Sequence[Action], first_turn_s: float
) -> list[tuple[float, ...]]:
    satellite, columns = problem.satellites[0], Columns.of(actions)
    looks, moves = lines_of_sight(problem, columns, is_end=False)
    looked, moved = lines_of_sight(problem, columns, is_end=True)
    turned = sun_turns(
        satellite.resources, satellite.agility, satellite.sun, start_s=columns.start_s,
        end_s=columns.end_s, looks=looks, looked=looked, moves=moves, moved=moved,
    )  # fmt: skip
    spans: list[tuple[float, ...]] = []
    free_from_s, turn_to_s = 0.0, first_turn_s
    for after, out_s, back_s in zip(
        (*actions, None), (*turned.out_s.tolist(), 0.0), (*turned.back_s.tolist(), 0.0), strict=True
    ):
        until_s = problem.horizon_s if after is None else after.start_s
        if until_s > free_from_s + TIME_TOLERANCE_S:
            sun_from_s = free_from_s + turn_to_s
            sun_until_s = max(sun_from_s, until_s - back_s)
            spans.append((free_from_s, until_s, sun_from_s, sun_until_s, turn_to_s, back_s))
        if after is not None and after.end_s > free_from_s:
            free_from_s, turn_to_s = after.end_s, out_s
    return spans


@given(seed=SEEDS, is_moving=st.booleans())
def test_idle_time_is_that_of_a_walk_and_turns_that_are_remembered_stay(
    seed: int, is_moving: bool
) -> None:
    problem = sunny_problem(seed, is_moving=is_moving)
    rng = np.random.default_rng(seed)
    for _ in range(4):
        plan = _drawn_plan(problem, rng)
        actions = sorted(plan.actions)
        spans = idle_spans(problem, problem.satellites[0], Columns.of(actions))
        found = list(zip(*(column.tolist() for column in spans), strict=True))
        assert found == _idle_one_by_one(problem, actions, 0.0)


def test_idle_time_begins_with_a_turn_from_where_the_satellite_looked() -> None:
    problem = sunny_problem(1)
    heading = Heading(free_from_s=0.0, line_of_sight=(1.0, 0.0, 0.0))
    turned = replace(problem.satellites[0], heading=heading)
    spans = idle_spans(problem, turned, Columns.of([]))
    assert len(spans.start_s) == 1
    assert spans.turn_to_s[0] == spans.sun_from_s[0] > 0.0


@given(seed=SEEDS)
def test_many_contacts_flow_as_each_does(seed: int) -> None:
    problem = passes_problem(seed)
    table, rng = problem.opportunities, np.random.default_rng(seed)
    contacts = [
        action
        for action in _drawn_plan(problem, rng).actions
        if table.kind[action.opportunity] == CONTACT
    ]
    own = problem.satellites[0]
    each = [flow(problem, own, contact) for contact in contacts]
    found = flows(problem, own, Columns.of(contacts))
    assert found.tolist() == np.concatenate([np.empty((0, 3)), *each]).tolist()


@given(seed=SEEDS, antennas=st.integers(1, 3))
def test_contacts_are_blocked_that_overlap_too_many(seed: int, antennas: int) -> None:
    problem = random_problem(seed, num_satellites=3, num_contacts=25, num_stations=2)
    problem = replace(problem, station_antennas=np.full(2, antennas, dtype=np.int32))
    table, rng = problem.opportunities, np.random.default_rng(seed)
    taken = np.flatnonzero(rng.random(len(table)) < 0.5).tolist()
    for satellite in problem.satellites:
        wanted = []
        for row in satellite.rows.tolist():
            beside = [
                other
                for other in taken
                if table.kind[other] == table.kind[row] == CONTACT
                and table.site[other] == table.site[row]
                and table.start_s[other] < table.end_s[row]
                and table.end_s[other] > table.start_s[row]
            ]
            wanted.append(int(len(beside) >= antennas))
        assert blocked_rows(problem, satellite, taken).tolist() == wanted


@given(seed=SEEDS)
def test_plans_are_in_order_whatever_order_they_are_made_in(seed: int) -> None:
    problem = random_problem(seed, num_satellites=2, num_offers=2)
    rng = np.random.default_rng(seed)
    rows = rng.permutation(len(problem.opportunities))[: rng.integers(0, 12)].tolist()
    table = problem.opportunities
    actions = [Action(float(table.start_s[r]), float(table.end_s[r]), r) for r in rows]
    assert Plan.of(problem, rows).actions == tuple(sorted(actions))


@pytest.mark.parametrize("in_detail", [True, False])
@given(seed=SEEDS)
def test_an_order_of_actions_makes_no_difference_to_the_verdict(seed: int, in_detail: bool) -> None:
    problem = sunny_problem(seed, num_satellites=2)
    rng = np.random.default_rng(seed)
    plan = _drawn_plan(problem, rng)
    shuffled = Plan(tuple(plan.actions[i] for i in rng.permutation(len(plan.actions))))
    verdicts = [replay(problem, each, in_detail=in_detail) for each in (plan, shuffled)]
    first, second = ([replace(v, blamed=()) for v in t.violations] for t in verdicts)
    assert sorted(map(repr, first)) == sorted(map(repr, second))
    assert verdicts[0].reward == verdicts[1].reward
    for one, other in itertools.pairwise(verdicts):
        assert set(one.collected) == set(other.collected)


@pytest.mark.parametrize("most", [0, 60, 10**6])
@given(seed=SEEDS, use_resources=st.booleans())
def test_what_is_remembered_of_satellites_is_what_would_be_said_anew(
    seed: int, use_resources: bool, most: int
) -> None:
    problem = sunny_problem(seed, num_satellites=2, use_resources=use_resources)
    rng = np.random.default_rng(seed)
    plans = [_drawn_plan(problem, rng) for _ in range(3)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(alone, "_MOST_KEPT", most)
        for plan in (*plans, *plans):
            for index in range(2):
                positions = _own(problem, plan, index)
                found = judged_alone(problem, index, plan, positions)
                wanted = judge_alone(
                    problem, index, Plan(tuple(plan.actions[p] for p in positions))
                )
                assert (found.turns, found.limits) == (wanted.turns, wanted.limits)
                assert repr(found.down_s.tolist()) == repr(wanted.down_s.tolist())
                if found.profile is not None and wanted.profile is not None:
                    curves = found.profile.curve, wanted.profile.curve
                    assert curves[0].points() == curves[1].points()
                is_kept = judged_alone(problem, index, plan, positions) is found
                assert is_kept == (found.size <= most)


def test_verdicts_are_remembered_for_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = sunny_problem(3, num_satellites=2)
    rng = np.random.default_rng(3)
    plans = [_drawn_plan(problem, rng) for _ in range(12)] * 20
    monkeypatch.setattr(alone, "_MOST_KEPT", 60)  # a few of them
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as threads:
            found = list(threads.map(partial(replay, problem, in_detail=False), plans))
    finally:
        sys.setswitchinterval(interval_s)
    for plan, timeline in zip(plans, found, strict=True):
        assert timeline.violations == replay(problem, plan).violations


@given(seed=SEEDS)
def test_the_best_image_of_each_target_is_that_of_a_walk(seed: int) -> None:
    problem = random_problem(seed, num_satellites=2, num_offers=3, has_quality=True)
    table = problem.opportunities
    plan = _drawn_plan(problem, np.random.default_rng(seed))
    timeline = replay(problem, plan)
    blamed = {p for violation in timeline.violations for p in violation.blamed}
    best: dict[int, int] = {}
    for position in sorted(range(len(plan.actions)), key=plan.actions.__getitem__):
        row = plan.actions[position].opportunity
        if table.kind[row] != COLLECT or position in blamed:
            continue
        first = best.setdefault(int(table.site[row]), position)
        if problem.worth[row] > problem.worth[plan.actions[first].opportunity]:
            best[int(table.site[row])] = position
    found = timeline.collected
    assert [(target, image.position) for target, image in found.items()] == list(best.items())
    num_images = sum(table.kind[action.opportunity] == COLLECT for action in plan.actions)
    num_broken = sum(table.kind[plan.actions[p].opportunity] == COLLECT for p in blamed)
    duplicates = [v for v in timeline.violations if v.code == "duplicate"]
    assert len(duplicates) == num_images - num_broken - len(best)


@given(seed=SEEDS)
def test_places_among_instants_are_those_that_a_search_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    spans = rng.integers(0, 30, (12, 2)).astype(np.float64)
    times = np.unique(np.append(spans, [0.0, 30.0]))
    assert indices_of(times, spans).tolist() == np.searchsorted(times, spans).tolist()
