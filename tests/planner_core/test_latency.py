"""Images worth less the later they are downlinked: bounds by contacts, and plans close to them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.dp import contact_layers
from planner_core.certified.dp.contact_layers import Layers, layers_of, most_by_contacts
from planner_core.certified.dp.energy_labels import EnergyLevels, energy_levels
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.driver import Search, Strategy
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.settled_contacts import worth_with
from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.proofs.bound import rounded_bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.latency import latency_value
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.signs import NEVER
from planner_core.certified.solver import Certified
from planner_core.certified.strategies import days
from planner_core.certified.strategies.days import FullWorth, plans_without_half_life
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.certified.tuning import tuned
from planner_core.domain import Objective
from planner_core.problem import COLLECT, CONTACT, Floats, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.rule import Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.budgets import bounds_told, expiring
from tests.planner_core.problems import (
    TIGHT,
    make_problem,
    random_problem,
    sunny_problem,
    varied_problem,
)
from tests.planner_core.test_delivery import ROOMY, collect, contact
from tests.planner_core.verdicts import encloses

SEEDS = st.integers(0, 10**6)
STARVED = replace(TIGHT, battery_min_fraction=0.5, initial_battery_fraction=0.62)
_problem = partial(varied_problem, scarce=STARVED)
Dynamics = Literal["physical", "paper"]


def best_by_enumeration(
    network: Network, levels: EnergyLevels, layers: Layers, weight: Floats
) -> float:
    """Return the most that any path gains, by enumeration over paths and layers."""
    m = len(network.site)

    def from_here(last: int, energy: int, layer: int) -> float:
        """Return the most after a task, within a layer."""
        is_last = layer == len(layers.first) - 1
        best = 0.0 if is_last else -np.inf
        for k in range(last + 1, m):
            near = network.near_rows[network.near_first[last] : network.near_first[last + 1]]
            if last >= 0 and k < network.idle_from[last] and k not in near:
                continue
            left = min(energy, int(levels.cap[k])) - int(levels.cost[k])
            if left < levels.floor[k]:
                continue
            if layers.number[k] >= 0:
                if layers.group[k] != layer:
                    continue
                onward = max(from_here(k, left, up) for up in range(layer, len(layers.first)))
                best = max(best, float(weight[layer, k]) + onward)
            elif weight[layer, k] != NEVER:
                best = max(best, float(weight[layer, k]) + from_here(k, left, layer))
        return best

    return max(from_here(-1, levels.start, layer) for layer in range(len(layers.first)))


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(150)
@given(seed=SEEDS, per_collect=st.sampled_from([1, 3, 24]), num_groups=st.integers(1, 3))
def test_the_programme_finds_the_best_path(
    dynamics: Dynamics, seed: int, per_collect: int, num_groups: int
) -> None:
    problem = _problem(seed, dynamics, num_contacts=3)
    network = network_of(problem, problem.satellites[0])
    levels = energy_levels(network, per_collect)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contact_layers, "MAX_LAYERS", num_groups)
        layers = layers_of(network)
    rng = np.random.default_rng(seed)
    m = len(problem.opportunities)
    weight = rng.uniform(-0.3, 1.0, (len(layers.first), m))
    is_image = layers.number < 0
    weight[:, is_image] = np.where(weight[:, is_image] < 0.0, NEVER, weight[:, is_image])
    own, num_own = np.empty((m, levels.width)), np.zeros(m, dtype=np.int64)
    value, path, layer = most_by_contacts(network, levels, layers, weight, own, num_own)
    assert value == pytest.approx(max(0.0, best_by_enumeration(network, levels, layers, weight)))
    assert weight[layer, path].sum() == pytest.approx(value)
    assert np.all(np.diff(path) > 0)
    assert np.all(np.diff(layer) >= 0)


def multipliers_of(problem: Problem, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return multipliers of targets and contacts, some of them zero."""
    num_contacts = int((problem.opportunities.kind == CONTACT).sum())
    targets = rng.uniform(-0.5, 1.0, len(problem.target_ids)) * problem.best_worth
    contacts = rng.uniform(-10.0, 20.0, num_contacts)
    return np.maximum(targets, 0.0), np.maximum(contacts, 0.0)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(300)
