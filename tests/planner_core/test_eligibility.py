"""Release and due times and sensor types: what they exclude, and the reasons given for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.scenario_opportunities import (
    _REASONS,
    ScenarioOpportunities,
    compute_opportunities,
)
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Scenario, Sensor, Target
from planner_core.errors import InvalidScenario
from planner_core.problem import (
    ACCESS_FOUND,
    ACCESS_TOO_SHORT,
    BETWEEN_STARTS,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    OUTSIDE_TIMES,
    WRONG_SENSOR_TYPE,
)
from planner_core.problem.plan import Action, Plan
from planner_core.problem.restrict import restricted
from planner_core.reasons.access_changes import access_changes
from planner_core.reasons.explain import explain
from planner_core.reasons.what_if import Relaxation, relaxed
from planner_core.referee.replay import replay
from planner_core.solvers.registry import SOLVERS
from tests.examples import examples
from tests.geometry import YEAR_2019, hours, orbit, satellite
from tests.planner_core.brute_force import best_reward

NUM_TARGETS = 12


def at(offset_s: float) -> datetime:
    return YEAR_2019 + timedelta(seconds=offset_s)


@cache
def everything() -> tuple[Scenario, ScenarioOpportunities]:
    """Return two satellites, one behind the other, over many targets without requirements."""
    rng = np.random.default_rng(5)
    scenario = Scenario(
        horizon=hours(0.5),
        satellites=(
            satellite(name="a", sensor=Sensor(sensor_type="visible")),
            satellite(orbit(mean_anomaly_deg=-2.0), name="b", sensor=Sensor()),
        ),
        targets=tuple(
            Target(
                id=f"t{i}",
                lat_deg=float(rng.uniform(10.0, 26.0)),
                lon_deg=float(rng.uniform(-104.0, -97.0)),
                reward=float(rng.integers(1, 5)),
            )
            for i in range(NUM_TARGETS)
        ),
        use_resources=False,
        collect_spacing_s=20.0,
        collect_alignment="horizon",
    )
    return scenario, compute_opportunities(scenario, Budget())


def asking(scenario: Scenario, seed: int) -> Scenario:
    """Return the scenario with times and sensor types required by some of its targets."""
    rng = np.random.default_rng(seed)
    targets = []
    for target in scenario.targets:
        release_s = float(rng.integers(0, 300)) if rng.integers(2) else None
        due_s = float(rng.integers(301, 700)) if rng.integers(2) else None
        if rng.integers(4) == 0:
            release_s, due_s = None, float(rng.integers(100, 500))
        targets.append(
            replace(
                target,
                release=None if release_s is None else at(release_s),
                due=None if due_s is None else at(due_s),
                sensor_type=[None, None, "visible", "infrared"][int(rng.integers(4))],
            )
        )
    return replace(scenario, targets=tuple(targets))


def allowed_rows(scenario: Scenario, whole: ScenarioOpportunities) -> np.ndarray:
    """Return the opportunities that times and types allow, checked one by one."""
    table = whole.opportunities
    rows = []
    for row in range(len(table)):
        target = scenario.targets[int(table.site[row])]
        sensor = scenario.satellites[int(table.satellite[row])].sensor
        start, end = at(float(table.start_s[row])), at(float(table.end_s[row]))
        if (
            (target.release is None or start >= target.release)
            and (target.due is None or end <= target.due)
            and (target.sensor_type is None or target.sensor_type == sensor.sensor_type)
        ):
            rows.append(row)
    return np.array(rows, dtype=np.int32)


@examples(25)
@given(seed=st.integers(0, 10**6))
def test_on_a_grid_exactly_the_collects_in_time_of_the_right_type_are_left(seed: int) -> None:
    scenario, whole = everything()
    asked = asking(scenario, seed)
    found = compute_opportunities(asked, Budget()).opportunities
    rows = allowed_rows(asked, whole)
    for name in ("satellite", "site", "start_s", "end_s"):
        assert getattr(found, name).tolist() == getattr(whole.opportunities, name)[rows].tolist()


@pytest.mark.parametrize("solver", ["rule", "graph", "milp", "certified"])
@pytest.mark.parametrize("seed", range(3))
def test_plans_honour_times_and_types_and_exact_ones_are_the_best(solver: str, seed: int) -> None:
    scenario, _ = everything()
    unasked = replace(scenario, targets=scenario.targets[:7], collect_spacing_s=100.0)
    few = asking(unasked, seed)
    computed = compute_opportunities(unasked, Budget())
    problem = build_problem(few, compute_opportunities(few, Budget()), Budget())
    solution = SOLVERS[solver]().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    apart = restricted(build_problem(unasked, computed, Budget()), allowed_rows(few, computed))
    best = best_reward(apart)
    assert best > 0.0
    assert timeline.reward <= best
    if SOLVERS[solver].exact:
        assert timeline.reward == best


@given(
    release_s=st.integers(0, 900_000).map(lambda ms: ms / 1000.0),
    length_s=st.integers(1, 900_000).map(lambda ms: ms / 1000.0),
)
@examples(30)
def test_centred_collects_lie_in_the_middle_of_what_times_leave(
    release_s: float, length_s: float
) -> None:
    scenario, _ = everything()
    alone = replace(scenario, collect_spacing_s=None, collect_alignment="access")
    free = compute_opportunities(alone, Budget()).opportunities
    times: dict[str, Any] = {"release": at(release_s), "due": at(release_s + length_s)}
    found = compute_opportunities(
        replace(alone, targets=tuple(replace(t, **times) for t in alone.targets)), Budget()
    ).opportunities
    start_s = np.maximum(free.access_start_s, release_s)
    end_s = np.minimum(free.access_end_s, release_s + length_s)
    kept = end_s - start_s >= 30.0 - 1e-6
    assert len(found) == np.count_nonzero(kept)
    middles = sorted(((start_s + end_s) / 2.0)[kept].tolist())
    assert sorted(((found.start_s + found.end_s) / 2.0).tolist()) == pytest.approx(
        middles, abs=0.001
    )


def test_the_referee_rejects_a_collect_outside_its_times() -> None:
    scenario, _ = everything()
    free = replace(scenario, collect_spacing_s=None, collect_alignment="access")
    free = replace(free, continuous_starts=True)
    table = compute_opportunities(free, Budget()).opportunities
    row = int(np.argmax(table.access_end_s - table.access_start_s))
    begin_s, end_s = float(table.access_start_s[row]), float(table.access_end_s[row])
    assert end_s - begin_s > 60.0
    name = scenario.targets[int(table.site[row])].id
    times: dict[str, Any] = {"release": at(begin_s + 10.0), "due": at(end_s - 10.0)}
    asked = replace(
        free, targets=tuple(replace(t, **times) if t.id == name else t for t in free.targets)
    )
    problem = build_problem(asked, compute_opportunities(asked, Budget()), Budget())
    own = problem.opportunities
    (again,) = [
        i
        for i in range(len(own))
        if own.site[i] == table.site[row]
        and own.satellite[i] == table.satellite[row]
        and begin_s <= own.start_s[i] < end_s
    ]

    def judged(start_s: float) -> list[str]:
        action = Action(start_s, start_s + 30.0, again)
        return [v.code for v in replay(problem, Plan((action,))).violations]

    assert judged(begin_s + 10.0) == judged(end_s - 40.0) == []
    assert judged(begin_s + 9.999) == judged(end_s - 39.999) == ["window"]


def target(**fields: Any) -> Target:
    """Return a target near the equator, with the given fields."""
    near: dict[str, Any] = {"id": "t", "lat_deg": 3.0, "lon_deg": 0.0}
    return Target(**near | fields)


def low_and_typed(**of_target: Any) -> Scenario:
    """Return one target under an equatorial orbit with a visible sensor."""
    return Scenario(
        horizon=hours(6.0),
        satellites=(
            satellite(
                orbit(inclination_deg=0.01), name="low", sensor=Sensor(sensor_type="visible")
            ),
        ),
        targets=(target(**of_target),),
        use_resources=False,
    )


@pytest.mark.parametrize(
    ("of_target", "why", "words"),
    [
        ({}, ACCESS_FOUND, ""),
        ({"sensor_type": "visible"}, ACCESS_FOUND, ""),
        ({"sensor_type": "infrared"}, WRONG_SENSOR_TYPE, "none with its sensor type"),
        ({"sensor_type": "infrared", "lat_deg": 90.0}, NEVER_VISIBLE, "rises above"),
        ({"sensor_type": "visible", "lat_deg": 20.0}, OUTSIDE_LIMITS, "limits of the sensor"),
        ({"collect_s": 3000.0, "due": at(60.0)}, ACCESS_TOO_SHORT, "shorter than its collect"),
        ({"release": at(60.0), "due": at(80.0)}, OUTSIDE_TIMES, "between its release and due"),
        ({"due": at(-86400.0)}, OUTSIDE_TIMES, "between its release and due"),
        ({"release": at(86400.0)}, OUTSIDE_TIMES, "between its release and due"),
    ],
)
def test_a_target_that_may_not_be_imaged_has_its_proven_reason(
    of_target: dict[str, Any], why: int, words: str
) -> None:
    scenario = low_and_typed(**of_target)
    computed = compute_opportunities(scenario, Budget())
    assert computed.target_access.tolist() == [why]
    problem = build_problem(scenario, computed, Budget())
    (outcome,) = explain(problem, Plan(), replay(problem, Plan()))
    assert outcome.reason is not None
    if words:
        assert (outcome.reason.code, outcome.reason.certainty) == ("no_access", "proven")
        assert words in outcome.reason.detail


def test_of_several_satellites_the_reason_is_the_one_nearest_to_a_collect() -> None:
    low = low_and_typed()
    polar = satellite(orbit(), name="polar", sensor=Sensor(sensor_type="infrared"))
    kinds: list[dict[str, Any]] = [
        {"sensor_type": sensor_type, "lat_deg": lat_deg, "lon_deg": lon_deg, **more}
        for sensor_type in (None, "visible", "infrared")
        for lat_deg in (0.5, 20.0, 60.0, 89.0)
        for lon_deg in (0.0, 120.0)
        for more in ({}, {"collect_s": 3000.0}, {"due": at(-86400.0)})
    ]
    targets = tuple(target(**{**kind, "id": f"t{i}"}) for i, kind in enumerate(kinds))
    both = replace(low, satellites=(*low.satellites, polar), targets=targets)
    found = compute_opportunities(both, Budget()).target_access
    each = [
        compute_opportunities(replace(both, satellites=(one,)), Budget()).target_access.tolist()
        for one in both.satellites
    ]
    nearest_first = _REASONS.tolist()[::-1]
    assert found.tolist() == [min(one, key=nearest_first.index) for one in zip(*each, strict=True)]
    assert len(set(found.tolist())) > 4


def test_a_grid_that_no_access_meets_is_said_so() -> None:
    scenario = replace(low_and_typed(), collect_spacing_s=6000.0, collect_alignment="horizon")
    computed = compute_opportunities(scenario, Budget())
    assert computed.target_access.tolist() == [BETWEEN_STARTS]


def test_what_is_said_to_give_access_does_and_nothing_less() -> None:
    first = compute_opportunities(low_and_typed(), Budget()).opportunities
    begin_s, end_s = float(first.access_start_s[0]), float(first.access_end_s[0])
    scenario = low_and_typed(due=at(begin_s + 10.0))
    cases: list[tuple[Scenario, str, Callable[[Any], Any]]] = [
        (scenario, "due", lambda value: value - timedelta(seconds=1)),
        (
            low_and_typed(release=at(end_s - 10.0), due=at(end_s + 600.0)),
            "release",
            lambda value: value + timedelta(seconds=1),
        ),
    ]
    for asked, setting, tighter in cases:
        change = next(c for c in access_changes(asked, 0, Budget()) if c.setting == setting)
        for value, enough in ((change.value, True), (tighter(change.value), False)):
            looser = relaxed(asked, Relaxation(targets={"t": {setting: value}}))
            found = compute_opportunities(looser, Budget()).target_access[0] == ACCESS_FOUND
            assert found == enough


def test_another_sensor_type_is_said_to_give_access() -> None:
    changes = access_changes(low_and_typed(sensor_type="infrared"), 0, Budget())
    assert [(c.setting, c.value) for c in changes] == [("sensor_type", None)]


@pytest.mark.parametrize(
    ("bad", "pointer"),
    [
        ({"release": at(10.0), "due": at(10.0)}, "/due"),
        ({"release": datetime(2019, 1, 1)}, "/release"),  # noqa: DTZ001 - that is the point
        ({"sensor_type": ""}, "/sensor_type"),
        ({"sensor_type": "x" * 101}, "/sensor_type"),
        ({"sensor_type": "a\nb"}, "/sensor_type"),
    ],
)
def test_what_no_target_can_ask_for_is_refused(bad: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidScenario) as caught:
        target(**bad)
    assert caught.value.fault.pointer == pointer


def test_an_alignment_without_its_spacing_is_refused() -> None:
    for change in ({"collect_spacing_s": None}, {"continuous_starts": True}):
        with pytest.raises(InvalidScenario) as caught:
            replace(everything()[0], **change)
        assert caught.value.fault.pointer == "/collect_alignment"
