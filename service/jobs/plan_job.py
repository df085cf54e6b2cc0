"""What a job does: a scenario and a solver's settings in, a judged timeline out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planner_core.errors import UnknownSolver
from planner_core.slew import slew_s
from planner_core.solvers.base import Budget


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """The frozen question of one job, as it travels to the solver's process.

    Attributes
    ----------
    content
        The canonical scenario file (JSON text).
    params
        The solver's parameters, defaults filled in.
    limits
        ``time_s`` and ``memory_mb``.
    opportunity_block
        The scenario's stored opportunities, or None where they are still to be computed.
    """

    job_id: str
    scenario_sha256: str
    content: str
    solver: str
    params: Mapping[str, Any]
    seed: int
    limits: Mapping[str, Any]
    opportunity_block: bytes | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAnswer:
    """What a job leaves behind.

    Attributes
    ----------
    timeline
        The timeline document (JSON text).
    targets
        Every target with its outcome (JSON text of a list).
    termination
        Why the search ended.
    reward, bound
        What the referee awarded; what no plan can exceed, where it is known.
    opportunity_block
        Opportunities to store, where this job was the first to compute them.
    """

    timeline: str
    targets: str
    termination: str
    reward: float
    bound: float | None = None
    opportunity_block: bytes | None = None


def run_plan_job(request: PlanRequest, budget: Budget) -> PlanAnswer:  # noqa: ARG001
    """Return the judged answer to one request.

    Raises
    ------
    PlannerError
        Where the scenario or the solver's parameters are wrong.
    Cancelled
        Where the budget ended before there was any plan.
    """
    raise UnknownSolver("unknown_solver", f"There is no solver {request.solver!r}.")


def warm_up() -> None:
    """Load the solvers and compile their kernels."""
    slew_s(30.0, 1.0, 0.5)
