"""What a job does: a scenario and a solver's settings in, a judged timeline out."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from planner_core import __version__
from planner_core.budget import Budget
from planner_core.build import ScenarioOpportunities
from planner_core.certified.proofs import documents as proofs
from planner_core.run import plan_scenario
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import solver_class
from service.answers.blocks import (
    Block,
    target_blocks,
    targets_text,
    timeline_blocks,
    timeline_text,
)
from service.answers.rendering import Documents, figures_of
from service.scenarios.translate import scenario_from_content
from service.wire.base import Json, dumped
from service.wire.timelines import SolverUsed


class Parcel:
    """Bytes that are handed on once: who takes them is alone in holding them."""

    def __init__(self, content: bytes | None):
        self._content = content

    def take(self) -> bytes | None:
        """Return the bytes the first time; None where there are none, or no longer."""
        content, self._content = self._content, None
        return content


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """The frozen question of one job, as it travels to the solver's process.

    Attributes
    ----------
    run
        Which run of the job this is, from 1.
    content
        The canonical scenario file (JSON text).
    params
        The solver's parameters, defaults filled in.
    limits
        ``time_s`` and ``memory_mb``.
    opportunity_block
        The scenario's stored opportunities; none where they are still to be computed.
    bound
        The best bound known of the scenario with its proof (JSON text), or None.
    """

    job_id: str
    scenario_sha256: str
    content: str
    solver: str
    params: Mapping[str, Any]
    seed: int
    limits: Mapping[str, Any]
    run: int = 1
    opportunity_block: Parcel = field(default_factory=lambda: Parcel(None))
    bound: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAnswer:
    """What a job leaves behind.

    Attributes
    ----------
    blocks
        The timeline document, and every target with its outcome.
    termination
        Why the search ended.
    reward, bound
        What the referee awarded; what no plan can exceed, where it is known.
    proof
        That bound with what proves it (JSON text).
    opportunity_block
        Opportunities to store, where this job was the first to compute them.
    figures
        The timeline's numbers for tables.
    warnings
        What the timeline says to people.
    """

    blocks: tuple[Block, ...]
    termination: str
    reward: float
    bound: float | None = None
    proof: str | None = None
    opportunity_block: bytes | None = None
    figures: Mapping[str, Any] | None = None
    warnings: tuple[str, ...] = ()

    @property
    def timeline(self) -> str:
        """Return the timeline document (JSON text)."""
        return timeline_text(self.blocks)

    @property
    def targets(self) -> str:
        """Return every target with its outcome (JSON text of a list)."""
        return targets_text(self.blocks)


def run_plan_job(request: PlanRequest, budget: Budget) -> PlanAnswer:
    """Return the judged answer to one request.

    Raises
    ------
    PlannerError
        Where the scenario or the solver's parameters are wrong.
    Cancelled
        Where the budget ended before there was any plan.
    """
    make_solver = cast(Callable[..., Solver], solver_class(request.solver))
    block = request.opportunity_block.take()
    known = None if block is None else ScenarioOpportunities.from_bytes(block)
    del block  # the solver needs the memory
    judged = plan_scenario(
        scenario_from_content(json.loads(request.content)),
        make_solver(**request.params),
        request.seed,
        budget,
        known,
        proofs.from_json(request.bound) if request.bound is not None else None,
    )
    documents = Documents(judged)
    solver = SolverUsed(
        name=request.solver, version=__version__, params=request.params, seed=request.seed
    )
    sha256 = request.scenario_sha256
    head = documents.head(job_id=request.job_id, scenario_sha256=sha256, solver=solver)
    return PlanAnswer(
        blocks=(
            *timeline_blocks(dumped(head), _satellites(documents)),
            *target_blocks(map(dumped, documents.targets())),
        ),
        termination=head.termination,
        reward=judged.timeline.reward,
        bound=judged.bound.value if judged.bound else None,
        proof=proofs.to_json(judged.bound) if judged.bound else None,
        opportunity_block=judged.opportunities.to_bytes() if known is None else None,
        figures=figures_of(dumped(head)),
        warnings=tuple(head.warnings),
    )


def _satellites(documents: Documents) -> Iterator[tuple[Json, Iterator[Json], Json]]:
    """Yield what stands before the actions of each satellite, those, and what stands behind."""
    for about, actions in documents.satellites():
        before, behind = {"id", "name"}, {"on_board", "totals", "eclipses", "resources"}
        yield dumped(about, include=before), map(dumped, actions), dumped(about, include=behind)
