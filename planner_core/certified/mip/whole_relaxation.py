"""The linear relaxation of the whole program: its bound, and what tasks cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.dp.resource_network import left_cost
from planner_core.certified.mip.clique_cuts import violated_cliques
from planner_core.certified.mip.highs import Engine, Watch
from planner_core.certified.mip.model import OnBoard, PlanProgram, plan_program
from planner_core.certified.mip.program import Rows
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.tolerances import TOUCHING
from planner_core.certified.tuning import TUNING
from planner_core.precedence.relation import is_transitive
from planner_core.problem import COLLECT, Longs, Problem


class WholeRelaxation(NamedTuple):
    """The linear relaxation of the whole program.

    Attributes
    ----------
    bound
        What it proves.
    order
        Opportunities from the one that costs least on, those first that are taken in part.
        Shape ``(n,)``.
    """

    bound: Bound
    order: Longs


def whole_relaxation(problem: Problem, budget: Budget, seed: int) -> WholeRelaxation:
    """Return the linear relaxation of the whole program, with clique cuts.

    If images on board lose a part of their worth, all data left there has one cost. Columns for
    images that come down would take three times as long and lower less: fractions of images do.
    """
    on_board: OnBoard = "at a cost" if charges_for_data_left(problem) else "worth the same"
    model = plan_program(problem, "antichain", TOUCHING, on_board=on_board)
    engine = Engine(model.program, budget, seed, is_chained=problem.use_resources)
    cut_by_cliques(engine, model, TUNING.patience, _unwatched)
    n = len(problem.opportunities)
    return WholeRelaxation(
        bound=Bound(value=engine.bound, proof="milp", log=engine.log),
        order=np.lexsort((-engine.columns[:n], np.abs(engine.gains[:n]))),
    )


def charges_for_data_left(problem: Problem) -> bool:
    """Whether a cost of data that stays on board bounds what its images lose.

    Images that earn nothing must cost nothing, so no plan may need any: as a detour, or because it
    is kept.
    """
    kept = problem.kept_rows
    is_idle = (problem.opportunities.kind[kept] == COLLECT) & (problem.worth[kept] <= 0.0)
    return (
        is_transitive(problem)
        and not is_idle.any()
        and any(left_cost(problem, one) > 0.0 for one in problem.satellites if len(one))
    )


def cut_by_cliques(engine: Engine, model: PlanProgram, rounds: int, watch: Watch) -> None:
    """Add violated clique cuts while they lower the bound noticeably."""
    bounds: list[float] = []
    for _ in range(rounds):
        taken = engine.relaxed()
        if taken is None:
            return
        watch(-np.inf, engine.bound)
        bounds.append(engine.bound)
        trifle = TUNING.little**2 * bounds[-1]
        if len(bounds) > TUNING.several and bounds[-1 - TUNING.several] - bounds[-1] < trifle:
            return
        num_added = 0
        for satellite, precedence in zip(model.problem.satellites, model.precedences, strict=True):
            own = model.taken[satellite.rows]
            offsets, members = violated_cliques(precedence, taken[own])
            engine.add_rows(Rows.of(offsets, own[members], upper=1.0))
            num_added += len(offsets) - 1
        if num_added == 0:
            return


def _unwatched(_reward: float, _bound: float) -> None:
    pass
