"""A problem with some of its opportunities left out."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import numpy.typing as npt

from planner_core.problem import Opportunities, Problem, build_satellite_problem


def restricted(problem: Problem, rows: npt.NDArray[np.integer]) -> Problem:
    """Return the problem with these opportunities alone, in ascending order.

    Of the tasks to be kept those that are left remain so. Events stay those of the whole.
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
    return replace(
        problem,
        opportunities=part,
        pinned=pinned,
        origin=(rows if problem.origin is None else problem.origin[rows]).astype(np.int32),
        satellites=tuple(
            build_satellite_problem(
                index,
                part,
                id=satellite.id,
                name=satellite.name,
                agility=satellite.agility,
                resources=satellite.resources,
                sunlight=satellite.sunlight,
                events=(satellite.event_s, satellite.event[is_left[satellite.rows]]),
            )
            for index, satellite in enumerate(problem.satellites)
        ),
    )
