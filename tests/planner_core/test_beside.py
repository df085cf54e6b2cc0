"""What cannot run beside kept actions, compared with its definition pair by pair."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.pinning.beside import excluded_by_kept
from planner_core.precedence.relation import transitive_closure
from planner_core.problem import COLLECT, Kept, Problem
from tests.examples import examples
from tests.planner_core.problems import random_problem


def excludes(problem: Problem, row: int, other: int, kept: list[int]) -> bool:
    """Return whether ``other`` cannot run beside ``row`` if all of ``kept`` runs."""
    table = problem.opportunities
    if table.kind[row] == table.kind[other] == COLLECT and table.site[row] == table.site[other]:
        return True
    if table.satellite[row] == table.satellite[other]:
        satellite = problem.satellites[int(table.satellite[row])]
        first, second = sorted((int(problem.local_row[row]), int(problem.local_row[other])))
        closure = transitive_closure(satellite)
        bit = closure.offset[first] + second - closure.near_from[first]
        fits = second >= closure.far_from[first] or (
            second >= closure.near_from[first] and bool(closure.bits[bit >> 3] >> (bit & 7) & 1)
        )
        if not fits:
            return True
    if table.kind[row] == COLLECT or table.kind[other] == COLLECT:
        return False
    if table.site[row] != table.site[other]:
        return False
    from_s = max(table.start_s[row], table.start_s[other])
    to_s = min(table.end_s[row], table.end_s[other])
    busy = [
        one
        for one in kept
        if table.kind[one] != COLLECT
        and table.site[one] == table.site[row]
        and table.start_s[one] <= from_s < table.end_s[one] - 1e-6
    ]
    antennas = int(problem.station_antennas[table.site[row]])
    return bool(to_s > from_s + 1e-6) and len(busy) >= antennas


@examples(200)
@given(seed=st.integers(0, 10**6), antennas=st.integers(1, 2))
def test_pairs_are_those_of_the_definition(seed: int, antennas: int) -> None:
    problem = random_problem(
        seed, num_satellites=3, num_targets=6, num_collects=12, num_contacts=8, num_stations=2,
    )  # fmt: skip
    problem = replace(problem, station_antennas=np.full(2, antennas, dtype=np.int32))
    rng = np.random.default_rng(seed)
    n = len(problem.opportunities)
    rows = rng.permutation(n)[: rng.integers(0, 6)].tolist()
    beside = excluded_by_kept(problem, [Kept(row=row, pointer=f"/pins/keep/{row}") for row in rows])
    for position, row in enumerate(rows):
        expected = [
            other for other in range(n) if other not in rows and excludes(problem, row, other, rows)
        ]
        assert beside.of(position).tolist() == expected
