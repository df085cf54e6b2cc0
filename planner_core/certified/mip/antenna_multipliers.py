"""Multipliers of antennas at which contacts pay for what they bring down, from a linear program.

If stations cannot serve all satellites, antenna time limits what a fleet brings down. The
subgradient steps of ``ResourceAscent`` find such multipliers slowly: a satellite that pays for one
contact takes another. The program knows all contacts at once, but nothing of energy or agility,
which the exact programmes account for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.proofs.satellite_relaxation import SatelliteRelaxation
from planner_core.precedence.antennas import antenna_groups, at_the_same_time
from planner_core.problem import COLLECT, Bools, Floats, Ints, Problem
from planner_core.problem.delivery import lost_on_board


class AntennaMultipliers(NamedTuple):
    """What antennas and images are worth by the program.

    Attributes
    ----------
    of_groups
        Multiplier of each of the ``antenna_groups``. Shape ``(num_groups,)``.
    share
        Mean share of their worth that the images of each target keep after paying for coming down.
        Shape ``(num_targets,)``.
    """

    of_groups: Floats
    share: Floats


class _Downlink:
    """One satellite's contacts, in order of their ends, and what it may have recorded before them.

    Attributes
    ----------
    own, size
        The satellite's opportunities, and the sizes of images, in recorder capacities. Shape
        ``(len(satellite),)``.
    rows, recorded, volume
        Contacts; the total size of the images before each, in the choice with most; the most of
        that it takes down. Shape ``(m,)``.
    """

    def __init__(
        self, problem: Problem, one: SatelliteRelaxation, choices: Sequence[Bools]
    ) -> None:
        table, own, gain = problem.opportunities, one.satellite.rows, one.network.data_gain
        contacts = np.flatnonzero((one.network.is_contact == 1) & (gain < 0.0))
        contacts = contacts[np.argsort(table.end_s[own[contacts]], kind="stable")]
        self.own, self.rows = own, own[contacts]
        self.size = np.maximum(gain, 0.0)
        self._end_s, self._start_s = table.end_s[own], table.start_s[self.rows]
        by_end = np.argsort(self._end_s, kind="stable")
        num_before = np.searchsorted(self._end_s[by_end], self._start_s, side="right")
        held = [np.where(is_taken[own], self.size, 0.0)[by_end] for is_taken in choices]
        recorded = [np.append(0.0, np.cumsum(sizes))[num_before] for sizes in held]
        self.recorded: Floats = np.max(recorded, axis=0)
        self.volume: Floats = np.minimum(-gain[contacts], self.recorded)

    def paid_for(self, worth: Floats) -> Floats:
        """Return what the data of each opportunity is worth, given that before each contact.

        It is the worth before the first contact, by its end, that begins after the opportunity.
        """
        by_start = np.argsort(self._start_s, kind="stable")
        after = np.searchsorted(self._start_s[by_start], self._end_s, side="left")
        # Of the contacts from each start on, the first by its end; the last entry stands for none.
        first = np.minimum.accumulate(np.append(by_start, len(by_start))[::-1])[::-1]
        return np.append(worth, 0.0)[first[after]] * self.size


def antenna_multipliers(
    problem: Problem,
    satellites: Sequence[SatelliteRelaxation],
    choices: Sequence[Bools],
    budget: Budget,
    seed: int,
) -> AntennaMultipliers | None:
    """Return the duals of a fleet's downlink: contacts in part, each after what it brings down.

    Parameters
    ----------
    choices
        Opportunities that satellites would take if antennas allowed. No more comes down by a
        contact than one of these choices has recorded before it, and data earns what its images
        lose on board. Shape ``(n,)`` each.

    Returns
    -------
    AntennaMultipliers | None
        None if all of it can come down, or time is over.
    """
    downlinks = [_Downlink(problem, one, choices) for one in satellites]
    # Images after which no contact follows earn what they do on board.
    loses = np.logical_or.reduce(choices) & (lost_on_board(problem) > 0.0)
    recorded = sum(float(one.size[loses[one.own]].sum()) for one in downlinks)
    lost = float(lost_on_board(problem)[loses].sum())
    groups = antenna_groups(problem)
    if not (groups and recorded > 0.0 and lost > 0.0):
        return None
    engine = Engine(_program(problem, downlinks), budget, seed, is_chained=False)
    if engine.relaxed() is None:
        return None
    worth = engine.row_duals * (lost / recorded)
    if not worth[: len(groups)].any():
        return None
    paid = np.zeros(len(problem.opportunities))
    first = len(groups)
    for one in downlinks:
        paid[one.own] = one.paid_for(worth[first : first + len(one.rows)])
        first += len(one.rows)
    return AntennaMultipliers(worth[: len(groups)], _shares(problem, paid))


def _program(problem: Problem, downlinks: Sequence[_Downlink]) -> Program:
    """Return the program, with rows for the groups of contacts first, then for all contacts."""
    program = Program()
    column = np.full(len(problem.opportunities), -1, dtype=np.int32)
    chains: list[Rows] = []
    together: list[Ints] = []
    for one in downlinks:
        column[one.rows] = taken = program.add_columns(one.volume, is_integer=False)
        # Data that has come down at first (none), and by the end of each contact.
        most = np.append(0.0, one.recorded)
        down = program.add_columns(np.zeros(len(most)), upper=most, is_integer=False)
        terms = (down[1:], 1.0), (down[:-1], -1.0), (taken, -one.volume)
        chains.append(Rows.aligned(*terms, lower=0.0, upper=0.0))
        together += [column[rows] for rows in at_the_same_time(problem, one.rows)]
    groups = antenna_groups(problem)
    members = [column[group.rows] for group in groups]
    members = [columns[columns >= 0] for columns in members]
    program.add_rows(Rows.at_most(members, [float(group.limit) for group in groups]))
    for rows in chains:
        program.add_rows(rows)
    program.add_rows(Rows.at_most(together, [1.0] * len(together)))
    return program


def _shares(problem: Problem, paid: Floats) -> Floats:
    """Return what images of each target earn after paying, as a mean share of their worth."""
    table = problem.opportunities
    rows = np.flatnonzero((table.kind == COLLECT) & (problem.worth > 0.0))
    left = problem.worth - np.maximum(lost_on_board(problem) - paid, 0.0)
    num_targets = len(problem.target_ids)
    count = np.bincount(table.site[rows], minlength=num_targets)
    total = np.bincount(
        table.site[rows], weights=left[rows] / problem.worth[rows], minlength=num_targets
    )
    return np.where(count > 0, total / np.maximum(count, 1), 1.0)
