"""A solver's dataclass is the one source of its valid parameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Termination
from planner_core.errors import InvalidParameters
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Constraint, Outlook, Solution
from planner_core.solvers.registry import Mcts, Rule, outlook_of
from service.jobs.solver_params import params_of, params_schema, parse_params


@dataclass(frozen=True, slots=True, kw_only=True)
class Example:
    """A solver that plans nothing, with a parameter of each kind."""

    name: ClassVar[str] = "example"
    title: ClassVar[str] = "Example"
    about: ClassVar[str] = ""
    paper: ClassVar[str] = ""
    exact: ClassVar[bool] = False
    bounds: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset()

    depth: int = field(default=3, metadata={"minimum": 1, "maximum": 20, "description": "Steps."})
    gamma: float = field(default=0.999, metadata={"exclusiveMinimum": 0, "maximum": 1})
    greedy: bool = False
    mode: Literal["hard", "penalty"] = "hard"
    breadth: int | None = None

    @property
    def outlook(self) -> Outlook:
        return Outlook(breadth=self.breadth)

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        return Solution(plan=Plan(), termination=Termination.OPTIMAL)


def test_the_schema_names_types_limits_and_defaults() -> None:
    assert params_schema(Example) == {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "depth": {
                "type": "integer", "description": "Steps.", "minimum": 1, "maximum": 20,
                "default": 3,
            },
            "gamma": {"type": "number", "exclusiveMinimum": 0, "maximum": 1, "default": 0.999},
            "greedy": {"type": "boolean", "default": False},
            "mode": {"enum": ["hard", "penalty"], "default": "hard"},
            "breadth": {"type": ["integer", "null"], "default": None},
        },
    }  # fmt: skip


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "depth": st.integers(1, 20),
            "gamma": st.floats(0, 1, exclude_min=True),
            "greedy": st.booleans(),
            "mode": st.sampled_from(["hard", "penalty"]),
            "breadth": st.none() | st.integers(),
        },
    )
)
def test_values_of_the_schema_come_back_with_the_defaults_filled_in(params: dict[str, Any]) -> None:
    defaults = {"depth": 3, "gamma": 0.999, "greedy": False, "mode": "hard", "breadth": None}
    assert params_of(parse_params(Example, params)) == defaults | params


def test_a_whole_number_is_a_number() -> None:
    solver = parse_params(Example, {"gamma": 1})
    assert isinstance(params_of(solver)["gamma"], float)


@pytest.mark.parametrize(
    ("params", "code"),
    [
        ({"dept": 3}, "unknown_parameter_of_solver"),
        ({"name": "x"}, "unknown_parameter_of_solver"),
        ({"depth": "3"}, "invalid_value"),
        ({"depth": 3.5}, "invalid_value"),
        ({"depth": True}, "invalid_value"),
        ({"depth": None}, "invalid_value"),
        ({"depth": 0}, "value_out_of_range"),
        ({"depth": 21}, "value_out_of_range"),
        ({"gamma": 0.0}, "value_out_of_range"),
        ({"gamma": float("nan")}, "not_finite"),
        ({"greedy": 1}, "invalid_value"),
        ({"mode": "soft"}, "unknown_value"),
    ],
)
def test_a_wrong_parameter_is_refused_by_name(params: dict[str, Any], code: str) -> None:
    with pytest.raises(InvalidParameters) as caught:
        parse_params(Example, params)
    assert caught.value.code == code
    assert caught.value.fault.pointer == "/params/" + next(iter(params))


def test_a_refusal_of_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(InvalidParameters, match="depth, gamma, greedy, mode, breadth"):
        parse_params(Example, {"dept": 3})


def test_what_a_search_looked_at_is_known_from_what_was_stored() -> None:
    stored = {**params_of(Mcts(breadth=2, contact_above_fraction=0.25)), "gone_since": 1}
    assert outlook_of("mcts", stored) == Outlook(breadth=2, contact_above=0.25)
    assert outlook_of("rule", {}) == Rule().outlook
    assert outlook_of("a solver of old", {"breadth": 2}) == Outlook()
