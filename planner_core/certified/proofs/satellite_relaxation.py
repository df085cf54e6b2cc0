"""The most that one satellite's battery and recorder let it gain: a dynamic programme.

The recorder is counted in levels, rounded in favour of the satellite, so the gain bounds its plans.
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
        One set of levels for each time span the last image may lie in, latest first, if every
        image must come down (how much data may remain at the end depends on the last image). A
        single set otherwise.
    shares
        What images lose by staying on board, if they earn something there.
    data_multiplier
        Multiplier of the data of the smallest collect, as a share of a typical collect's worth.
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
        """How many pairs of near tasks are visited for each unit of worth."""
        # With shares the battery alone is evaluated too, at each step of a bisection of instants.
        passes = 1 if self.shares is None else 1 + len(self.shares.since_s).bit_length()
        return passes * len(self.network.near_rows)

    def with_data_multiplier(self, num_images: int) -> SatelliteRelaxation:
        """Return the same with the data multiplier at which the bound by the battery is lowest.

        Parameters
        ----------
        num_images
            How many images a plan is expected to take, roughly.
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
            # The next multiplier's bound is lower, or it is the last: tables need not be larger.
            best, least, near = trial, needs.top, needs.top
        return best

    def without(self, is_shut: Bools) -> SatelliteRelaxation:
        """Return the same with some tasks that cannot be taken. Shape ``(m,)``."""

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
        """Return the most units that the satellite can gain, and the rows of a path that gains it.

        Returns a cheaper bound and no path once ``stop`` is set; returns ``enough`` and no path if
        the maximum is known to be below ``enough``.

        Parameters
        ----------
        worth
            Worth of every opportunity of the problem, in units. Shape ``(n,)``.
        unit
            The worth of a unit.
        near
            A gain that is expected at least, if one is known.
        keeps_path
            Whether to return the path.
        """
        weight = worth[self.satellite.rows]
        if self.shares is not None:
            return self._most_of_shares(weight, unit, enough, stop, near, keeps_path)
        return self._most_of_all(
            weight, np.zeros(self.levels.num_levels, dtype=np.int32), enough, stop, near, keeps_path
        )

    def most_by_battery(self, worth: Ints) -> int:
        """Return the most units that the battery alone allows; ``worth`` as for ``most``."""
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
        """Return the same if images earn a share on board; see ``Shares``.

        The instant between its two cases is first the latest at which the first case gains no more
        than the goal, then, if that differs, the latest at which it gains no more than the second.
        """
        shares = self.shares
        assert shares is not None
        goal = max(enough, near or 0)
        if goal == 0:
            goal = int(
                TUNING.first_goal * _Needs.of(self.network, self.levels, weight, 0.0, near).top
            )
        # By the battery alone smaller units take next to no time, unless there are many near pairs.
        num_cells = goal * (len(weight) + len(self.network.near_rows))
        finer = max(1, min(shares.finer(unit), MAX_CELLS // max(1, num_cells)))

        @cache  # both searches for an instant try the same ones
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
        """Return the same at these weights and these costs of the recorder's level at the end."""
        best, path = UNREACHED, None
        for number, levels in enumerate(self.classes):
            least = max(enough, best + 1)
            own = np.where(levels.before < 0, 0, weight).astype(np.int32)
            if number and _Needs.of(self.network, levels, own, 0.0, near).top < least:
                break  # an even earlier last image cannot gain more
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
        """Return the most units and a path; ``UNREACHED`` if below ``least``, or ``STOPPED``.

        Parameters
        ----------
        levels
            The recorder's levels if the last image lies in a certain span.
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
            # Labels that cannot reach the goal are dropped: the higher the goal, the quicker.
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
        """Return a level's multiplier in units, so that the smallest collect costs whole units."""
        typical = float(weight[weight > 0].mean()) if np.any(weight > 0) else 0.0
        filled = self.levels.gain[self.levels.gain > 0]
        least = int(filled.min()) if len(filled) else 1
        return float(np.round(self.data_multiplier * typical)) / least


def _classes(
    problem: Problem, satellite: SatelliteProblem, network: Network, levels: DataLevels
) -> tuple[DataLevels, ...]:
    """Return the levels for the last image in each span; see ``SatelliteRelaxation``.

    A span is as long as telemetry takes to fill half as much as the smallest image.
    """
    if not network.must_deliver:
        return (levels,)
    is_image = (network.is_contact == 0) & (problem.worth[satellite.rows] > 0.0)
    is_free = is_image & ~network.is_kept
    telemetry_per_s = satellite.resources.telemetry_per_s
    length_s = np.inf
    if telemetry_per_s > 0.0 and is_image.any():
        # Any length gives a bound: shorter ones lose less to telemetry, but make more classes.
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
    # If no images are taken but those that must be, everything may stay on board.
    before = np.where(is_shut, -1, levels.before).astype(np.int32)
    return (*classes, levels._replace(before=before))


class _Needs(NamedTuple):
    """The least energy to gain each amount from each task on, with a multiplier for data.

    At a multiplier for each level of the recorder images are worth less by the levels they fill,
    and contacts are worth the most levels they can empty. The recorder's limits are left out, but
    not ignored: from a level on, a path gains at most this worth plus the multipliers of the levels
    that are free.

    Attributes
    ----------
    idle, after
        Tables of ``least_energy``.
    credit
        What the free levels add, for each level. Shape ``(num_levels,)``.
    top
        An upper bound on the gain of any path.
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
        reduced = np.ceil(weight - multiplier * change - ROUNDING)
        reduced = np.maximum(reduced, 0.0).astype(np.int32)
        free = np.maximum(levels.end - np.arange(levels.num_levels), 0)
        credit = np.ceil(multiplier * free - ROUNDING).astype(np.int32)
        at_start = int(credit[min(levels.start, levels.num_levels - 1)])
        limit = int(1.07 * near) if near is not None else 0
        limit += 128 + int(reduced.max(initial=0))
        while True:
            idle, after = least_energy(network, reduced, limit)
            most = int(np.flatnonzero(idle[0] <= network.energy_start)[-1])
            if most < limit:
                break
            # Totals that no energy suffices for take memory, but next to no time.
            limit = 4 * limit if near is None else int(1.5 * limit)
        return cls(idle=idle, after=after, credit=credit, top=most + at_start)


def relaxations(
    problem: Problem, levels_per_collect: int = TUNING.fine
) -> tuple[SatelliteRelaxation, ...]:
    """Return the programmes of all satellites that have opportunities."""
    return tuple(
        SatelliteRelaxation.of(problem, satellite, levels_per_collect)
        for satellite in problem.satellites
        if len(satellite)
    )
