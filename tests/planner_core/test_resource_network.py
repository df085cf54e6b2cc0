"""A satellite's network is built once, and still fits the problem at hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.certified.dp.resource_network import Network, network_of, strict_network_of
from planner_core.domain import Dynamics, Objective
from planner_core.problem import Kept, Pinned, Problem
from planner_core.problem.delivery import with_objective
from tests.examples import examples
from tests.planner_core.problems import TIGHT, varied_problem


def variants(problem: Problem) -> list[Problem]:
    """Return different problems of the same satellites."""
    other: Dynamics = "paper" if problem.dynamics == "physical" else "physical"
    kept = tuple(Kept(row=row, pointer=f"/pins/keep/{row}") for row in (1, 3))
    delivered = with_objective(problem, Objective.delivered())
    shared = with_objective(problem, Objective(collected_share=0.5))
    return [
        problem,
        delivered,
        shared,
        replace(shared, leaves_none_on_board=True),
        replace(delivered, pinned=Pinned(kept=kept)),
        replace(problem, worth=np.zeros(len(problem.opportunities))),
        replace(problem, use_resources=False),
        replace(problem, dynamics=other),
    ]


@examples(40)
@given(seed=st.integers(0, 10**6), num_satellites=st.integers(1, 2))
def test_a_network_that_is_known_is_the_one_that_would_be_made(
    seed: int, num_satellites: int
) -> None:
    problem = varied_problem(seed, "physical", num_satellites, scarce=TIGHT)
    for variant in variants(problem):
        for satellite in variant.satellites:
            for make in (network_of, strict_network_of):
                known, anew = make(variant, satellite), make(variant, replace(satellite))
                for name, one, other in zip(Network._fields, known, anew, strict=True):
                    np.testing.assert_array_equal(one, other, err_msg=name)
