"""Queues before contacts, if images are worth less the later they are downlinked."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.certified.dp.contact_queues import most_by_queues
from planner_core.certified.dp.queue_terms import queues_of
from planner_core.certified.dp.resource_network import strict_network_of
from planner_core.certified.lns.queue_plans import (
    plan_with_queues,
    replanned_day,
    some_contacts,
)
from planner_core.certified.multipliers.queues import multipliers_by_queues
from planner_core.certified.proofs import queues
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.latency import ContactCharges, latency_relaxations, latency_value
from planner_core.certified.proofs.queues import is_supported, queue_value
from planner_core.domain import Objective
from planner_core.problem import CONTACT, Floats, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import taking
from planner_core.referee.replay import replay
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, make_problem, random_problem, varied_problem
from tests.planner_core.test_delivery import ROOMY, collect, contact

SEEDS = st.integers(0, 10**6)
STARVED = replace(TIGHT, battery_min_fraction=0.5, initial_battery_fraction=0.62)
_problem = partial(varied_problem, scarce=STARVED)
Dynamics = Literal["physical", "paper"]
STOP = np.zeros(1, dtype=np.uint8)


def num_contacts(problem: Problem) -> int:
    return int(np.count_nonzero(problem.opportunities.kind == CONTACT))


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(400)
@given(
    seed=SEEDS,
    collected_share=st.sampled_from([0.0, 0.3, 0.9]),
    half_life_s=st.floats(60.0, 2000.0),
    num_satellites=st.integers(1, 2),
    has_quality=st.booleans(),
    per_collect=st.sampled_from([1, 3, 24]),
)
def test_no_plan_beats_any_multipliers(
    dynamics: Dynamics,
    seed: int,
    collected_share: float,
    half_life_s: float,
    num_satellites: int,
    has_quality: bool,
    per_collect: int,
) -> None:
    problem = _problem(
        seed, dynamics, num_satellites, num_collects=6, num_contacts=3, has_quality=has_quality
    )
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    problem = with_objective(problem, objective)
    best = best_reward(problem)
    rng = np.random.default_rng(seed)
    free = np.zeros(len(problem.target_ids))
    some = np.maximum(rng.uniform(-0.5, 1.0, len(free)) * problem.best_worth, 0.0)
    of_contacts = rng.uniform(0.0, 3.0, num_contacts(problem)) * (rng.random() < 0.7)
    contacts = np.flatnonzero(problem.opportunities.kind == CONTACT)
    exact = contacts[rng.random(len(contacts)) < 0.5].tolist()
    for multipliers in (free, some):
        whole, _ = queue_value(problem, multipliers, per_collect, exact_contacts=exact)
        assert whole >= best - 1e-9
        # Paths may be left out, as long as they include no better plan.
        level = float(rng.uniform(0.5, 1.0)) * best
        value, found = queue_value(
            problem,
            multipliers,
            per_collect,
            contact_multipliers=of_contacts,
            exact_contacts=exact,
            level=level,
        )
        assert best - 1e-9 <= value <= max(whole, level) + 1e-6
        if num_satellites == 1 and multipliers is free and value > level + 1e-6:
            assert len(found) > 0


@examples(60)
@given(seed=SEEDS, half_life_s=st.floats(60.0, 2000.0))
def test_what_follows_a_contact_and_what_leads_to_it_add_up_to_a_whole_path(
    seed: int, half_life_s: float
) -> None:
    """The maximum over all pairs of contacts is the maximum over all paths."""
    problem = _problem(seed, "physical", 1, num_contacts=3)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=half_life_s))
    (one,) = latency_relaxations(problem)
    rng = np.random.default_rng(seed)
    multiplier = np.append(rng.uniform(0.0, 0.5, len(problem.target_ids)), 0.0)
    charges = ContactCharges(rng.uniform(0.0, 1.0, len(one.contacts)), np.zeros(len(one.contacts)))
    most, path, _ = one.most(multiplier, charges)
    found = one.most_by_pairs(multiplier, charges)
    assert found is not None
    pairs, _ = found
    assert pairs.max() == pytest.approx(most, abs=1e-9)
    number = one.layers.number[path]
    taken = [-1, *number[number >= 0].tolist(), len(one.contacts)]
    for before, after in pairwise(taken):
        assert pairs[before + 1, after] == pytest.approx(most, abs=1e-9)


def _narrow(seed: int, drain_per_s: float) -> Problem:
    """Return a mission whose contacts downlink one or two images each."""
    rng = np.random.default_rng(seed)
    tasks = [collect(target, float(t)) for target, t in enumerate(rng.integers(0, 500, 5))]
    begins_s = 40.0 + 70.0 * np.sort(rng.choice(12, 4, replace=False))
    tasks += [contact(t, t + 30.0 * float(rng.integers(1, 3))) for t in begins_s]
    resources = replace(
        ROOMY,
        initial_recorder_fraction=0.0,
        contact_drain_per_s=drain_per_s,
        sunpoint_charge_per_s=1e-7,
    )
    problem = make_problem(tasks, num_targets=5, resources=resources)
    return with_objective(problem, Objective(collected_share=0.0, half_life_s=200.0))


@pytest.mark.parametrize(("drain_per_s", "is_promise_of_use"), [(1e-6, False), (0.01, True)])
def test_images_that_a_contact_has_no_time_for_count_with_a_later_one(
    drain_per_s: float, is_promise_of_use: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Promises name the next contact; if all contacts are taken it is known without one."""
    by_queues, by_contacts, without_promises = [], [], []
    none = np.zeros(5)
    for seed in range(40):
        problem = _narrow(seed, drain_per_s)
        best = best_reward(problem)
        if best > 0.0:
            by_queues.append(queue_value(problem, none, 24)[0] / best)
            by_contacts.append(latency_value(problem, none, none[:4]) / best)
            with monkeypatch.context() as patch:
                patch.setattr(queues, "PROMISES", 1)
                without_promises.append(queue_value(problem, none, 24)[0] / best)
    assert len(by_queues) > 35
    assert min(by_queues) >= 1.0 - 1e-9
    assert np.mean(by_queues) < 0.95 * np.mean(by_contacts)
    assert bool(np.mean(by_queues) < 0.99 * np.mean(without_promises)) == is_promise_of_use


