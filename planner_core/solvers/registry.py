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
        Where there is none.
    """
    if name not in SOLVERS:
        known = ", ".join(sorted(SOLVERS))
        raise UnknownSolver(
            "unknown_solver",
            f"No solver is called {name!r}; there are: {known}.",
            pointer="/solver",
        )
    return SOLVERS[name]


def outlook_of(name: str, params: Mapping[str, Any]) -> Outlook:
    """Return which actions a search looked at, as an older release may have noted it.

    What the solver has no parameter for any more does not count, nor does a solver that is gone.
    """
    if name not in SOLVERS:
        return Outlook()
    known = {field.name for field in dataclasses.fields(cast(Any, SOLVERS[name]))}
    solver = SOLVERS[name](**{key: value for key, value in params.items() if key in known})
    return solver.outlook
