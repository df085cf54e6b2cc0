"""The planning model as a mixed-integer program, over all satellites at once."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from planner_core.certified.dp.resource_network import must_deliver, worth_before_left
from planner_core.certified.program.clique_cuts import clique_cover, detours, excluding_pairs
from planner_core.certified.program.deliveries import Images, add_deliveries
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.program.resource_terms import ResourceTerms, resource_terms
from planner_core.certified.program.resources import add_resources
from planner_core.certified.tolerances import SAME
from planner_core.precedence.antennas import antenna_groups
from planner_core.precedence.relation import (
    Precedence,
    direct_precedence,
    is_transitive,
    transitive_closure,
)
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Floats,
    Ints,
    Longs,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.delivery import lost_on_board
from planner_core.problem.restrict import restricted

Formulation = Literal["antichain", "pairwise"]
OnBoard = Literal["worth less", "at a cost", "worth the same"]
"""How images that stay on board count: each image has a column for coming down, and more for when
if it ages; or all data left on board at the end has one cost per unit; or they lose nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanProgram:
    """A program whose first columns are x: one for each opportunity.

    Attributes
    ----------
    problem
        The opportunities that a plan may take.
    taken, down
        The columns x, and those after them for images that come down; -1 if that makes no
        difference to the image. Shape ``(n,)``.
    precedences
        For each satellite, which of its tasks can be in one plan.
    paid
        The groups of images whose columns carry the worth; None if x carries it.
    """

    problem: Problem
    program: Program
    taken: Ints
    down: Ints
    precedences: tuple[Precedence, ...]
    paid: Paid | None

    def target_multipliers(self, row_duals: Floats) -> Floats:
        """Return the targets' multipliers, from the row duals of a relaxation.

        Rows of targets come first in the program.
        """
        most = self.problem.best_worth
        if self.paid is None:
            return np.clip(row_duals[: len(most)], 0.0, most)
        multipliers = np.zeros(len(most))
        left = self.paid.worth - row_duals[: len(self.paid.worth)]
        np.maximum.at(multipliers, self.paid.target, left)
        return np.clip(multipliers, 0.0, most)


class Paid(NamedTuple):
    """Groups of images that are paid alike: those of one target that are worth the same.

    Attributes
    ----------
    target, worth, lost
        Target and worth of each group, and the part of it lost if the image stays on board. A
        target without images has one group, worth nothing. Shape ``(num_groups,)``.
    rows, offsets
        Images group by group, and where each group begins.
        Shapes ``(num_images,)`` and ``(num_groups + 1,)``.
    """

    target: Ints
    worth: Floats
    lost: Floats
    rows: Ints
    offsets: Longs

    @classmethod
    def of(cls, problem: Problem, lost: Floats) -> Paid:
        """Return the groups of a problem, in order of target."""
        rows, offsets = problem.target_opportunities
        empty = np.flatnonzero(np.diff(offsets) == 0)
        target = np.concatenate([problem.opportunities.site[rows], empty])
        own = np.column_stack([problem.worth[rows], lost[rows]])
        own = np.vstack([own, np.zeros((len(empty), 2))])
        groups, group = np.unique(np.column_stack([target, own]), axis=0, return_inverse=True)
        group = group.ravel()[: len(rows)]
        counts = np.bincount(group, minlength=len(groups))
        return cls(
            target=groups[:, 0].astype(np.int32),
            worth=groups[:, 1],
            lost=groups[:, 2],
            rows=rows[np.argsort(group, kind="stable")],
            offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        )


def plan_program(
    problem: Problem,
    formulation: Formulation,
    margin: float,
    rows: Ints | None = None,
    *,
    on_board: OnBoard = "worth less",
) -> PlanProgram:
    """Return the program of the plans over all or some of the tasks.

    Parameters
    ----------
    margin
        How far inside battery and recorder limits to stay.
    rows
        The opportunities that a plan may take, ascending; all by default.
    on_board
        How images that stay on board count.
    """
    terms = [
        resource_terms(problem, satellite, costs_left=on_board == "at a cost")
        if problem.use_resources and len(satellite)
        else None
        for satellite in problem.satellites
    ]
    lost = binding_losses(problem)
    if on_board != "worth less":
        lost[:] = 0.0
    if on_board == "at a cost":
        problem = replace(problem, worth=worth_before_left(problem))
    if rows is not None:
        # What a task costs depends on all tasks around it, taken or not, hence terms come first.
        is_kept = np.zeros(len(problem.opportunities), dtype=np.bool_)
        is_kept[rows] = True
        kept = [np.flatnonzero(is_kept[s.rows]).astype(np.int32) for s in problem.satellites]
        terms = [own and own.of_part(part) for own, part in zip(terms, kept, strict=True)]
        problem, lost = restricted(problem, rows), lost[rows]
    precedences = tuple(transitive_closure(satellite) for satellite in problem.satellites)
    program = Program()
    has_half_life = problem.counts_delivery and problem.objective.half_life_s is not None
    ages = has_half_life and on_board == "worth less"
    taken, down, paid = _variables(program, problem, lost, ages=ages)
    model = PlanProgram(
        problem=problem,
        program=program,
        taken=taken,
        down=down,
        precedences=precedences,
        paid=paid,
    )
    _constraints(model, terms, formulation, margin)
    return model