def test_queues_bound_plans_better_than_multipliers_of_contacts() -> None:
    problem = random_problem(
        3, num_collects=200, num_targets=90, num_contacts=6, span_s=6000.0, resources=TIGHT
    )
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=900.0))
    multipliers = np.zeros(len(problem.target_ids))
    value, rows = queue_value(problem, multipliers, 12)
    assert value < latency_value(problem, multipliers, np.zeros(6))
    assert np.any(problem.opportunities.kind[rows] == CONTACT)
    bound = Bound(
        value=rounded_bound(problem, value, 0.0),
        proof="dp",
        multipliers=multipliers,
        queue_levels=12,
    )
    read = from_json(to_json(bound))
    assert read.queue_levels == 12
    assert is_proven(problem, read)
    assert not is_proven(problem, replace(read, value=0.99 * read.value))


def _crowded(seed: int, num_targets: int, num_collects: int) -> Problem:
    problem = random_problem(
        seed,
        num_collects=num_collects,
        num_targets=num_targets,
        num_contacts=6,
        span_s=6000.0,
        resources=TIGHT,
    )
    return with_objective(problem, Objective(collected_share=0.0, half_life_s=900.0))


def test_contacts_whose_energy_is_not_rounded_lower_the_bound() -> None:
    rounded, lowered = list[float](), list[float]()
    for seed in range(12):
        problem = _crowded(seed, num_targets=90, num_collects=200)
        multipliers = np.zeros(90)
        value, rows = queue_value(problem, multipliers, 2)
        contacts = rows[problem.opportunities.kind[rows] == CONTACT].tolist()
        lower, _ = queue_value(problem, multipliers, 2, exact_contacts=contacts)
        rounded.append(value)
        lowered.append(lower)
        bound = Bound(
            value=lower,
            proof="dp",
            multipliers=multipliers,
            queue_levels=2,
            exact_contacts=tuple(contacts),
        )
        read = from_json(to_json(bound))
        assert read.exact_contacts == bound.exact_contacts
        assert is_proven(problem, read)
        assert is_proven(problem, replace(read, exact_contacts=())) == (value <= lower + 1e-6)
    assert sum(lowered) < 0.99 * sum(rounded)


def test_multipliers_that_suit_given_contacts_lower_the_bound_of_their_plans() -> None:
    at_first, at_last = list[float](), list[float]()
    for seed in range(12):
        problem = _crowded(seed, num_targets=6, num_collects=40)
        none = np.zeros(6)
        _, rows = queue_value(problem, none, 24)
        contacts = rows[problem.opportunities.kind[rows] == CONTACT].tolist()
        multipliers = multipliers_by_queues(problem, contacts, none, 20, STOP)
        assert np.all(multipliers >= 0.0)
        part = taking(problem, contacts)
        at_first.append(queue_value(part, none, 24)[0])
        at_last.append(queue_value(part, multipliers, 24)[0])
        assert (
            replay(problem, _plan_with(problem, contacts, multipliers)).reward <= at_last[-1] + 1e-9
        )
        assert (
            multipliers_by_queues(problem, contacts, none, 20, np.ones(1, dtype=np.uint8)) is none
        )
    assert sum(at_last) < 0.995 * sum(at_first)


