"""The solvers there are, and their parameters."""

from __future__ import annotations

from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from planner_core.solvers.base import Constraint, Solver
from planner_core.solvers.registry import SOLVERS
from service.api.errors import problem_responses
from service.api.paging import Listed
from service.api.problems import ServiceError
from service.solver_params import params_schema

router = APIRouter(prefix="/v1/solvers", tags=["solvers"])


class SolverOut(BaseModel):
    """A solver."""

    name: str
    title: str
    paper: str = Field(description="Where the paper describes it.")
    kind: Literal["exact", "heuristic"] = Field(
        description="An exact solver proves its plan optimal when it runs to the end."
    )
    honours: list[Constraint] = Field(description="Rules that its plans never break.")
    params_schema: dict[str, Any] = Field(description="JSON Schema of `params` of a job.")


@router.get("")
def list_solvers() -> Listed[SolverOut]:
    """List all solvers."""
    return Listed(items=[_shown(solver) for solver in SOLVERS.values()], next=None)


@router.get("/{name}", responses=problem_responses(404))
def get_solver(name: str) -> SolverOut:
    """Return one solver."""
    solver = SOLVERS.get(name)
    if solver is None:
        raise ServiceError("not_found", f"There is no solver {name!r}.")
    return _shown(solver)


def _shown(solver: type[Solver]) -> SolverOut:
    return SolverOut(
        name=solver.name,
        title=solver.title,
        paper=solver.paper,
        kind="exact" if solver.exact else "heuristic",
        honours=sorted(solver.honours),
        params_schema=params_schema(solver),
    )
