"""What a job does: a scenario and a solver's settings in, a judged timeline out."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

from planner_core import __version__
from planner_core.access.scenario_opportunities import ScenarioOpportunities
from planner_core.budget import Budget
from planner_core.certified.proofs import documents as proofs
from planner_core.replanning.plan_before import PlanBefore
from planner_core.run import plan_scenario
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import solver_class
from service.answers.chunks import target_chunks, timeline_chunks
from service.answers.rendering import Documents, figures_of
from service.jobs.held import HeldBlocks
from service.jobs.plan_request import PlanAnswer, PlanRequest
from service.scenarios.translate import scenario_from_content
from service.wire.base import Json, dumped
from service.wire.timelines import SolverUsed


def run_plan_job(request: PlanRequest, budget: Budget) -> PlanAnswer:
    """Return the judged answer to one request.

    Raises
    ------
    PlannerError
        If the scenario or the solver's parameters are wrong.
    Cancelled
        If the budget ends before there is any plan.
    """
    make_solver = cast(Callable[..., Solver], solver_class(request.solver))
    block = request.opportunity_block.take()
    known = None if block is None else ScenarioOpportunities.from_bytes(block)
    del block  # the solver needs the memory
    held = None if request.held_in is None else HeldBlocks(Path(request.held_in))
    judged = plan_scenario(
        scenario_from_content(json.loads(request.content)),
        make_solver(**request.params),
        request.seed,
        budget,
        known,
        proofs.from_json(request.bound) if request.bound is not None else None,
        _before(request, held),
    )
    if held is not None and not held.holds(request.scenario_sha256):
        held.save(request.scenario_sha256, judged.opportunities.to_bytes(compress=False))
    documents = Documents(judged)
    solver = SolverUsed(
        name=request.solver, version=__version__, params=request.params, seed=request.seed
    )
    sha256 = request.scenario_sha256
    head = documents.head(job_id=request.job_id, scenario_sha256=sha256, solver=solver)
    return PlanAnswer(
        chunks=(
            *timeline_chunks(dumped(head), _satellites(documents)),
            *target_chunks(map(dumped, documents.targets())),
        ),
        termination=head.termination,
        reward=judged.timeline.reward,
        bound=judged.bound.value if judged.bound else None,
        proof=proofs.to_json(judged.bound) if judged.bound else None,
        opportunity_block=judged.opportunities.to_bytes() if known is None else None,
        figures=figures_of(dumped(head)),
        warnings=tuple(head.warnings),
    )


def _before(request: PlanRequest, held: HeldBlocks | None) -> PlanBefore | None:
    """Return what is known of a replan's parent plan, with opportunities held here or stored."""
    parent = request.parent
    if parent is None:
        return None
    stored = parent.opportunity_block.take()
    block = held.load(parent.scenario_sha256) if held is not None else None
    block = block or stored
    if block is None:
        return None
    return PlanBefore(
        scenario=scenario_from_content(json.loads(parent.content)),
        opportunities=ScenarioOpportunities.from_bytes(block),
        bound=None if parent.bound is None else proofs.from_json(parent.bound),
        imaged=parent.imaged,
    )


def _satellites(documents: Documents) -> Iterator[tuple[Json, Iterator[Json], Json]]:
    """Yield for each satellite the fields before its actions, the actions, and the fields after."""
    for about, actions in documents.satellites():
        before, behind = {"id", "name"}, {"on_board", "totals", "eclipses", "resources"}
        yield dumped(about, include=before), map(dumped, actions), dumped(about, include=behind)