def _variables(
    program: Program, problem: Problem, lost: Floats, *, ages: bool
) -> tuple[Ints, Ints, Paid | None]:
    """Add the columns x (1 for kept tasks), those for images that come down, and all worths."""
    table, worth = problem.opportunities, problem.worth - lost
    kept = np.zeros(len(table), dtype=np.bool_)
    kept[problem.kept_rows] = True
    down, may_come = np.full(len(table), -1, dtype=np.int32), lost > 0.0
    if is_transitive(problem):
        useful = (problem.worth > 0.0) | ((table.kind == CONTACT) & problem.use_resources)
        useful |= kept
        if ages:  # what an image earns beyond its worth on board depends on its contact
            worth, lost = problem.worth - lost_on_board(problem), np.zeros(len(table))
        taken = program.add_columns(
            worth, lower=kept.astype(np.float64), upper=useful.astype(np.float64)
        )
        down[may_come] = program.add_columns(lost[may_come])
        _once_per_target(program, problem, taken)
        if ages:
            came = np.where(may_come, down, taken)
            for satellite in problem.satellites:
                rows = satellite.rows[satellite.kind == COLLECT]
                end_s = table.end_s[rows]
                images = Images(rows, came[rows], end_s, end_s, worth[rows])
                add_deliveries(program, problem, satellite, images, taken[satellite.rows])
        return taken, down, None
    taken = program.add_columns(np.zeros(len(table)), lower=kept.astype(np.float64))
    down[may_come] = program.add_columns(np.zeros(int(may_come.sum())))
    return taken, down, _paid_for_the_best(program, problem, taken, down, lost)


def binding_losses(problem: Problem) -> Floats:
    """Return how much less each image is worth if it stays on board. Shape ``(n,)``.

    0 for satellites whose plans hold only images that come down, and for images that cannot.
    """
    lost = lost_on_board(problem)
    lost[lost <= SAME * problem.worth] = 0.0
    for satellite in problem.satellites:
        if must_deliver(problem, satellite):
            lost[satellite.rows] = 0.0
    return lost


def _once_per_target(program: Program, problem: Problem, taken: Ints) -> None:
    """Allow one collect of each target over all satellites: more would earn nothing beyond it."""
    rows, offsets = problem.target_opportunities
    program.add_rows(Rows.of(offsets, taken[rows], upper=1.0))


def _paid_for_the_best(
    program: Program, problem: Problem, taken: Ints, down: Ints, lost: Floats
) -> Paid:
    """Pay for one image of each target, and for its coming down, however many are taken.

    A slow satellite may slew by way of a target that it has collected already.
    """
    paid = Paid.of(problem, lost)
    offsets = paid.offsets
    collected = program.add_columns(paid.worth - paid.lost, is_integer=False)
    program.add_rows(Rows.no_more_than(collected, taken[paid.rows], offsets))
    first = np.flatnonzero(np.diff(paid.target, prepend=-1, append=-1))
    groups = [collected[a:b] for a, b in itertools.pairwise(first) if b - a > 1]
    program.add_rows(Rows.at_most(groups, [1.0] * len(groups)))
    of_image = np.repeat(paid.lost, np.diff(offsets)) > 0.0
    comes = np.flatnonzero(paid.lost > 0.0)
    delivered = program.add_columns(paid.lost[comes], is_integer=False)
    program.add_rows(Rows.aligned((delivered, 1.0), (collected[comes], -1.0), upper=0.0))
    counts = np.concatenate([[0], np.cumsum(np.diff(offsets)[comes])])
    program.add_rows(Rows.no_more_than(delivered, down[paid.rows[of_image]], counts))
    return paid


def _constraints(
    model: PlanProgram,
    terms: list[ResourceTerms | None],
    formulation: Formulation,
    margin: float,
) -> None:
    program = model.program
    for satellite, precedence, own_terms in zip(
        model.problem.satellites, model.precedences, terms, strict=True
    ):
        own = model.taken[satellite.rows]
        if len(own) == 0:
            continue
        _agility(program, own, precedence, formulation)
        _detours(program, satellite, own, precedence)
        if own_terms is not None:
            down = model.down[satellite.rows]
            add_resources(program, satellite, own_terms, own, down, margin)
    _stations(program, model.problem, model.taken)


def _agility(program: Program, own: Ints, precedence: Precedence, formulation: Formulation) -> None:
    """Allow at most one of the tasks of a satellite that exclude each other."""
    if formulation == "pairwise":
        first, second = excluding_pairs(precedence)
        program.add_rows(Rows.aligned((own[first], 1.0), (own[second], 1.0), upper=1.0))
    else:
        offsets, members = clique_cover(precedence)
        program.add_rows(Rows.of(offsets, own[members], upper=1.0))


def _detours(
    program: Program, satellite: SatelliteProblem, own: Ints, precedence: Precedence
) -> None:
    """Require, for two tasks that may not follow directly, a task in between that allows it."""
    direct = direct_precedence(satellite)
    if precedence.bits is direct.bits:
        return
    first, second, offsets, between = detours(direct, precedence)
    ends = np.column_stack([own[first], own[second]]).ravel()
    at = np.repeat(offsets[1:], 2)
    column = np.insert(own[between], at, ends)
    value = np.insert(np.full(len(between), -1.0), at, 1.0)
    program.add_rows(Rows.of(offsets + 2 * np.arange(len(offsets)), column, value, upper=1.0))


def _stations(program: Program, problem: Problem, taken: Ints) -> None:
    """Limit the satellites that a station serves at a time to the number of its antennas."""
    groups = antenna_groups(problem)
    program.add_rows(
        Rows.at_most([taken[group.rows] for group in groups], [float(g.limit) for g in groups])
    )