@given(
    seed=SEEDS,
    collected_share=st.sampled_from([0.0, 0.3, 0.9]),
    half_life_s=st.floats(60.0, 2000.0),
    num_satellites=st.integers(1, 2),
    has_quality=st.booleans(),
)
def test_no_plan_beats_any_multipliers(
    dynamics: Dynamics,
    seed: int,
    collected_share: float,
    half_life_s: float,
    num_satellites: int,
    has_quality: bool,
) -> None:
    problem = _problem(
        seed, dynamics, num_satellites, num_collects=6, num_contacts=3, has_quality=has_quality
    )
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    problem = with_objective(problem, objective)
    best = best_reward(problem)
    rng = np.random.default_rng(seed)
    for _ in range(3):
        targets, contacts = multipliers_of(problem, rng)
        assert latency_value(problem, targets, contacts) >= best - 1e-9
    stop = np.zeros(1, dtype=np.uint8)
    ascent = LatencyAscent(problem, np.zeros(len(problem.target_ids)))
    ascent.improve(30, 0.0, stop)
    assert ascent.bound().value >= best - 1e-9
    assert quick_bound(problem, 0.0).value >= best - 1e-9


@examples(300)
@given(seed=SEEDS, num_satellites=st.integers(1, 2), half_life_s=st.floats(60.0, 2000.0))
def test_no_plan_beats_what_estimates_of_energy_lead_to(
    seed: int, num_satellites: int, half_life_s: float
) -> None:
    """With turns to the sun multipliers come from an estimate; their bound does not."""
    problem = sunny_problem(seed, num_satellites=num_satellites, num_collects=6, num_contacts=3)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=half_life_s))
    best = best_reward(problem)
    ascent = LatencyAscent(problem, np.zeros(len(problem.target_ids)))
    for _ in range(3):
        ascent.improve(5, best, np.zeros(1, dtype=np.uint8))
        assert ascent.bound(is_last=False).value >= best - 1e-9
    assert ascent.bound().value >= best - 1e-9
    assert latency_value(problem, ascent.multipliers, ascent.contact_multipliers) >= best - 1e-9


def test_groups_of_contacts_bound_all_plans_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contact_layers, "MAX_LAYERS", 2)
    rng = np.random.default_rng(0)
    for seed in range(60):
        problem = _problem(
            seed, "physical" if seed % 2 else "paper", num_collects=6, num_contacts=4
        )
        problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=300.0))
        best = best_reward(problem)
        assert latency_value(problem, *multipliers_of(problem, rng)) >= best - 1e-9


def test_small_problems_end_at_or_near_the_optimum() -> None:
    reached = 0
    for seed in range(40):
        problem = _problem(seed, "physical" if seed % 2 else "paper", 1, num_contacts=3)
        problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=400.0))
        reached += encloses(problem, best_reward(problem))
    assert reached >= 34


def test_a_multiplier_of_contacts_lowers_the_bound() -> None:
    """Contacts could each downlink only a few images, and cost almost no energy."""
    problem = random_problem(3, num_collects=200, num_targets=90, num_contacts=6, span_s=6000.0)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=900.0))
    free = latency_value(
        problem,
        np.zeros(len(problem.target_ids)),
        np.zeros(int((problem.opportunities.kind == CONTACT).sum())),
    )
    ascent = LatencyAscent(problem, np.zeros(len(problem.target_ids)))
    ascent.improve(60, 0.0, np.zeros(1, dtype=np.uint8))
    assert ascent.bound().value < free
    assert ascent.contact_sets
    assert quick_bound(problem, 0.0).value < free


def test_the_bound_of_a_plan_is_proven_by_its_document() -> None:
    problem = random_problem(3, num_collects=200, num_targets=90, num_contacts=6, span_s=6000.0)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=900.0))
    ascent = LatencyAscent(problem, np.zeros(len(problem.target_ids)))
    ascent.improve(40, 0.0, np.zeros(1, dtype=np.uint8))
    bound = replace(ascent.bound(), value=rounded_bound(problem, ascent.bound().value, 0.0))
    read = from_json(to_json(bound))
    assert read.contact_multipliers is not None
    assert read.multipliers is not None
    assert is_proven(problem, read)
    assert not is_proven(problem, replace(read, value=0.99 * read.value))
    dearer = replace(read, contact_multipliers=read.contact_multipliers + 1e3)
    assert not is_proven(problem, dearer)


