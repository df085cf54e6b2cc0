"""The planning model as a mixed-integer program, over all satellites at once."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from planner_core.certified.mip.clique_cuts import antichain_cover, detours, excluding_pairs
from planner_core.certified.mip.program import Program, Rows
from planner_core.certified.mip.resources import ResourceTerms, add_resources, resource_terms
from planner_core.precedence.antennas import antenna_groups
from planner_core.precedence.relation import (
    Precedence,
    direct_precedence,
    is_transitive,
    transitive_closure,
)
from planner_core.problem import (
    CONTACT,
    Floats,
    Ints,
    Longs,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.restrict import restricted

Formulation = Literal["antichain", "pairwise"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanProgram:
    """A program whose first columns are x: one for each opportunity.

    Attributes
    ----------
    problem
        The opportunities that a plan may take.
    orders
        For each satellite, which of its tasks can stand in one plan.
    paid
        What the columns beside x are paid for; None where x is paid itself.
    """

    problem: Problem
    program: Program
    taken: Ints
    precedences: tuple[Precedence, ...]
    paid: Paid | None

    def target_prices(self, row_prices: Floats) -> Floats:
        """Return what a relaxation says that each target is worth by itself.

        Rows of targets come first in the program.
        """
        most = self.problem.best_worth
        if self.paid is None:
            return np.clip(row_prices[: len(most)], 0.0, most)
        prices = np.zeros(len(most))
        left = self.paid.worth - row_prices[: len(self.paid.worth)]
        np.maximum.at(prices, self.paid.target, left)
        return np.clip(prices, 0.0, most)


class Paid(NamedTuple):
    """Images that are paid alike: those of one target that are worth the same.

    Attributes
    ----------
    target, worth
        Of each group; a target without images has one of them too, worth nothing.
        Shape ``(num_groups,)``.
    rows, offsets
        Their images, group by group, and where each group begins.
        Shapes ``(num_images,)`` and ``(num_groups + 1,)``.
    """

    target: Ints
    worth: Floats
    rows: Ints
    offsets: Longs

    @classmethod
    def of(cls, problem: Problem) -> Paid:
        """Return the groups of a problem, target after target."""
        rows, offsets = problem.target_opportunities
        empty = np.flatnonzero(np.diff(offsets) == 0)
        target = np.concatenate([problem.opportunities.place[rows], empty])
        worth = np.concatenate([problem.worth[rows], np.zeros(len(empty))])
        groups, group = np.unique(np.column_stack([target, worth]), axis=0, return_inverse=True)
        group = group.ravel()[: len(rows)]
        counts = np.bincount(group, minlength=len(groups))
        return cls(
            target=groups[:, 0].astype(np.int32),
            worth=groups[:, 1],
            rows=rows[np.argsort(group, kind="stable")],
            offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        )


def plan_program(
    problem: Problem, formulation: Formulation, margin: float, rows: Ints | None = None
) -> PlanProgram:
    """Return the program of the plans that take some of the tasks.

    Parameters
    ----------
    margin
        How far inside battery and recorder limits to stay.
    rows
        The opportunities that a plan may take, ascending; all by default.
    """
    terms = [
        resource_terms(problem, satellite) if problem.use_resources and len(satellite) else None
        for satellite in problem.satellites
    ]
    if rows is not None:
        # What a task costs depends on the tasks around it, taken or not.
        is_kept = np.zeros(len(problem.opportunities), dtype=np.bool_)
        is_kept[rows] = True
        kept = [np.flatnonzero(is_kept[s.rows]).astype(np.int32) for s in problem.satellites]
        terms = [own and own.of_part(part) for own, part in zip(terms, kept, strict=True)]
        problem = restricted(problem, rows)
    precedences = tuple(transitive_closure(satellite) for satellite in problem.satellites)
    program = Program()
    taken, paid = _variables(program, problem, is_transitive(problem))
    _constraints(program, problem, taken, precedences, terms, formulation, margin)
    return PlanProgram(
        problem=problem, program=program, taken=taken, precedences=precedences, paid=paid
    )


def _variables(program: Program, problem: Problem, is_direct: bool) -> tuple[Ints, Paid | None]:
    """Add x, 1 for what must be taken, and the objective: what the images are worth."""
    table, worth = problem.opportunities, problem.worth
    kept = np.zeros(len(table), dtype=np.bool_)
    kept[problem.kept_rows] = True
    if is_direct:
        useful = (worth > 0.0) | ((table.kind == CONTACT) & problem.use_resources)
        useful |= kept
        taken = program.add_columns(
            worth, lower=kept.astype(np.float64), upper=useful.astype(np.float64)
        )
        _once_per_target(program, problem, taken)
        return taken, None
    taken = program.add_columns(np.zeros(len(table)), lower=kept.astype(np.float64))
    return taken, _paid_for_the_best(program, problem, taken)


def _once_per_target(program: Program, problem: Problem, taken: Ints) -> None:
    """At most one collect of each target, over all satellites: others could not add to the best."""
    rows, offsets = problem.target_opportunities
    program.add_rows(Rows.of(offsets, taken[rows], upper=1.0))


def _paid_for_the_best(program: Program, problem: Problem, taken: Ints) -> Paid:
    """Pay for one image of each target that is taken.

    A slow satellite may turn by way of a target that it has collected already.
    """
    paid = Paid.of(problem)
    offsets = paid.offsets
    collected = program.add_columns(paid.worth, is_integer=False)
    column = np.insert(taken[paid.rows], offsets[1:], collected)
    value = np.insert(np.full(len(paid.rows), -1.0), offsets[1:], 1.0)
    program.add_rows(Rows.of(offsets + np.arange(len(offsets)), column, value, upper=0.0))
    first = np.flatnonzero(np.diff(paid.target, prepend=-1, append=-1))
    groups = [collected[a:b] for a, b in itertools.pairwise(first) if b - a > 1]
    program.add_rows(Rows.at_most(groups, [1.0] * len(groups)))
    return paid


def _constraints(
    program: Program,
    problem: Problem,
    taken: Ints,
    precedences: tuple[Precedence, ...],
    terms: list[ResourceTerms | None],
    formulation: Formulation,
    margin: float,
) -> None:
    for satellite, precedence, own_terms in zip(
        problem.satellites, precedences, terms, strict=True
    ):
        own = taken[satellite.rows]
        if len(own) == 0:
            continue
        _agility(program, own, precedence, formulation)
        _detours(program, satellite, own, precedence)
        if own_terms is not None:
            add_resources(program, satellite, own_terms, own, margin)
    _stations(program, problem, taken)


def _agility(program: Program, own: Ints, precedence: Precedence, formulation: Formulation) -> None:
    """Tasks of one satellite that exclude each other: one of them at most."""
    if formulation == "pairwise":
        first, second = excluding_pairs(precedence)
        program.add_rows(Rows.aligned((own[first], 1.0), (own[second], 1.0), upper=1.0))
    else:
        offsets, members = antichain_cover(precedence)
        program.add_rows(Rows.of(offsets, own[members], upper=1.0))


def _detours(
    program: Program, satellite: SatelliteProblem, own: Ints, precedence: Precedence
) -> None:
    """Two tasks that do not follow directly need another in between that makes up for it."""
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
    """Let a station serve no more satellites at a time than it has antennas."""
    groups = antenna_groups(problem)
    program.add_rows(
        Rows.at_most([taken[group.rows] for group in groups], [float(g.limit) for g in groups])
    )
