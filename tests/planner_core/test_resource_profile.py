"""The referee's integration: the compiled kernel, compared with its plain Python."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.mdp.track import compile_track
from planner_core.problem.plan import Plan
from planner_core.referee.resource_profile import (
    Curve,
    advance,
    integrate,
    states_under,
    thin,
)
from tests.examples import examples
from tests.planner_core.problems import random_problem

_PER_S = st.sampled_from([0.0, 1e-9, 1e-4, 0.03, 0.5])
_LEVEL = st.sampled_from([0.0, 1e-17, 0.3, 0.999, 1.0 - 2**-53, 1.0])


@examples(200)
@given(
    spans_s=st.lists(st.floats(1e-6, 1e4), max_size=8),
    rates=st.lists(st.tuples(_PER_S, _PER_S, _PER_S, st.booleans()), min_size=8, max_size=8),
    battery=_LEVEL,
    recorder=_LEVEL,
)
def test_compiled_states_are_those_of_the_steps(
    spans_s: list[float],
    rates: list[tuple[float, float, float, bool]],
    battery: float,
    recorder: float,
) -> None:
    times = np.cumsum([0.0, *spans_s])
    table = np.array(
        [(-power if drains else power, fill, drain) for power, fill, drain, drains in rates]
    )[: len(spans_s)].copy(order="F")
    first = (0.0, battery, recorder, recorder, 0.0)
    point, states, at = first, [first], [0]
    for until_s, (power, fill, drain) in zip(times[1:], table, strict=True):
        while point[0] < until_s:
            point = advance(point, until_s, power, fill, drain)
            states.append(point)
        at.append(len(states) - 1)

    found, found_at = states_under(times, table[:, 0], table[:, 1], table[:, 2], first)

    np.testing.assert_allclose(found, states, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(found_at, at)
    assert found[:, 0].tolist() == sorted(found[:, 0])
    assert (found[:, 1:3] >= 0.0).all()
    assert (found[:, 1:3] <= 1.0).all()
    # All recorded data is downlinked, on board, or lost because the recorder was full.
    lost = found[-1, 3] - found[-1, 4] - found[-1, 2]
    assert lost >= -1e-9 * max(1.0, found[-1, 3])


def test_levels_at_the_start_may_be_whole_numbers() -> None:
    problem = random_problem(0, use_resources=True)
    (satellite, *others) = problem.satellites
    r = satellite.resources
    whole, real = (
        replace(
            problem,
            satellites=(
                replace(
                    satellite,
                    resources=replace(r, initial_battery_fraction=b, initial_recorder_fraction=d),
                ),
                *others,
            ),
        )
        for b, d in ((1, 0), (1.0, 0.0))
    )
    profiles = [integrate(p, p.satellites[0], Plan()) for p in (whole, real)]
    np.testing.assert_array_equal(profiles[0].curve, profiles[1].curve)
    # Kernels are compiled per argument type: the same types compile once.
    tracks = [
        compile_track(p, p.satellites[0], np.zeros(len(p.satellites[0]), dtype=np.uint8))
        for p in (whole, real)
    ]
    assert [type(v) for v in tracks[0]] == [type(v) for v in tracks[1]]


def test_curves_are_drawn_without_what_lies_on_a_line_or_repeats() -> None:
    battery = [0.5, 0.6, 0.7, 0.7, 0.65, 0.6, 0.6]
    recorder = [0.1, 0.2, 0.3, 0.3, 0.45, 0.6, 0.2]
    time_s = [0.0, 0.25, 0.5, 0.5, 0.75, 1.0, 1.0]
    nothing = [0.0] * len(time_s)
    states = np.array([time_s, battery, recorder, nothing, nothing])
    kept = [0, 3, 5, 6]
    drawn = thin(Curve(*states))
    assert [column.tolist() for column in drawn] == [
        [column[i] for i in kept] for column in (time_s, battery, recorder)
    ]
    assert [column.tolist() for column in thin(Curve(*states[:, :1]))] == [[0.0], [0.5], [0.1]]
    bent = states[:, :3].copy()
    bent[2, 1] = 0.21
    assert thin(Curve(*bent))[2].tolist() == [0.1, 0.21, 0.3]
