"""The available solvers and their parameters."""

from __future__ import annotations

from fastapi import APIRouter

from planner_core.solvers.base import Solver
from planner_core.solvers.registry import SOLVERS
from service.api.deps import found
from service.api.errors import problem_responses
from service.jobs.solver_params import params_schema
from service.wire.base import Listed
from service.wire.operations import SolverOut

router = APIRouter(prefix="/v1/solvers", tags=["solvers"])


@router.get("")
def list_solvers() -> Listed[SolverOut]:
    """List all solvers."""
    return Listed(items=[_shown(solver) for solver in SOLVERS.values()], next=None)


@router.get("/{name}", responses=problem_responses(404))
def get_solver(name: str) -> SolverOut:
    """Return one solver."""
    return _shown(found(SOLVERS.get(name), "solver", name))


def _shown(solver: type[Solver]) -> SolverOut:
    return SolverOut(
        name=solver.name,
        title=solver.title,
        description=solver.about,
        paper=solver.paper,
        kind="exact" if solver.exact else "heuristic",
        honours=[rule.value for rule in sorted(solver.honours)],
        params_schema=params_schema(solver),
    )