def test_worth_in_a_queue_is_what_the_referee_awards() -> None:
    """Three images before a contact that downlinks two, and another contact later."""
    tasks = [collect(0, 100.0), collect(1, 150.0), collect(2, 200.0)]
    tasks += [contact(330.0, 390.0), contact(600.0, 700.0)]
    problem = make_problem(tasks, num_targets=3, resources=ROOMY)
    problem = with_objective(problem, Objective(collected_share=0.1, half_life_s=300.0))
    plan = Plan.of(problem, [0, 1, 2, 3, 4])
    earned = replay(problem, plan).collected
    worth = worth_with(problem, [3, 4], plan)
    assert worth[:3] == pytest.approx([earned[target].worth for target in range(3)])
    # An image waits for the images before it in the queue, not for those after it.
    alone = worth_with(problem, [3, 4], Plan.of(problem, [0, 3, 4]))
    assert alone[0] == pytest.approx(worth[0])
    assert alone[2] > worth[2]
    assert worth_with(problem, [4])[0] < worth_with(problem, [3, 4])[0]
    assert worth_with(problem, [])[0] == pytest.approx(0.1)


def test_plans_take_contacts_for_young_images() -> None:
    """With a short half-life a plan takes more contacts than if the time of delivery is free."""
    problem = random_problem(5, num_collects=240, num_targets=90, num_contacts=8, span_s=9000.0)
    young = with_objective(problem, Objective(collected_share=0.0, half_life_s=600.0))
    late = with_objective(problem, Objective.delivered())
    reward: dict[str, float] = {}
    for name, asked in (("young", young), ("late", late)):
        solution = Certified().solve(asked, Budget(), 0)
        timeline = replay(young, solution.plan)
        assert timeline.is_valid
        reward[name] = timeline.reward
        assert all(
            young.opportunities.kind[a.opportunity] in (COLLECT, CONTACT)
            for a in solution.plan.actions
        )
    assert reward["young"] > reward["late"]


@pytest.mark.parametrize("seed", [2, 3])
def test_a_fleet_earns_more_than_by_a_plan_that_knows_of_no_half_life(seed: int) -> None:
    problem = random_problem(
        seed, num_collects=400, num_targets=150, num_contacts=16, span_s=20_000.0,
        num_satellites=3, num_stations=2, resources=TIGHT,
    )  # fmt: skip
    hurried = with_objective(problem, Objective(collected_share=0.0, half_life_s=4000.0))
    lasting = with_objective(problem, Objective.delivered())
    told = partial(expiring, bounds_told(25))
    unhurried = Certified().solve(lasting, told(), 0).plan
    solution = Certified().solve(hurried, told(), 0)
    reward = replay(hurried, solution.plan).reward
    assert reward > replay(hurried, unhurried).reward
    assert solution.bound is not None
    assert solution.bound >= reward


def _fleet_in_a_hurry() -> Problem:
    problem = random_problem(2, num_collects=40, num_contacts=4, num_satellites=2)
    return with_objective(problem, Objective(collected_share=0.0, half_life_s=4000.0))


def _offering(*plans: Plan) -> Strategy:
    """Return a strategy for objectives without half-life that offers one plan per slice."""

    def slices(search: Search) -> Iterator[None]:
        for plan in plans:
            search.best.offer(plan)
            yield

    return Strategy(
        name="offers", supports=lambda p: p.objective.half_life_s is None, slices=slices
    )


def _plans_of_growing_worth() -> tuple[Problem, list[Plan]]:
    hurried = _fleet_in_a_hurry()
    plan = Certified().solve(hurried, expiring(bounds_told(2)), 0).plan
    return hurried, [Plan(plan.actions[:num]) for num in range(1, len(plan.actions) + 1)]


