"""A problem with some opportunities left out, or with some that must be taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
import numpy.typing as npt

from planner_core.problem import (
    Floats,
    Ints,
    Kept,
    Opportunities,
    Pinned,
    Problem,
    build_satellite_problem,
)


def restricted(problem: Problem, rows: npt.NDArray[np.integer]) -> Problem:
    """Return the problem with these opportunities alone, in ascending order.

    Tasks to be kept remain so if they are among them. Events stay those of the whole problem.
    """
    table = problem.opportunities
    part = Opportunities(**{f.name: getattr(table, f.name)[rows] for f in fields(Opportunities)})
    is_left = np.zeros(len(table), dtype=np.bool_)
    is_left[rows] = True
    place = np.cumsum(is_left) - 1
    pinned = replace(
        problem.pinned,
        kept=tuple(
            replace(k, row=int(place[k.row])) for k in problem.pinned.kept if is_left[k.row]
        ),
    )
    return with_table(
        problem,
        part,
        pinned=pinned,
        origin=rows,
        events=[(s.event_s, s.event[is_left[s.rows]]) for s in problem.satellites],
    )


def taking(problem: Problem, contacts: Sequence[int]) -> Problem:
    """Return the problem in which these contacts must be taken."""
    already = {kept.row for kept in problem.pinned.kept}
    new = tuple(Kept(row=row, pointer="") for row in contacts if row not in already)
    return replace(problem, pinned=replace(problem.pinned, kept=(*problem.pinned.kept, *new)))


def with_table(
    problem: Problem,
    table: Opportunities,
    *,
    pinned: Pinned,
    origin: npt.NDArray[np.integer],
    events: Sequence[tuple[Floats, Ints] | None],
) -> Problem:
    """Return the problem with another table of opportunities.

    Parameters
    ----------
    origin
        The row of the problem's table that each opportunity stands for.
    events
        By satellite, ``event_s`` and ``event`` if there are more events than opportunities.
    """
    return replace(
        problem,
        opportunities=table,
        worth=problem.worth[origin],
        full_worth=None if problem.full_worth is None else problem.full_worth[origin],
        pinned=pinned,
        origin=(origin if problem.origin is None else problem.origin[origin]).astype(np.int32),
        satellites=tuple(
            build_satellite_problem(
                index,
                table,
                id=satellite.id,
                name=satellite.name,
                agility=satellite.agility,
                resources=satellite.resources,
                sunlight=satellite.sunlight,
                downlinks=problem.downlinks,
                sun=satellite.sun,
                events=own,
                heading=satellite.heading,
            )
            for index, (satellite, own) in enumerate(zip(problem.satellites, events, strict=True))
        ),
    )
