"""Random missions can be drawn again, and their faults are named."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from benchmarks.missions import problem_of
from benchmarks.sweep.__main__ import Answer, answers_of, fault_of, follows_from_proof
from benchmarks.sweep.missions import random_mission
from planner_core.certified.proofs.bound import Bound, accessible

RIGHT = Answer(
    way="certified", reward=100.0, bound=101.0, is_proven=True, is_valid=True, used_s=9.0
)
OTHER = replace(RIGHT, way="rule", reward=99.0, bound=None, used_s=0.1)
_SMALL = 17
"""A mission of 60 targets."""


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_number_is_always_the_same_mission(number: int) -> None:
    assert random_mission(number) == random_mission(number)


def test_numbers_are_different_missions() -> None:
    assert random_mission(1) != random_mission(2)


def test_a_small_mission_is_planned_in_every_way_without_a_fault() -> None:
    answers = answers_of(random_mission(_SMALL), math.inf)
    assert {"certified", "rule", "graph", "milp"} <= {answer.way for answer in answers}
    assert [fault_of(answer, answers, math.inf) for answer in answers] == [""] * len(answers)


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        (RIGHT, ""),
        (replace(RIGHT, is_valid=False), "invalid"),
        (replace(RIGHT, reward=95.0), "worse than 99.000"),
        (replace(RIGHT, reward=98.8), ""),
        (replace(RIGHT, bound=98.0), "bound below 100.000"),
        (replace(RIGHT, is_proven=False), "not proven"),
        (replace(RIGHT, used_s=16.0), "too long"),
        (OTHER, ""),
    ],
)
def test_what_is_wrong_with_an_answer_is_named(answer: Answer, fault: str) -> None:
    assert fault_of(answer, [answer, OTHER], 10.0) == fault


def test_only_a_report_of_highs_is_believed() -> None:
    problem = problem_of(random_mission(_SMALL))
    assert follows_from_proof(problem, accessible(problem))
    assert not follows_from_proof(problem, replace(accessible(problem), value=0.1))
    assert follows_from_proof(problem, Bound(value=0.1, proof="milp", log="HiGHS"))
    assert not follows_from_proof(problem, Bound(value=0.1, proof="lagrangian"))


def test_a_plan_that_is_not_valid_makes_no_other_worse() -> None:
    broken = replace(OTHER, way="as delivered", reward=200.0, is_valid=False)
    assert fault_of(RIGHT, [RIGHT, broken], 10.0) == ""
