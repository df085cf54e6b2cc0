"""Clear-sky probability and urgency: their effect on worth, and which scenarios are refused."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Forecast, Quality, Scenario, SkySeries
from planner_core.errors import InvalidScenario
from planner_core.problem import COLLECT
from planner_core.valuation import worth_of_opportunities
from planner_core.worth import clear_probability_of
from tests.examples import examples
from tests.planner_core.test_worth import scenario

DAY_S = 86400.0


def series(target: list[int], time_s: list[float], clear: list[list[float]]) -> SkySeries:
    return SkySeries(
        target=np.array(target), time_s=np.array(time_s), clear_probability=np.array(clear)
    )


def forecast(number: int, seed: int = 0) -> Forecast:
    """Return forecasts for all targets, half of them every three hours, half every five."""
    draw = np.random.default_rng(seed)
    halves = np.arange(0, number, 2), np.arange(1, number, 2)
    times_s = np.arange(0.0, 1.2 * DAY_S, 10800.0), np.arange(0.0, 1.3 * DAY_S, 18000.0)
    return Forecast(
        series=tuple(
            series(half.tolist(), t.tolist(), draw.random((len(half), len(t))).tolist())
            for half, t in zip(halves, times_s, strict=True)
        )
    )


@examples(50)
@given(st.integers(0, 10_000))
def test_skies_are_linear_in_time(seed: int) -> None:
    draw = np.random.default_rng(seed)
    skies = forecast(9, seed)
    target = draw.integers(0, 9, 40)
    at_s = draw.random(40) * 1.1 * DAY_S
    at_s[:2] = 0.0, 10800.0
    found = clear_probability_of(skies, target, at_s, 9)
    for i, t, clear in zip(target, at_s, found, strict=True):
        own = skies.series[i % 2]
        values = own.clear_probability[np.flatnonzero(own.target == i)[0]]
        assert clear == pytest.approx(np.interp(t, own.time_s, values), abs=1e-12)


def test_what_no_series_covers_has_the_default() -> None:
    skies = Forecast(
        series=(series([1], [100.0, 200.0], [[0.2, 0.4]]), series([3], [150.0], [[0.9]])),
        default_clear_probability=0.5,
    )
    target = np.array([0, 1, 1, 1, 1, 1, 3, 3])
    at_s = np.array([150.0, 99.0, 100.0, 150.0, 200.0, 201.0, 150.0, 151.0])
    expected = [0.5, 0.5, 0.2, 0.3, 0.4, 0.5, 0.9, 0.5]
    assert clear_probability_of(skies, target, at_s, 4) == pytest.approx(expected)


def test_without_a_forecast_every_sky_is_clear() -> None:
    assert clear_probability_of(None, np.array([0, 1]), np.zeros(2), 2).tolist() == [1.0, 1.0]


def test_collects_are_worth_reward_times_everything_that_lessens_it() -> None:
    asked = scenario(Quality(off_nadir_deg=((0.0, 1.0), (45.0, 0.5))))
    start = asked.horizon.start
    targets = [
        replace(
            target,
            reward_half_life_s=[None, 7200.0, 43200.0][i % 3],
            release=[None, start - timedelta(hours=5), start + timedelta(hours=3)][i // 3 % 3],
        )
        for i, target in enumerate(asked.targets)
    ]
    asked = replace(asked, targets=tuple(targets), forecast=forecast(len(targets)))
    computed = compute_opportunities(asked, Budget())
    problem = build_problem(asked, computed, Budget())
    table = problem.opportunities
    checked = 0
    for row in np.flatnonzero(table.kind == COLLECT).tolist():
        target = targets[table.site[row]]
        own = asked.forecast.series[table.site[row] % 2] if asked.forecast else None
        assert own is not None
        values = own.clear_probability[np.flatnonzero(own.target == table.site[row])[0]]
        middle_s = (table.start_s[row] + table.end_s[row]) / 2
        worth = target.reward * np.interp(table.off_nadir_deg[row], [0, 45], [1, 0.5])
        worth *= np.interp(middle_s, own.time_s, values)
        if target.reward_half_life_s is not None:
            asked_s = 0.0
            if target.release is not None:
                asked_s = (target.release - start).total_seconds()
            worth *= 0.5 ** ((table.start_s[row] - asked_s) / target.reward_half_life_s)
            checked += 1
        assert problem.worth[row] == pytest.approx(worth, rel=1e-6)
    assert checked > 5


def test_rewards_begin_to_fall_when_a_target_is_released() -> None:
    asked = scenario(Quality())
    targets = [
        replace(target, reward=4.0, reward_half_life_s=1.0, release=asked.horizon.instant(60.0))
        for target in asked.targets
    ]
    table = build_problem(asked, compute_opportunities(asked, Budget()), Budget()).opportunities
    start_s = np.full(len(table), 59.5)
    start_s[1:3] = 60.0, 61.0
    asked = replace(asked, targets=tuple(targets))
    worth = worth_of_opportunities(asked, replace(table, start_s=start_s))
    assert worth[:3] == pytest.approx([4.0, 4.0, 2.0])


def test_opportunities_do_not_depend_on_weather_and_urgency() -> None:
    plain = scenario(Quality())
    targets = tuple(replace(target, reward_half_life_s=3600.0) for target in plain.targets)
    urgent = replace(plain, targets=targets, forecast=forecast(len(targets)))
    first, second = (compute_opportunities(asked, Budget()) for asked in (plain, urgent))
    assert first.to_bytes() == second.to_bytes()


def covered(asked: Scenario, first_s: float, last_s: float, targets: list[int]) -> Forecast:
    values = np.full((len(targets), 2), 0.5).tolist()
    return Forecast(series=(series(targets, [first_s, last_s], values),))


def test_a_forecast_that_does_not_cover_the_question_is_refused() -> None:
    asked = scenario(Quality())
    number, length_s = len(asked.targets), asked.horizon.duration_s
    every = list(range(number))
    replace(asked, forecast=covered(asked, 0.0, length_s, every))
    cases = [
        (60.0, length_s, every, 0, 0.0),
        (0.0, length_s - 1.0, every, 0, length_s - 1.0),
        (0.0, length_s, [0, 1, 3], 2, 0.0),
    ]
    for first_s, last_s, targets, position, at_s in cases:
        with pytest.raises(InvalidScenario) as caught:
            replace(asked, forecast=covered(asked, first_s, last_s, targets))
        fault = caught.value.fault
        assert (fault.code, fault.pointer) == (
            "forecast_does_not_cover",
            f"/targets/{position}",
        )
        assert repr(asked.targets[position].id) in fault.detail
        assert f"{asked.horizon.instant(at_s):%Y-%m-%dT%H:%M:%SZ}" in fault.detail
        default = replace(covered(asked, first_s, last_s, targets), default_clear_probability=0.4)
        replace(asked, forecast=default)


def test_only_the_times_of_a_target_need_be_covered() -> None:
    asked = scenario(Quality())
    start = asked.horizon.start
    late = replace(
        asked.targets[0], release=start + timedelta(hours=2), due=start + timedelta(hours=5)
    )
    asked = replace(asked, targets=(late, *asked.targets[1:]))
    others = list(range(1, len(asked.targets)))
    all_day = covered(asked, 0.0, asked.horizon.duration_s, others).series
    replace(asked, forecast=Forecast(series=(*all_day, series([0], [7200, 18000], [[0.1, 0.2]]))))
    short = Forecast(series=(*all_day, series([0], [7200, 17999], [[0.1, 0.2]])))
    with pytest.raises(InvalidScenario):
        replace(asked, forecast=short)


def test_falling_rewards_need_known_starts() -> None:
    asked = scenario(Quality())
    urgent = tuple(replace(target, reward_half_life_s=60.0) for target in asked.targets)
    with pytest.raises(InvalidScenario, match="reward_half_life_s") as caught:
        replace(asked, targets=urgent, continuous_starts=True)
    assert caught.value.fault.pointer == "/continuous_starts"


@pytest.mark.parametrize(
    ("fields", "pointer"),
    [
        ({"time_s": np.array([0.0, 0.0])}, "/times"),
        ({"time_s": np.empty(0), "clear_probability": np.empty((1, 0))}, "/times"),
        ({"clear_probability": np.array([[0.1, 1.1]])}, "/clear_probability"),
        ({"clear_probability": np.array([[0.1, np.nan]])}, "/clear_probability"),
        ({"clear_probability": np.array([[0.1]])}, "/clear_probability"),
    ],
)
def test_series_that_cannot_be_are_refused(fields: dict[str, object], pointer: str) -> None:
    good = series([0], [0.0, 60.0], [[0.1, 0.2]])
    with pytest.raises(InvalidScenario) as caught:
        replace(good, **fields)  # type: ignore[arg-type]
    assert caught.value.fault.pointer == pointer
    with pytest.raises(InvalidScenario, match="two of them"):
        Forecast(series=(good, good))
