"""What images earn by the contact that brings them down, if they are worth less as they age.

An image earns at most what it would if it came down when its contact begins. Each contact brings
down as much as it can, in parts of images too; all contacts after the next few count as the first
of them. The order of images is left out. So no plan earns more than the program allows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.sizes import NEXT_CONTACTS
from planner_core.certified.tolerances import DOWN
from planner_core.problem import (
    CONTACT,
    Bools,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.worth import share_earned


class Images(NamedTuple):
    """Images of one satellite, with their columns. Shape ``(num_images,)``.

    Attributes
    ----------
    row
        Their opportunities.
    columns
        What limits how much of each comes down.
    first_end_s, last_end_s
        The earliest and the latest end of each.
    on_board
        What each earns if it stays on board.
    """

    row: Ints
    columns: Ints
    first_end_s: Floats
    last_end_s: Floats
    on_board: Floats


def add_deliveries(
    program: Program, problem: Problem, satellite: SatelliteProblem, images: Images, taken: Ints
) -> None:
    """Add what images earn beyond their worth on board.

    Parameters
    ----------
    taken
        Columns of the satellite's contacts, at their place among its tasks. Shape ``(m,)``.
    """
    table = problem.opportunities
    own = np.flatnonzero((satellite.kind == CONTACT) & (satellite.volume > 0.0))
    contacts, by = satellite.rows[own], taken[own]
    image, place, is_named = _next_contacts(images.first_end_s, table.start_s[contacts])
    if len(image) == 0:
        return
    of_image = images.row[image]
    ready_s = table.start_s[contacts] + problem.downlinks.stations.setup_s[table.site[contacts]]
    # The last one named stands for later ones too, of which one with less setup is ready sooner.
    soonest_s = np.minimum.accumulate(ready_s[::-1])[::-1]
    down_s = np.where(is_named, ready_s[place], soonest_s[place])
    age_s = np.maximum(down_s - images.last_end_s[image], 0.0)
    earned = problem.worth_on_ground[of_image] * share_earned(problem.objective, age_s)
    gain = np.minimum(earned, problem.worth[of_image]) - images.on_board[image]
    down = program.add_columns(np.maximum(gain, 0.0), is_integer=False)
    once, every = np.ones(len(down)), np.ones(len(images.row))
    program.add_rows(Rows.limited(down, once, image, images.columns, every))
    size = (table.end_s - table.start_s)[of_image] * satellite.resources.collect_fill_per_s
    volume = satellite.volume[own] + DOWN
    named, nth = down[is_named], place[is_named]
    program.add_rows(Rows.limited(named, size[is_named], nth, by, volume))
    program.add_rows(Rows.aligned((named, 1.0), (by[nth], -1.0), upper=0.0))


def _next_contacts(end_s: Floats, start_s: Floats) -> tuple[Ints, Ints, Bools]:
    """Return pairs of images and later contacts, and whether the contact stands for itself only."""
    first = np.searchsorted(start_s, end_s - TIME_TOLERANCE_S)
    place = first[:, None] + np.arange(NEXT_CONTACTS + 1)
    image, nth = np.nonzero(place < len(start_s))
    return image.astype(np.int32), place[image, nth].astype(np.int32), nth < NEXT_CONTACTS
