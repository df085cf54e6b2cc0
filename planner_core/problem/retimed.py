"""A problem whose opportunities start at other instants of their accesses."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np

from planner_core.problem import (
    COLLECT,
    Floats,
    Ints,
    Opportunities,
    Problem,
)
from planner_core.problem.plan import Action, Plan
from planner_core.problem.pointing import sights
from planner_core.problem.restrict import with_table
from planner_core.problem.slew import TIME_TOLERANCE_S


class Retimed(NamedTuple):
    """A problem made from another one.

    Attributes
    ----------
    source
        Row of the other problem that each opportunity stands for. Shape ``(n,)``.
    """

    problem: Problem
    source: Ints


def retimed(problem: Problem, rows: Ints, start_s: Floats) -> Retimed:
    """Return the problem with these opportunities alone, each at its entry of ``start_s``.

    A row may occur several times, at different starts; the same start in the same access is
    offered once. Angles for display stay those of the source row.
    """
    table = problem.opportunities
    start_ms = np.rint(start_s * 1000.0).astype(np.int64)
    _, first = np.unique(np.column_stack([table.access[rows], start_ms]), axis=0, return_index=True)
    rows, start_s = rows[first], start_s[first]
    end_s = start_s + (table.end_s[rows] - table.start_s[rows])
    # Round to whole milliseconds again, as in the table.
    end_s = np.where(start_s == table.start_s[rows], table.end_s[rows], np.round(end_s, 3))
    order = np.lexsort(
        (_rank(problem, rows), table.kind[rows], table.satellite[rows], end_s, start_s)
    )
    rows, start_s, end_s = rows[order].astype(np.int32), start_s[order], end_s[order]
    columns = {f.name: getattr(table, f.name)[rows] for f in fields(Opportunities)}
    columns |= {"start_s": start_s, "end_s": end_s}
    is_own = np.abs(start_s - table.start_s[rows]) > TIME_TOLERANCE_S
    columns["los_start"], columns["los_end"] = _lines_of_sight(
        problem, rows, start_s, end_s, is_own
    )
    part = Opportunities(**columns)
    place = np.full(len(table), -1, dtype=np.int64)
    place[rows[~is_own]] = np.flatnonzero(~is_own)
    pinned = replace(
        problem.pinned,
        kept=tuple(
            replace(k, row=int(place[k.row])) for k in problem.pinned.kept if place[k.row] >= 0
        ),
        ruled_out=problem.pinned.ruled_out.placed(place),
    )
    made = with_table(
        problem, part, pinned=pinned, origin=rows, events=[None] * len(problem.satellites)
    )
    return Retimed(made, rows)


def with_starts(problem: Problem, rows: Ints, start_s: Floats) -> Retimed:
    """Return the problem with further opportunities: each of these rows at the given start."""
    every = np.arange(len(problem.opportunities), dtype=np.int32)
    return retimed(
        problem,
        np.concatenate([every, rows]).astype(np.int32),
        np.concatenate([problem.opportunities.start_s, start_s]),
    )


def offered(made: Retimed, problem: Problem, plan: Plan) -> Plan:
    """Return a plan of ``problem`` in the rows of the problem made from it, action by action.

    Raises
    ------
    KeyError
        An action's start is not offered.
    """
    table, access = made.problem.opportunities, problem.opportunities.access
    at = {
        (int(table.access[row]), round(float(table.start_s[row]) * 1000)): row
        for row in range(len(table))
    }
    return Plan(
        tuple(
            Action(a.start_s, a.end_s, at[int(access[a.opportunity]), round(a.start_s * 1000)])
            for a in plan.actions
        )
    )


def _rank(problem: Problem, rows: Ints) -> Ints:
    """Return the rank of each row's site by its id as text, which is the table's order."""
    table = problem.opportunities
    ranks = []
    for ids in (problem.target_ids, problem.station_ids):
        rank = np.zeros(max(len(ids), 1), dtype=np.int32)
        rank[sorted(range(len(ids)), key=ids.__getitem__)] = np.arange(len(ids), dtype=np.int32)
        ranks.append(rank)
    is_collect, site = table.kind[rows] == COLLECT, table.site[rows]
    return np.where(
        is_collect,
        ranks[0][np.where(is_collect, site, 0)],
        ranks[1][np.where(is_collect, 0, site)],
    )


def _lines_of_sight(
    problem: Problem, rows: Ints, start_s: Floats, end_s: Floats, is_own: np.ndarray
) -> tuple[Floats, Floats]:
    table, pointing = problem.opportunities, problem.pointing
    looks, looked = table.los_start[rows].copy(), table.los_end[rows].copy()
    if pointing is None:
        return looks, looked
    for index, path in enumerate(pointing.paths):
        own = np.flatnonzero(
            is_own & (table.satellite[rows] == index) & (table.kind[rows] == COLLECT)
        )
        site = table.site[rows[own]]
        looks[own] = sights(path, pointing.targets_m, site, start_s[own])
        looked[own] = sights(path, pointing.targets_m, site, end_s[own])
    return looks, looked
