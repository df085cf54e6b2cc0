"""The relaxation over slots of time, which bounds plans without regard to turns."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.whole_relaxation import relaxation_over_slots
from planner_core.certified.program import slot_table
from planner_core.certified.program.slots import has_slot_program
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.whole_program import RowMultipliers
from planner_core.certified.strategies.resources import slot_relaxation
from planner_core.certified.tuning import tuned
from planner_core.domain import Objective, Resources
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import COLLECT, Pinned, Problem, Sunlight
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.flat_earth import flat_problem
from tests.planner_core.problems import TIGHT, varied_problem

_SLOW_LINK = replace(TIGHT, downlink_per_s=0.5 * TIGHT.downlink_per_s)
_DRAINING = replace(TIGHT, idle_drain_per_s=0.1 * TIGHT.sunpoint_charge_per_s)
_FULL = replace(TIGHT, initial_battery_fraction=1.0)
_OBJECTIVES = (
    Objective.collected(),
    Objective.delivered(),
    Objective(collected_share=0.5),
    Objective(collected_share=0.9, half_life_s=300.0),
    Objective(collected_share=0.0, half_life_s=100.0),
)


def _problem(
    seed: int, resources: Resources, objective: Objective, num_satellites: int = 1
) -> Problem:
    """Return a problem with continuous starts, of which the table offers one every 60 s."""
    rng = np.random.default_rng(seed)
    problem = flat_problem(
        seed,
        num_targets=4 - num_satellites,
        num_satellites=num_satellites,
        horizon_s=400.0,
        spacing_s=60.0,
        use_resources=True,
        has_rewards=bool(seed % 2),
        num_contacts=int(rng.integers(0, 3)),
        resources=resources,
    )
    enter_s, exit_s = np.sort(rng.uniform(0.0, 500.0, 2))
    light = Sunlight(enter_s=np.array([enter_s]), exit_s=np.array([exit_s]))
    satellites = tuple(replace(one, sunlight=light) for one in problem.satellites)
    return with_objective(replace(problem, satellites=satellites), objective)


@examples(400)
@given(
    seed=st.integers(0, 10**6),
    resources=st.sampled_from([TIGHT, _SLOW_LINK, _DRAINING, _FULL]),
    objective=st.sampled_from(_OBJECTIVES),
    num_satellites=st.integers(1, 2),
    slot_s=st.sampled_from([10.0, 45.0, 120.0]),
)
def test_no_plan_with_starts_of_the_table_beats_it(
    seed: int, resources: Resources, objective: Objective, num_satellites: int, slot_s: float
) -> None:
    problem = _problem(seed, resources, objective, num_satellites)
    fixed = replace(problem, continuous_starts=False, pointing=None)
    assume(has_slot_program(problem))
    with patch.object(slot_table, "SLOT_S", slot_s):
        bound = relaxation_over_slots(problem, Budget(), 0)
        best = best_reward(fixed)
        assert bound.value >= best - 1e-6
        if has_slot_program(fixed):
            assert relaxation_over_slots(fixed, Budget(), 0).value >= best - 1e-6
        read = from_json(to_json(bound))
        assert is_proven(problem, read)
        too_low = 0.999 * bound.value - problem.reward_unit - 1e-6
        assert not is_proven(problem, replace(read, value=too_low))


@examples(200)
@given(
    seed=st.integers(0, 10**6),
    objective=st.sampled_from(_OBJECTIVES[:3]),
    num_satellites=st.integers(1, 2),
    slot_s=st.sampled_from([20.0, 120.0]),
)
def test_images_of_an_access_may_differ_in_worth(
    seed: int, objective: Objective, num_satellites: int, slot_s: float
) -> None:
    problem = with_objective(
        varied_problem(
            seed, "physical", num_satellites, scarce=_SLOW_LINK, num_collects=7, has_quality=True
        ),
        objective,
    )
    assume(has_slot_program(problem))
    with patch.object(slot_table, "SLOT_S", slot_s):
        bound = relaxation_over_slots(problem, Budget(), 0)
        assert bound.value >= best_reward(problem) - 1e-6
        read = from_json(to_json(bound))
        assert read.row_multipliers is not None
        assert read.row_multipliers.is_of_slots
        assert is_proven(problem, read)


def test_images_that_start_in_a_slot_are_one() -> None:
    problem = _problem(2, TIGHT, Objective.collected())
    fixed = replace(problem, continuous_starts=False, pointing=None)
    table = slot_table.slot_table(fixed, 0)
    start_s, access = fixed.opportunities.start_s, fixed.opportunities.access
    own = np.flatnonzero(fixed.opportunities.kind == COLLECT)
    slots = {(int(access[row]), int(start_s[row] // 100.0)) for row in own}
    assert table.num_slots == 4
    assert len(table.images.slot) == len(slots) < len(own)
    assert sorted(table.images.member) == sorted(own)
    for image, members in enumerate(np.split(table.images.member, table.images.first[1:])):
        assert table.images.from_s[image] == start_s[members].min()
        assert table.images.to_s[image] == start_s[members].max()
        assert len(set(access[members])) == 1


def test_energy_for_two_images_allows_no_third() -> None:
    """Each takes 0.3 of the battery, of which 0.7 may be used, and it is night."""
    resources = replace(Resources.limitless(), collect_drain_per_s=0.01, battery_min_fraction=0.3)
    problem = flat_problem(
        3, num_targets=8, horizon_s=600.0, use_resources=True, resources=resources
    )
    bound = relaxation_over_slots(problem, Budget(), 0)
    assert len({int(site) for site in problem.opportunities.site}) > 3
    assert bound.value == pytest.approx(0.7 / 0.3)


def test_what_idling_or_frozen_actions_break_is_no_limit() -> None:
    problem = flat_problem(1, num_contacts=1, use_resources=True)
    assert has_slot_program(problem)
    assert not has_slot_program(replace(problem, use_resources=False))
    assert not has_slot_program(replace(problem, dynamics="paper"))
    fixed = replace(problem, continuous_starts=False, pointing=None)
    assert has_slot_program(fixed)
    assert not has_slot_program(with_objective(fixed, _OBJECTIVES[-1]))
    assert not has_slot_program(flat_problem(1, num_targets=1, horizon_s=20.0, use_resources=True))
    frozen = apply_pins(problem, Pinned(frozen_until_s=10.0))
    assert not has_slot_program(frozen)
    for broken in (
        replace(TIGHT, initial_battery_fraction=TIGHT.battery_min_fraction),
        replace(TIGHT, telemetry_per_s=0.01),
        replace(TIGHT, idle_drain_per_s=0.1),
    ):
        satellites = tuple(replace(one, resources=broken) for one in problem.satellites)
        changed = replace(problem, satellites=satellites)
        assert replay(changed, Plan()) is not None
        assert not has_slot_program(changed)
        proof = RowMultipliers.of(np.zeros(0), is_of_slots=True)
        bound = Bound(value=100.0, proof="linear", row_multipliers=proof)
        assert is_proven(problem, bound)
        assert not is_proven(changed, bound)


def test_large_problems_go_without_it() -> None:
    problem = flat_problem(1, num_contacts=1, use_resources=True)

    def proofs() -> list[str]:
        search = Search(Incumbent(problem, Budget(), 0.0), 0, ())
        return [search.best.bound.proof for _ in slot_relaxation(search)]

    assert proofs() == ["linear"]
    with tuned(most_relaxed=len(np.unique(problem.opportunities.access)) - 1):
        assert proofs() == []
