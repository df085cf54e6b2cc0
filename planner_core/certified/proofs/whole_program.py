"""Bounds by multipliers of all rows of the whole program.

The linear relaxation of the whole program knows energy, data and antennas at once. Its row duals
are multipliers: put into the program's dual function they prove a bound, whoever found them. With
continuous starts a program over slots of time takes its place, and with many starts of images that
differ in worth it comes first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.certified.dp.resource_network import left_cost
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.program.model import OnBoard, PlanProgram, plan_program
from planner_core.certified.program.slots import has_slot_program, slot_program
from planner_core.certified.tolerances import TOUCHING
from planner_core.precedence.relation import fit_beside, is_transitive
from planner_core.problem import COLLECT, Floats, Ints, Problem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowMultipliers:
    """Multipliers of the rows of the whole program, and of clique cuts besides.

    Attributes
    ----------
    rows, of_rows
        Rows of the program, and the multiplier of each (``Program.dual_value``); 0 for all others.
        Shape ``(num_multipliers,)``.
    cliques, of_cliques
        Opportunities of one satellite that exclude each other pairwise, so that a plan takes at
        most one; and the multiplier of each such set, not negative.
    is_of_slots
        Whether the rows are those of the program over slots of time.
    """

    rows: Ints
    of_rows: Floats
    cliques: tuple[Ints, ...] = ()
    of_cliques: tuple[float, ...] = ()
    is_of_slots: bool = False

    @classmethod
    def of(cls, multipliers: Floats, *, is_of_slots: bool = False) -> RowMultipliers:
        """Return those of a program without cuts. Shape ``(num_rows,)``."""
        rows = np.flatnonzero(multipliers)
        return cls(rows=rows.astype(np.int32), of_rows=multipliers[rows], is_of_slots=is_of_slots)

    def of_all_rows(self, num_rows: int) -> Floats:
        """Return the multipliers of all rows of the program. Shape ``(num_rows,)``."""
        every = np.zeros(num_rows)
        every[self.rows] = self.of_rows
        return every


def program_to_relax(problem: Problem) -> PlanProgram:
    """Return the whole program whose linear relaxation bounds all plans.

    If images on board lose a part of their worth, all data left there has one cost. Columns for
    images that come down would take three times as long and lower less: fractions of images do.
    They are needed if what images lose depends on when they come down.
    """
    on_board: OnBoard = "at a cost" if charges_for_data_left(problem) else "worth the same"
    if problem.counts_delivery and problem.objective.half_life_s is not None:
        on_board = "worth less"
    return plan_program(problem, "antichain", TOUCHING, on_board=on_board)


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


def relaxed_value(problem: Problem, multipliers: RowMultipliers) -> float:
    """Return the bound that multipliers prove; infinite if they prove nothing."""
    if not multipliers.is_of_slots:
        if problem.continuous_starts:
            return float("inf")
        return whole_program_value(program_to_relax(problem), multipliers)
    if multipliers.cliques or not has_slot_program(problem):
        return float("inf")
    program = slots_to_relax(problem)
    return program.dual_value(multipliers.of_all_rows(program.num_rows))


def slots_to_relax(problem: Problem) -> Program:
    """Return the program over slots whose linear relaxation bounds all plans."""
    return slot_program(problem, costs_left=charges_for_data_left(problem))


def whole_program_value(model: PlanProgram, multipliers: RowMultipliers) -> float:
    """Return the bound that multipliers prove; infinite if a cut is not valid.

    Parameters
    ----------
    model
        Of ``program_to_relax``, unchanged.

    Raises
    ------
    IndexError
        If there is no such row or opportunity.
    """
    cliques, of_cliques = multipliers.cliques, multipliers.of_cliques
    if not _are_cliques(model.problem, cliques) or min(of_cliques, default=0.0) < 0.0:
        return float("inf")
    of_rows = multipliers.of_all_rows(model.program.num_rows)
    rows = list(model.program.rows)
    if cliques:
        offsets = np.cumsum([0, *map(len, cliques)])
        rows.append(Rows.of(offsets, model.taken[np.concatenate(cliques)], upper=1.0))
    return replace(model.program, rows=rows).dual_value(np.append(of_rows, of_cliques))


def _are_cliques(problem: Problem, sets: tuple[Ints, ...]) -> bool:
    """Return whether each is of opportunities of one satellite that exclude each other pairwise."""
    table, local = problem.opportunities, problem.local_row
    pairs = [[s[i] for i in np.triu_indices(len(s), 1)] for s in sets]
    if not pairs:
        return True
    first, second = np.concatenate(pairs, axis=1)
    of_first = table.satellite[first]
    if not np.array_equal(of_first, table.satellite[second]) or np.any(first == second):
        return False
    for number in np.unique(of_first):
        is_own = of_first == number
        one, other = (local[rows[is_own]].astype(np.int64) for rows in (first, second))
        if fit_beside(problem.satellites[number], one, other).any():
            return False
    return True
