"""Opportunities derived from an earlier scenario equal those computed from scratch."""

from __future__ import annotations

from dataclasses import fields, replace
from datetime import timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import planner_core.access.opportunities_after
from benchmarks.missions import ORBIT, paper_scenario
from planner_core.access.opportunities_after import opportunities_after
from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import Forecast, Horizon, Objective, Replan, Scenario, Target
from planner_core.pins import PinnedAction
from planner_core.problem import Opportunities
from planner_core.replanning.plan_before import PlanBefore
from tests.examples import examples


def mission(num_targets: int, seed: int = 0) -> Scenario:
    whole = paper_scenario(num_targets, seed, use_resources=True)
    (one,) = whole.satellites
    other = replace(one, id="other", orbit=replace(ORBIT, raan_deg=90.0, norad_cat_id=2))
    horizon = Horizon(start=whole.horizon.start, end=whole.horizon.start + timedelta(hours=6))
    return replace(whole, satellites=(one, other), horizon=horizon)


def assert_same(found: ScenarioOpportunities, expected: ScenarioOpportunities) -> None:
    for field in fields(Opportunities):
        ours, theirs = (getattr(o.opportunities, field.name) for o in (found, expected))
        assert ours.dtype == theirs.dtype, field.name
        np.testing.assert_array_equal(ours, theirs, err_msg=field.name)
    np.testing.assert_array_equal(found.target_access, expected.target_access)
    for ours, theirs in zip(found.sunlight, expected.sunlight, strict=True):
        np.testing.assert_array_equal(ours.enter_s, theirs.enter_s)
        np.testing.assert_array_equal(ours.exit_s, theirs.exit_s)
    assert found.warnings == expected.warnings


@examples(15)
@given(
    seed=st.integers(0, 1000),
    num_new=st.integers(0, 6),
    is_spaced=st.booleans(),
    data=st.data(),
)
def test_it_is_bit_for_bit_what_is_computed_from_nothing(
    seed: int, num_new: int, is_spaced: bool, data: st.DataObject
) -> None:
    whole = mission(40, seed)
    if is_spaced:
        whole = replace(whole, collect_spacing_s=20.0)
    before = replace(whole, targets=whole.targets[num_new:])
    known = compute_opportunities(before, Budget())
    kept = [t for t in before.targets if data.draw(st.integers(0, 9)) > 0]
    dearer = [replace(t, reward=3.0) if i % 5 == 0 else t for i, t in enumerate(kept)]
    moved = [replace(t, lat_deg=-t.lat_deg) if i % 11 == 3 else t for i, t in enumerate(dearer)]
    targets: list[Target] = data.draw(st.permutations([*moved, *whole.targets[:num_new]]))
    asked = replace(whole, targets=tuple(targets))
    assert_same(
        opportunities_after(asked, before, known, Budget()), compute_opportunities(asked, Budget())
    )


def test_only_what_is_new_is_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = mission(40)
    before = replace(whole, targets=whole.targets[1:])
    known = compute_opportunities(before, Budget())
    computed: list[int] = []

    def counted(scenario: Scenario, budget: Budget) -> ScenarioOpportunities:
        computed.append(len(scenario.targets))
        return compute_opportunities(scenario, budget)

    monkeypatch.setattr(planner_core.access.opportunities_after, "compute_opportunities", counted)
    opportunities_after(before, before, known, Budget())
    assert computed == []
    opportunities_after(whole, before, known, Budget())
    assert computed == [1]
    end = whole.horizon.end + timedelta(hours=1)
    longer = replace(whole, horizon=Horizon(start=whole.horizon.start, end=end))
    assert_same(
        opportunities_after(longer, before, known, Budget()),
        compute_opportunities(longer, Budget()),
    )
    assert computed == [1, 40]


def base_of(scenario: Scenario) -> Replan:
    """Return a replan based on a plan of the first five targets."""
    start = scenario.horizon.start
    return Replan(
        base=tuple(
            PinnedAction(satellite_id=scenario.satellites[0].id, target_id=target.id, start=start)
            for target in scenario.targets[:5]
        ),
        freeze_until=start,
    )


def test_what_is_asked_is_what_is_new_dearer_or_open_again() -> None:
    whole = mission(40)
    before = replace(whole, targets=whole.targets[1:])
    imaged = frozenset(target.id for target in before.targets[:5])
    earlier = PlanBefore(
        scenario=before, opportunities=compute_opportunities(before, Budget()), imaged=imaged
    )
    replan = base_of(before)
    again = replace(before, replan=replan)
    assert earlier.asked_by(again) == frozenset()
    assert earlier.asked_by(replace(whole, replan=replan)) == frozenset({whole.targets[0].id})
    dearer = replace(before.targets[7], reward=9.0)
    targets = (*before.targets[:7], dearer, *before.targets[8:])
    assert earlier.asked_by(replace(again, targets=targets)) == frozenset({dearer.id})
    less = replace(again, replan=replace(replan, base=replan.base[1:]))
    assert earlier.asked_by(less) == frozenset({before.targets[0].id})


def test_nothing_is_known_to_be_asked_where_more_has_changed() -> None:
    before = mission(40)
    found = compute_opportunities(before, Budget())
    earlier = PlanBefore(scenario=before, opportunities=found, imaged=frozenset())
    again = replace(before, replan=base_of(before))
    assert earlier.asked_by(again) == frozenset()
    assert earlier.asked_by(before) is None
    assert replace(earlier, imaged=None).asked_by(again) is None
    end = before.horizon.end + timedelta(hours=1)
    longer = replace(again, horizon=Horizon(start=before.horizon.start, end=end))
    assert earlier.asked_by(longer) is None
    assert earlier.asked_by(replace(again, objective=Objective(collected_share=0.5))) is None
    clouds = Forecast(default_clear_probability=0.5)
    assert earlier.asked_by(replace(again, forecast=clouds)) is None
