"""What one satellite can gain at most by its battery and its recorder: a dynamic programme.

The recorder is counted in levels, in favour of the satellite; what it gains bounds any plan of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.completion_bounds import least_energy
from planner_core.certified.dp.data_levels import DataLevels, data_levels
from planner_core.certified.dp.forward_labels import Goal, most_value, path_of
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.proofs.shares import Shares
from planner_core.certified.signs import STOPPED, UNREACHED
from planner_core.certified.sizes import MAX_CELLS
from planner_core.certified.tolerances import ROUNDING
from planner_core.certified.tuning import TUNING
from planner_core.problem import (
    COLLECT,
    Bools,
    Bytes,
    Ints,
    Problem,
    SatelliteProblem,
    Singles,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SatelliteRelaxation:
    """One satellite's programme: its network, and its recorder in levels.

    Attributes
    ----------
    classes
        The levels with the last image in one span after another, from the last one on, where it
        must come down: what may be left at the end hangs on that. The same levels otherwise.
    shares
        What images earn less that stay on board, where they earn something there.
    data_multiplier
        What the data of a collect is worth, about, in typical collects.
    """

    satellite: SatelliteProblem
    network: Network
    levels: DataLevels
    classes: tuple[DataLevels, ...]
    shares: Shares | None = None
    data_multiplier: float = 0.0

    @classmethod
    def of(
        cls, problem: Problem, satellite: SatelliteProblem, levels_per_collect: int
    ) -> SatelliteRelaxation:
        """Return the relaxation of a satellite that has opportunities."""
        network = network_of(problem, satellite)
        levels = data_levels(network, levels_per_collect, is_optimistic=True)
        classes = _classes(problem, satellite, network, levels)
        shares = Shares.of(problem, satellite, network)
        return cls(
            satellite=satellite, network=network, levels=levels, classes=classes, shares=shares
        )

    @property
    def num_near_steps(self) -> int:
        """How many pairs of tasks near each other are looked at for each unit of worth."""
        # With shares by the battery alone as well, as often as it takes to halve all instants.
        passes = 1 if self.shares is None else 1 + len(self.shares.since_s).bit_length()
        return passes * len(self.network.near_rows)

    def with_data_multiplier(self, num_images: int) -> SatelliteRelaxation:
        """Return the same with the multiplier of data at which the battery alone allows least.

        Parameters
        ----------
        num_images
            How many are expected, about.
        """
        num_units = TUNING.levels_per_collect
        while num_units * num_images * len(self.satellite) > MAX_CELLS:
            num_units //= 2
        weight = np.where(self.satellite.kind == COLLECT, num_units, 0).astype(np.int32)
        best, least, near = self, np.inf, num_units * num_images
        for units in range(num_units):
            trial = replace(self, data_multiplier=units / num_units)
            needs = _Needs.of(
                self.network, self.levels, weight, trial._level_multiplier(weight), near
            )
            if needs.top >= least:
                break
            # A higher multiplier allows less, or is the last: its tables need be no larger.
            best, least, near = trial, needs.top, needs.top
        return best

    def without(self, is_shut: Bools) -> SatelliteRelaxation:
        """Return the same where some tasks cannot be taken. Shape ``(m,)``."""

        def shut(levels: DataLevels) -> DataLevels:
            return levels._replace(before=np.where(is_shut, -1, levels.before).astype(np.int32))

        return replace(self, levels=shut(self.levels), classes=tuple(map(shut, self.classes)))

    def most(
        self,
        worth: Ints,
        unit: float,
        enough: int,
        stop: Bytes,
        *,
        near: int | None = None,
        keeps_path: bool = False,
    ) -> tuple[int, Ints | None]:
        """Return the most units that the satellite can gain, and the rows of a path that does.

        Answers a cheaper bound on it, and no path, once ``stop`` is set or where the most is
        known to be below ``enough`` (which it answers then).

        Parameters
        ----------
        worth
            In units, of every opportunity of the problem. Shape ``(n,)``.
        unit
            What they are.
        near
            What is expected at least, if anything.
        keeps_path
            Whether to answer the path.
        """
        weight = worth[self.satellite.rows]
        if self.shares is not None:
            return self._most_of_shares(weight, unit, enough, stop, near, keeps_path)
        return self._most_of_all(
            weight, np.zeros(self.levels.num_levels, dtype=np.int32), enough, stop, near, keeps_path
        )

    def most_by_battery(self, worth: Ints) -> int:
        """Return the most units that the battery alone allows, with ``worth`` as for ``most``."""
        weight = worth[self.satellite.rows]
        return _Needs.of(self.network, self.levels, weight, 0.0, None).top

    def _most_of_shares(
        self,
        weight: Ints,
        unit: float,
        enough: int,
        stop: Bytes,
        near: int | None,
        keeps_path: bool,
    ) -> tuple[int, Ints | None]:
        """Return the same where images earn a share on board; see ``Shares``.

        The instant that tells the two cases apart is tried where the first of them is known not to
        matter, and once more where what the second came to says so.
        """
        shares = self.shares
        assert shares is not None
        goal = max(enough, near or 0)
        if goal == 0:
            goal = int(
                TUNING.first_goal * _Needs.of(self.network, self.levels, weight, 0.0, near).top
            )
        # By the battery alone smaller units take next to no time, unless near pairs are many.
        num_cells = goal * (len(weight) + len(self.network.near_rows))
        finer = max(1, min(shares.finer(unit), MAX_CELLS // max(1, num_cells)))

        @cache  # both searches for an instant look at the same ones
        def before(since: int) -> int:
            own = shares.weights_before(weight, unit, since, finer)
            most = int(_Needs.of(self.network, self.levels, own, 0.0, finer * goal).top)
            return -(-most // finer)

        def after(since: int) -> tuple[int, Ints | None]:
            own = shares.weights(weight, unit, since)
            cost = shares.end_cost(self.levels, unit, since)
            return self._most_of_all(own, cost, enough, stop, near, keeps_path)

        since, early = shares.latest(before, goal)
        most, path = after(since)
        later, lower = shares.latest(before, max(most, enough))
        if max(most, early) > enough and later != since and not stop[0]:
            again, other = after(later)
            if max(again, lower) < max(most, early):
                most, early, path = again, lower, other
        return max(most, early), path

    def _most_of_all(
        self,
        weight: Ints,
        end_cost: Ints,
        enough: int,
        stop: Bytes,
        near: int | None,
        keeps_path: bool,
    ) -> tuple[int, Ints | None]:
        """Return the same at these weights and costs of what a recorder holds at the end."""
        best, path = UNREACHED, None
        for number, levels in enumerate(self.classes):
            least = max(enough, best + 1)
            own = np.where(levels.before < 0, 0, weight).astype(np.int32)
            if number and _Needs.of(self.network, levels, own, 0.0, near).top < least:
                break  # there is no more to gain by images that lie earlier still
            gained, found = self._most_of_class(
                levels, own, end_cost, least, stop, near, keeps_path
            )
            if gained == STOPPED:
                return max(_Needs.of(self.network, self.levels, weight, 0.0, near).top, 0), None
            if gained != UNREACHED:
                best, path = gained, found
        return (max(enough, 0), None) if best == UNREACHED else (best, path)

    def _most_of_class(
        self,
        levels: DataLevels,
        weight: Ints,
        end_cost: Ints,
        least: int,
        stop: Bytes,
        near: int | None,
        keeps_path: bool,
    ) -> tuple[int, Ints | None]:
        """Return the most units and a path, ``UNREACHED`` if that is below ``least``, ``STOPPED``.

        Parameters
        ----------
        levels
            The recorder where the last image lies in a certain span.
        weight, end_cost
            In units, of each task of the satellite and of each level at the end. Shapes ``(m,)``
            and ``(num_levels,)``.
        """
        needs = _Needs.of(self.network, levels, weight, self._level_multiplier(weight), near)
        top = needs.top
        step = max(1, int(TUNING.little * top))
        goal = top
        if near is not None and near < top:
            goal = min(top, near + step)
        while goal >= least:
            # Labels that cannot reach the goal are dropped: the higher, the quicker.
            goal = max(least, goal - step, 0)
            wanted = Goal(goal, needs.idle, needs.after, needs.credit)
            most, labels = most_value(
                self.network, levels, weight, end_cost, wanted, top, keeps_path, stop
            )
            if most == STOPPED:
                return STOPPED, None
            if most != UNREACHED:
                if not keeps_path:
                    return most, None
                return most, path_of(self.network, levels, weight, end_cost, labels, most)
            goal, step = goal - 1, 2 * step
        return UNREACHED, None

    def _level_multiplier(self, weight: Ints) -> float:
        """Return a level's multiplier in units, so that the least collect costs whole units."""
        typical = float(weight[weight > 0].mean()) if np.any(weight > 0) else 0.0
        filled = self.levels.gain[self.levels.gain > 0]
        least = int(filled.min()) if len(filled) else 1
        return float(np.round(self.data_multiplier * typical)) / least


