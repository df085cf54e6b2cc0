"""What images earn by the contact that brings them down, if they are worth less as they age.

An image earns at most what it would if it came down when its contact begins. Each contact brings
down as much as it can, in parts of images too; all contacts after the next few count as the first
of them. The order of images is left out. So no plan earns more than the program allows.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.sizes import NEXT_CONTACTS
from planner_core.certified.tolerances import DOWN
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.worth import share_earned


def add_deliveries(
    program: Program, problem: Problem, taken: Ints, may_come: Ints, on_board: Floats
) -> None:
    """Add what images earn beyond their worth on board.

    Parameters
    ----------
    taken
        The columns x. Shape ``(n,)``.
    may_come
        Columns that limit what comes down of each image; x if there is no other. Shape ``(n,)``.
    on_board
        What each image earns if it stays on board. Shape ``(n,)``.
    """
    for satellite in problem.satellites:
        _add_satellite(program, problem, satellite, taken, may_come, on_board)


def _add_satellite(
    program: Program,
    problem: Problem,
    satellite: SatelliteProblem,
    taken: Ints,
    may_come: Ints,
    on_board: Floats,
) -> None:
    table, rows = problem.opportunities, satellite.rows
    images = rows[satellite.kind == COLLECT]
    contacts = rows[(satellite.kind == CONTACT) & (satellite.volume > 0.0)]
    image, place, is_named = _next_contacts(table.end_s[images], table.start_s[contacts])
    if len(image) == 0:
        return
    of_image, contact = images[image], contacts[place]
    ready_s = table.start_s[contact] + problem.downlinks.stations.setup_s[table.site[contact]]
    age_s = ready_s - table.end_s[of_image]
    earned = problem.worth_on_ground[of_image] * share_earned(problem.objective, age_s)
    gain = np.minimum(earned, problem.worth[of_image]) - on_board[of_image]
    down = program.add_columns(np.maximum(gain, 0.0), is_integer=False)
    once = np.ones(len(down))
    program.add_rows(Rows.limited(down, once, of_image, may_come, np.ones(len(table))))
    size = (table.end_s - table.start_s)[of_image] * satellite.resources.collect_fill_per_s
    volume = np.zeros(len(table))
    volume[contacts] = satellite.volume[problem.local_row[contacts]] + DOWN
    named, by = down[is_named], contact[is_named]
    program.add_rows(Rows.limited(named, size[is_named], by, taken, volume))
    program.add_rows(Rows.aligned((named, 1.0), (taken[by], -1.0), upper=0.0))


def _next_contacts(end_s: Floats, start_s: Floats) -> tuple[Ints, Ints, Bools]:
    """Return pairs of images and later contacts, and whether the contact stands for itself only."""
    first = np.searchsorted(start_s, end_s - TIME_TOLERANCE_S)
    place = first[:, None] + np.arange(NEXT_CONTACTS + 1)
    image, nth = np.nonzero(place < len(start_s))
    return image.astype(np.int32), place[image, nth].astype(np.int32), nth < NEXT_CONTACTS