def _plan_with(problem: Problem, contacts: list[int], multipliers: Floats) -> Plan:
    plan = plan_with_queues(
        taking(problem, contacts), multipliers, np.random.default_rng(0), STOP, 24
    )
    assert plan is not None
    return plan


@examples(60)
@given(seed=SEEDS, half_life_s=st.floats(60.0, 2000.0))
def test_contacts_that_must_be_taken_cost_their_energy_and_no_more(
    seed: int, half_life_s: float
) -> None:
    """Even if every path takes them, plans keep their limits."""
    problem = _problem(seed, "physical", 1, num_contacts=3)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=half_life_s))
    contacts = np.flatnonzero(problem.opportunities.kind == CONTACT)[:1].tolist()
    multipliers = np.zeros(len(problem.target_ids))
    plan = plan_with_queues(
        taking(problem, contacts), multipliers, np.random.default_rng(seed), STOP, 2
    )
    if plan is not None and plan.actions:
        codes = {violation.code for violation in replay(problem, plan).violations}
        assert codes <= {"station_conflict"}


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(150)
@given(seed=SEEDS, half_life_s=st.floats(60.0, 2000.0), per_collect=st.sampled_from([3, 24]))
def test_paths_of_the_strict_programme_are_plans(
    dynamics: Dynamics, seed: int, half_life_s: float, per_collect: int
) -> None:
    problem = _problem(seed, dynamics, 1, num_contacts=3)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=half_life_s))
    satellite = problem.satellites[0]
    programme = queues_of(
        problem,
        satellite,
        strict_network_of(problem, satellite),
        np.zeros(len(problem.target_ids)),
        per_collect=per_collect,
        num_classes=3,
        keeps_battery=True,
        keeps_recorder=True,
    )
    if programme is None or not is_supported(satellite):
        return
    value, path = most_by_queues(programme, STOP)
    plan = Plan.of(problem, satellite.rows[path].tolist())
    timeline = replay(problem, plan)
    assert {v.code for v in timeline.violations} <= {"duplicate", "station_conflict"}
    assert (len(path) > 0) == (value > 0.0)


def test_plans_take_the_contacts_that_they_must_and_no_target_twice() -> None:
    problem = random_problem(
        3, num_collects=200, num_targets=90, num_contacts=6, span_s=6000.0, resources=TIGHT
    )
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=900.0))
    contacts = np.flatnonzero(problem.opportunities.kind == CONTACT)[[1, 4]].tolist()
    plan = _plan_with(problem, contacts, np.zeros(len(problem.target_ids)))
    rows = [action.opportunity for action in plan.actions]
    assert [r for r in rows if problem.opportunities.kind[r] == CONTACT] == contacts
    timeline = replay(problem, plan)
    assert timeline.is_valid
    assert timeline.reward > 0.0


def test_a_day_planned_anew_leaves_what_other_satellites_do() -> None:
    problem = random_problem(
        3, num_collects=200, num_targets=90, num_contacts=6, span_s=6000.0, resources=TIGHT,
        num_satellites=2,
    )  # fmt: skip
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=900.0))
    rng, table = np.random.default_rng(0), problem.opportunities
    plan = Plan()
    for index, satellite in enumerate(problem.satellites):
        new = replanned_day(problem, plan, satellite, rng, STOP, 24)
        assert new is not None
        others = [a for a in new.actions if table.satellite[a.opportunity] != index]
        assert others == list(plan.actions)
        timeline = replay(problem, new)
        assert timeline.is_valid
        assert timeline.reward > replay(problem, plan).reward
        plan = new


@pytest.mark.parametrize(
    ("num_contacts", "num_tried"), [(6, 6), (20, 20), (30, 20), (60, 30), (200, 40)]
)
def test_of_many_contacts_a_day_tries_some(num_contacts: int, num_tried: int) -> None:
    problem = random_problem(1, num_collects=3, num_contacts=num_contacts, span_s=40_000.0)
    satellite, rng = problem.satellites[0], np.random.default_rng(0)
    tried = [some_contacts(satellite, len(problem.opportunities), rng) for _ in range(2)]
    for rows in tried:
        assert np.count_nonzero(rows) == num_tried
        assert set(problem.opportunities.kind[rows]) == {CONTACT}
    assert np.array_equal(tried[0], tried[1]) == (num_tried == num_contacts)