def _classes(
    problem: Problem, satellite: SatelliteProblem, network: Network, levels: DataLevels
) -> tuple[DataLevels, ...]:
    """Return the levels with the last image in each span; see ``SatelliteRelaxation``.

    A span is as long as telemetry takes to fill half of the smallest image.
    """
    if not network.must_deliver:
        return (levels,)
    is_image = (network.is_contact == 0) & (problem.worth[satellite.rows] > 0.0)
    is_free = is_image & ~network.is_kept
    telemetry_per_s = satellite.resources.telemetry_per_s
    length_s = np.inf
    if telemetry_per_s > 0.0 and is_image.any():
        # Any length is a bound: shorter ones lose less of it to telemetry, and make more classes.
        length_s = 0.5 * float(network.data_gain[is_image].min()) / telemetry_per_s
    is_shut = (network.is_contact == 0) & ~is_image & ~network.is_kept
    classes = []
    while is_free.any():
        end_s = satellite.end_s[is_free]
        is_last = is_free & (satellite.end_s > end_s.max() - length_s)
        before = np.where(is_shut, -1, levels.before).astype(np.int32)
        end = min(levels.end, int(levels.delivered[is_last].max()))
        classes.append(levels._replace(before=before, end=end))
        is_free, is_shut = is_free & ~is_last, is_shut | is_last
    # With what must be taken alone everything may stay on board.
    before = np.where(is_shut, -1, levels.before).astype(np.int32)
    return (*classes, levels._replace(before=before))


