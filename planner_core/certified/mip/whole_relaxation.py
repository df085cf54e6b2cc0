"""The linear relaxation of the whole program: its bound, and what tasks cost."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine, Watch
from planner_core.certified.program.clique_cuts import violated_cliques
from planner_core.certified.program.linear_program import Rows
from planner_core.certified.program.model import PlanProgram
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.whole_program import (
    RowMultipliers,
    program_to_relax,
    slots_to_relax,
    whole_program_value,
)
from planner_core.certified.tuning import TUNING
from planner_core.problem import Floats, Ints, Longs, Problem


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
    """Return the linear relaxation of the whole program, with clique cuts."""
    model = program_to_relax(problem)
    engine = Engine(model.program, budget, seed, is_chained=problem.use_resources)
    cliques = cut_by_cliques(engine, model, TUNING.patience, _unwatched)
    n = len(problem.opportunities)
    return WholeRelaxation(
        bound=_bound(model, engine.row_multipliers, cliques),
        order=np.lexsort((-engine.columns[:n], np.abs(engine.gains[:n]))),
    )


def _bound(model: PlanProgram, multipliers: Floats, cliques: list[Ints]) -> Bound:
    """Return the bound that the row duals prove."""
    of_rows, of_cliques = np.split(multipliers, [model.program.num_rows])
    is_used = np.flatnonzero(of_cliques > 0.0)
    proof = replace(
        RowMultipliers.of(of_rows),
        cliques=tuple(cliques[i] for i in is_used),
        of_cliques=tuple(of_cliques[is_used].tolist()),
    )
    value = whole_program_value(model, proof)
    return Bound(value=value, proof="linear", row_multipliers=proof)


def relaxation_over_slots(problem: Problem, budget: Budget, seed: int) -> Bound:
    """Return the bound by the linear relaxation over slots of time."""
    program = slots_to_relax(problem)
    engine = Engine(program, budget, seed, is_chained=True)
    engine.relaxed()
    proof = RowMultipliers.of(engine.row_multipliers, is_of_slots=True)
    value = program.dual_value(engine.row_multipliers)
    return Bound(value=value, proof="linear", row_multipliers=proof)


def cut_by_cliques(engine: Engine, model: PlanProgram, rounds: int, watch: Watch) -> list[Ints]:
    """Add violated clique cuts while they lower the bound noticeably; return the cliques."""
    bounds: list[float] = []
    cliques: list[Ints] = []
    for _ in range(rounds):
        taken = engine.relaxed()
        if taken is None:
            break
        watch(-np.inf, engine.bound)
        bounds.append(engine.bound)
        trifle = TUNING.little**2 * bounds[-1]
        if len(bounds) > TUNING.several and bounds[-1 - TUNING.several] - bounds[-1] < trifle:
            break
        known = len(cliques)
        for satellite, precedence in zip(model.problem.satellites, model.precedences, strict=True):
            own = model.taken[satellite.rows]
            offsets, members = violated_cliques(precedence, taken[own])
            engine.add_rows(Rows.of(offsets, own[members], upper=1.0))
            cliques += np.split(satellite.rows[members], offsets[1:-1])[: len(offsets) - 1]
        if len(cliques) == known:
            break
    return cliques


def _unwatched(_reward: float, _bound: float) -> None:
    pass
