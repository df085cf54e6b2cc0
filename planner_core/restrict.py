"""A problem with some of its opportunities left out."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import numpy.typing as npt

from planner_core.problem import Opportunities, Problem, build_satellite_problem


def restricted(problem: Problem, rows: npt.NDArray[np.integer]) -> Problem:
    """Return the problem with these opportunities alone, in ascending order."""
    table = problem.opportunities
    part = Opportunities(**{f.name: getattr(table, f.name)[rows] for f in fields(Opportunities)})
    return replace(
        problem,
        opportunities=part,
        satellites=tuple(
            build_satellite_problem(
                index,
                part,
                id=satellite.id,
                name=satellite.name,
                agility=satellite.agility,
                resources=satellite.resources,
                sunlight=satellite.sunlight,
            )
            for index, satellite in enumerate(problem.satellites)
        ),
    )