class _Needs(NamedTuple):
    """The least energy to gain so much from each task on, where data has a multiplier.

    At a multiplier for each level of the recorder images are worth less, and contacts what they
    take down at most. That leaves the limits of the recorder out, and yet not for nothing: what is
    gained from a level on is no more than that worth, and the multiplier of the levels that are
    free.

    Attributes
    ----------
    idle, after
        Tables of ``least_energy``.
    credit
        What levels that are free add, for each level. Shape ``(num_levels,)``.
    top
        No path gains more.
    """

    idle: Singles
    after: Singles
    credit: Ints
    top: int

    @classmethod
    def of(
        cls, network: Network, levels: DataLevels, weight: Ints, multiplier: float, near: int | None
    ) -> _Needs:
        change = np.maximum(levels.gain, levels.floor - levels.before)
        priced = np.ceil(weight - multiplier * change - ROUNDING)
        priced = np.maximum(priced, 0.0).astype(np.int32)
        free = np.maximum(levels.end - np.arange(levels.num_levels), 0)
        credit = np.ceil(multiplier * free - ROUNDING).astype(np.int32)
        at_start = int(credit[min(levels.start, levels.num_levels - 1)])
        limit = int(1.07 * near) if near is not None else 0
        limit += 128 + int(priced.max(initial=0))
        while True:
            idle, after = least_energy(network, priced, limit)
            most = int(np.flatnonzero(idle[0] <= network.energy_start)[-1])
            if most < limit:
                break
            # Totals that no energy suffices for take memory, and next to no time.
            limit = 4 * limit if near is None else int(1.5 * limit)
        return cls(idle=idle, after=after, credit=credit, top=most + at_start)


def relaxations(
    problem: Problem, levels_per_collect: int = TUNING.fine
) -> tuple[SatelliteRelaxation, ...]:
    """Return the programmes of all satellites that have anything to do."""
    return tuple(
        SatelliteRelaxation.of(problem, satellite, levels_per_collect)
        for satellite in problem.satellites
        if len(satellite)
    )
