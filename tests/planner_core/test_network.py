"""Longest paths over a skyline of labels are as heavy as those over all transitions."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.certified.dp.elementary import elementary_paths, labels_for, memory_of
from planner_core.domain import Agility
from planner_core.precedence.arcs import arc_network_of
from planner_core.precedence.network import (
    heaviest_paths,
    heaviest_through,
    network_of,
    part_ends,
)
from planner_core.precedence.readable import heaviest_to_each
from planner_core.precedence.relation import direct_precedence, is_transitive
from planner_core.problem import Floats, Problem
from tests.examples import examples
from tests.planner_core.problems import random_problem

AGILITIES: Final = st.builds(
    Agility,
    slew_rate_deg_s=st.sampled_from([1.0, 0.3]),
    acceleration_deg_s2=st.sampled_from([None, None, 0.05]),
    settle_s=st.sampled_from([0.0, 7.0]),
)
WEIGHTS: Final = st.sampled_from(["equal", "random", "mostly nothing", "hardly anything"])


def weights(seed: int, kind: str, number: int) -> Floats:
    """Return tasks' worths; slow satellites also pass through worthless tasks."""
    rng = np.random.default_rng(seed)
    if kind == "equal":
        return np.ones(number)
    worth = rng.uniform(0.0, 5.0, number)
    if kind == "mostly nothing":
        worth *= rng.integers(0, 2, number)
    if kind == "hardly anything":  # as multipliers leave it
        worth = np.where(rng.random(number) < 0.7, 1e-3 * worth, worth)
    return worth


def readable(problem: Problem, worth: Floats) -> tuple[float, Floats]:
    """Return the result of ``heaviest_through``, by trying every pair."""
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


def longest(problem: Problem, worth: Floats) -> tuple[float, list[list[int]]]:
    """Return the worth of the heaviest paths, and their rows, part by part."""
    network = network_of(problem)
    n = len(network.row)
    value, previous = np.empty(n), np.empty(n, dtype=np.int32)
    ends = np.empty(len(network.first) - 1, dtype=np.int32)
    total = heaviest_paths(network, worth[network.row], value, previous, ends)
    paths = []
    for end in ends.tolist():
        path, node = [], end
        while node >= 0:
            path.append(int(network.row[node]))
            node = int(previous[node])
        paths.append(path[::-1])
    return total, paths


@examples(150)
@given(
    seed=st.integers(0, 10**6), num_satellites=st.integers(1, 4), size=st.integers(0, 40),
    num_offers=st.sampled_from([1, 1, 6]), num_contacts=st.sampled_from([0, 12]),
    span_s=st.sampled_from([900.0, 4000.0]), agility=AGILITIES, kind=WEIGHTS,
)  # fmt: skip
def test_paths_and_detours_are_the_heaviest(
    seed: int,
    num_satellites: int,
    size: int,
    num_offers: int,
    num_contacts: int,
    span_s: float,
    agility: Agility,
    kind: str,
) -> None:
    """Over the whole horizon and parts of it, with one collect per access or several.

    With contacts, ends are not in the order of starts.
    """
    problem = random_problem(
        seed, use_resources=num_contacts > 0, num_collects=size, num_contacts=num_contacts,
        num_satellites=num_satellites, num_offers=num_offers, span_s=span_s, max_turn_deg=25.0,
        agility=agility,
    )  # fmt: skip
    worth = weights(seed, kind, len(problem.opportunities))
    expected_total, expected = readable(problem, worth)
    network = network_of(problem)
    total, through = heaviest_through(network, worth[network.row])
    assert total == pytest.approx(expected_total)
    np.testing.assert_allclose(through, expected[network.row], atol=1e-9)
    in_python = [heaviest_to_each(s.transitions, worth[s.rows]) for s in problem.satellites]
    assert sum(value.max(initial=0.0) for value in in_python) == pytest.approx(expected_total)
    total, paths = longest(problem, worth)
    assert total == pytest.approx(expected_total)
    assert sum(worth[path].sum() for path in paths) == pytest.approx(expected_total)
    for path in paths:
        own = problem.satellites[problem.opportunities.satellite[path[0]]] if path else None
        for a, b in itertools.pairwise(path):
            assert own is not None
            assert own.transitions.allows(*problem.local_row[[a, b]].tolist())


@pytest.mark.parametrize("kind", ["equal", "random", "mostly nothing", "hardly anything"])
@pytest.mark.parametrize("slew_rate_deg_s", [1.0, 0.1])
def test_stored_arcs_say_the_same_of_crowds(kind: str, slew_rate_deg_s: float) -> None:
    """With far more labels than are compared; arc paths here have no memory."""
    for seed in range(4):
        problem = random_problem(
            seed, use_resources=False, num_collects=900, num_satellites=2, span_s=3000.0,
            agility=Agility(slew_rate_deg_s=slew_rate_deg_s),
        )  # fmt: skip
        worth = weights(seed, kind, len(problem.opportunities))
        arcs = arc_network_of(problem)
        memory = memory_of(problem, arcs)
        memory = memory._replace(bit=np.full_like(memory.bit, -1))
        counts = np.zeros(len(problem.target_ids) + 1, dtype=np.int32)
        labels = labels_for(arcs, memory)
        expected = elementary_paths(arcs, memory, worth[arcs.row], labels, counts)
        assert longest(problem, worth)[0] == pytest.approx(expected, rel=1e-12)


@examples(60)
@given(seed=st.integers(0, 10**6), agility=AGILITIES, span_s=st.sampled_from([900.0, 9000.0]))
def test_the_table_of_pairs_says_what_geometry_says(
    seed: int, agility: Agility, span_s: float
) -> None:
    problem = random_problem(
        seed, num_collects=40, num_contacts=6, span_s=span_s, max_turn_deg=25.0, agility=agility
    )
    (satellite,) = problem.satellites
    table, m = direct_precedence(satellite), len(satellite)
    allows = satellite.transitions.allows
    for a in range(m):
        assert not any(allows(a, b) for b in range(table.near_from[a]))
        assert all(allows(a, b) for b in range(table.far_from[a], m))
        for b in range(table.near_from[a], table.far_from[a]):
            bit = int(table.offset[a]) + b - int(table.near_from[a])
            assert allows(a, b) == bool(table.bits[bit >> 3] >> (bit & 7) & 1)
    ends = [0, *part_ends(satellite.transitions).tolist()]
    assert ends[-1] == m
    assert all(allows(a, b) for end in ends[1:] for a in range(end) for b in range(end, m))


def test_problems_without_tasks_have_no_paths() -> None:
    problem = random_problem(0, num_collects=0, num_contacts=0, num_satellites=2)
    assert is_transitive(problem)
    assert longest(problem, np.empty(0)) == (0.0, [])
