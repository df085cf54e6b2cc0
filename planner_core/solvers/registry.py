"""The solvers, one module each. A new solver joins the tuple below."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, cast

from planner_core.certified.solver import Certified
from planner_core.errors import UnknownSolver
from planner_core.solvers.base import Outlook, Solver
from planner_core.solvers.forward_search import ForwardSearch
from planner_core.solvers.graph import Graph
from planner_core.solvers.mcts import Mcts
from planner_core.solvers.milp import Milp
from planner_core.solvers.rule import Rule

__all__ = [
    "SOLVERS",
    "Certified",
    "ForwardSearch",
    "Graph",
    "Mcts",
    "Milp",
    "Rule",
    "outlook_of",
    "solver_class",
]

SOLVERS: dict[str, type[Solver]] = {
    solver.name: solver for solver in (Rule, Graph, ForwardSearch, Mcts, Milp, Certified)
}
"""Every solver by its name in the API."""


def solver_class(name: str) -> type[Solver]:
    """Return the solver of that name.

    Raises
    ------
    UnknownSolver
        If there is none.
    """
    if name not in SOLVERS:
        known = ", ".join(sorted(SOLVERS))
        raise UnknownSolver(
            "unknown_solver",
            f"There is no solver {name!r}; available: {known}.",
            pointer="/solver",
        )
    return SOLVERS[name]


def outlook_of(name: str, params: Mapping[str, Any]) -> Outlook:
    """Return which actions a search considered, by parameters perhaps stored by an older release.

    Parameters that the solver no longer has are ignored; a solver that is gone has no limits.
    """
    if name not in SOLVERS:
        return Outlook()
    known = {field.name for field in dataclasses.fields(cast(Any, SOLVERS[name]))}
    solver = SOLVERS[name](**{key: value for key, value in params.items() if key in known})
    return solver.outlook