def test_a_fleet_s_search_without_the_half_life_gives_way_after_each_slice() -> None:
    """From its second plan on; the first is the rule's. It stops once a run ends as the last."""
    hurried, plans = _plans_of_growing_worth()
    search = Search(Incumbent(hurried, Budget(), 0.0), 0, [_offering(*plans)])
    full, known = search.engine(FullWorth), list[Plan]()
    for _ in plans_without_half_life(search):
        assert full.plan is not None
        assert search.best.reward >= replay(hurried, full.plan).reward
        known.append(full.plan)
    half = len(known) // 2
    assert known[:half] == known[half:]
    assert 1 < len(set(known)) < len(plans)
    lasting = with_objective(hurried, Objective.delivered())
    assert replay(lasting, known[-1]).reward == replay(lasting, plans[-1]).reward
    assert not full.is_going


def test_a_fleet_s_search_that_gains_nothing_ends_after_some_times() -> None:
    """Each run offers another plan, but the best one is known from the beginning."""
    hurried, plans = _plans_of_growing_worth()
    begun = list[int]()

    def slices(search: Search) -> Iterator[None]:
        begun.append(search.seed)
        search.best.offer(plans[-1 - search.seed])
        yield

    other = replace(_offering(), slices=slices)
    best = Incumbent(hurried, Budget(), 0.0, plan=plans[-1])
    with tuned(patience=3):
        list(plans_without_half_life(Search(best, 0, [other])))
    assert begun == [0, 1, 2]


def _days_begun(
    hurried: Problem, good: Plan, offered: Plan, monkeypatch: pytest.MonkeyPatch
) -> list[Plan]:
    """Return the plans from which days are replanned, without success."""
    begun = list[Plan]()

    def noted(_: Problem, plan: Plan, *args: object) -> None:
        begun.append(plan)

    monkeypatch.setattr(days, "replanned_day", noted)
    search = Search(Incumbent(hurried, Budget(), 0.0, plan=good), 0, STRATEGIES)
    full = search.engine(FullWorth)
    full.is_going = True
    slices = days.days(search)
    next(slices)
    assert not begun
    full.plan = offered
    next(slices)
    full.is_going = False
    list(slices)
    return begun


def test_a_fleet_s_days_wait_for_a_plan_and_begin_with_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The given plan may win, after contacts were added to it."""
    hurried, plans = _plans_of_growing_worth()
    begun = _days_begun(hurried, plans[-1], plans[-3], monkeypatch)
    assert replay(hurried, plans[-3]).reward < replay(hurried, plans[-1]).reward
    assert begun
    assert replay(hurried, begun[0]).reward >= replay(hurried, plans[-1]).reward


@pytest.mark.parametrize("fill_per_s", [0.0, ROOMY.collect_fill_per_s])
@pytest.mark.parametrize("num_contacts", [0, 1])
def test_missions_without_contacts_or_without_data_have_bounds_too(
    fill_per_s: float, num_contacts: int
) -> None:
    tasks = [collect(0, 100.0), collect(1, 150.0), *[contact(330.0, 390.0)] * num_contacts]
    resources = replace(ROOMY, collect_fill_per_s=fill_per_s)
    problem = make_problem(tasks, num_targets=2, resources=resources)
    problem = with_objective(problem, Objective(collected_share=0.5, half_life_s=300.0))
    assert quick_bound(problem, 0.0).value >= best_reward(problem) - 1e-9
    assert encloses(problem, best_reward(problem))


def test_a_large_problem_has_a_better_plan_before_its_bounds() -> None:
    """If one bound takes long, the plan must not wait for it."""
    num_better = 0
    for seed in range(10):
        problem = random_problem(
            seed, num_collects=200, num_targets=120, num_contacts=4, has_rewards=True
        )
        problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=3000.0))
        with tuned(large=3):
            budget = expiring(lambda _: True)
            timeline = replay(problem, Certified().solve(problem, budget, 0).plan)
        first = replay(problem, Rule().solve(problem, Budget(), 0).plan)
        assert timeline.is_valid
        assert timeline.reward >= first.reward
        num_better += timeline.reward > first.reward
    assert num_better >= 5
