"""Networks: paths on covering arcs are as heavy as paths through all that may follow."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.domain import Agility
from planner_core.precedence.network import heaviest_through, network_of
from planner_core.problem import Floats, Problem
from tests.examples import examples
from tests.planner_core.problems import random_problem


def readable(problem: Problem, worth: Floats) -> tuple[float, Floats]:
    """Return the same as ``heaviest_through``, by trying every pair."""
    total, own = 0.0, np.zeros(len(problem.satellites))
    through = np.empty(len(worth))
    for index, satellite in enumerate(problem.satellites):
        m, weight = len(satellite), worth[satellite.rows]
        up_to, onward = weight.copy(), weight.copy()
        for b in range(m):
            before = [up_to[a] for a in range(b) if satellite.transitions.allows(a, b)]
            up_to[b] += max(before, default=0.0)
        for a in reversed(range(m)):
            after = [onward[b] for b in range(a + 1, m) if satellite.transitions.allows(a, b)]
            onward[a] += max(after, default=0.0)
        own[index] = up_to.max(initial=0.0)
        through[satellite.rows] = up_to + onward - weight - own[index]
        total += own[index]
    return total, through + total


@pytest.mark.parametrize("slew_rate_deg_s", [1.0, 0.3])
@examples(60)
@given(
    seed=st.integers(0, 10**6), num_satellites=st.integers(1, 4), size=st.integers(0, 40),
    num_offers=st.sampled_from([1, 1, 6]), span_s=st.sampled_from([900.0, 4000.0]),
    settle_s=st.sampled_from([0.0, 7.0]),
)  # fmt: skip
def test_paths_and_detours_are_the_heaviest(
    slew_rate_deg_s: float,
    seed: int,
    num_satellites: int,
    size: int,
    num_offers: int,
    span_s: float,
    settle_s: float,
) -> None:
    """In parts of the horizon as well as over it, with one collect in an access or several."""
    problem = random_problem(
        seed, use_resources=False, num_collects=size, num_satellites=num_satellites,
        num_offers=num_offers, span_s=span_s, max_turn_deg=25.0,
        agility=Agility(slew_rate_deg_s=slew_rate_deg_s, settle_s=settle_s),
    )  # fmt: skip
    size *= num_offers
    rng = np.random.default_rng(seed)
    # Nothing at all is worth half of the tasks: slow satellites pass through those too.
    worth = rng.uniform(0.0, 5.0, size) * rng.integers(0, 2, size)
    network = network_of(problem)
    total, through = heaviest_through(network, worth[network.row])
    expected_total, expected = readable(problem, worth)
    assert total == pytest.approx(expected_total)
    np.testing.assert_allclose(through, expected[network.row], atol=1e-9)
