"""The data that contacts take down: a rate over time for the referee, one volume for solvers.

If the rate follows the elevation, it is known at instants of each pass and linear between them.
The referee and the solvers use the same rate, but each integrates it in its own way.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.jit import kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.integer]
Longs = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class PassRate:
    """How fast data comes down during one access to a station, setup ignored.

    Attributes
    ----------
    time_s
        Instants from the first to the last of the access, ascending. Shape ``(k,)``.
    per_s
        Rates at these instants, in recorder capacities per second; linear between them.
        Shape ``(k,)``.
    """

    time_s: Floats
    per_s: Floats

    def until(self, t_s: Floats) -> Floats:
        """Return how much comes down from the first instant until each of these.

        >>> rate = PassRate(time_s=np.array([0.0, 2.0, 4.0]), per_s=np.array([1.0, 3.0, 3.0]))
        >>> rate.until(np.array([1.0, 2.0, 4.0]))
        array([ 1.5,  4. , 10. ])
        """
        steps_s, whole = self._added_up
        at = np.clip(np.searchsorted(self.time_s, t_s, side="right") - 1, 0, len(steps_s) - 1)
        into_s = np.clip(t_s - self.time_s[at], 0.0, steps_s[at])
        slope = (self.per_s[at + 1] - self.per_s[at]) / steps_s[at]
        return np.asarray(whole[at] + into_s * (self.per_s[at] + slope * into_s / 2.0))

    def when(self, amount: Floats) -> Floats:
        """Return the first instants at which these amounts have come down.

        Amounts lie between 0 and what the whole access gives.

        >>> rate = PassRate(time_s=np.array([0.0, 2.0, 4.0]), per_s=np.array([1.0, 3.0, 3.0]))
        >>> rate.when(np.array([0.0, 1.5, 4.0, 10.0]))
        array([0., 1., 2., 4.])
        """
        steps_s, whole = self._added_up
        at = np.clip(np.searchsorted(whole, amount, side="left") - 1, 0, len(steps_s) - 1)
        first = self.per_s[at]
        rise = (self.per_s[at + 1] - first) / steps_s[at]
        missing = np.maximum(amount - whole[at], 0.0)
        # This form of the quadratic's root also holds if the rate is constant.
        until = first + np.sqrt(np.maximum(first**2 + 2.0 * rise * missing, 0.0))
        into_s = np.divide(2.0 * missing, until, out=np.zeros_like(missing), where=until > 0.0)
        return np.asarray(self.time_s[at] + np.minimum(into_s, steps_s[at]))

    @cached_property
    def _added_up(self) -> tuple[Floats, Floats]:
        """The seconds between the instants, and the amount that has come down by each instant."""
        steps_s = np.diff(self.time_s)
        parts = steps_s * (self.per_s[1:] + self.per_s[:-1]) / 2
        return steps_s, np.concatenate([[0.0], np.cumsum(parts)])


class PassRates(NamedTuple):
    """Many passes' ``PassRate`` in joined arrays, for batched queries.

    A fleet has thousands of passes, and each of them is queried only a few times.

    Attributes
    ----------
    time_s, per_s
        As in ``PassRate``, one pass after another. Shape ``(n,)``.
    first
        Index at which each pass begins, and ``n``. Shape ``(num_passes + 1,)``.
    whole
        How much has come down in the pass by each instant. Shape ``(n,)``.
    """

    time_s: Floats
    per_s: Floats
    first: Longs
    whole: Floats

    @classmethod
    def joined(cls, rates: Sequence[PassRate]) -> PassRates:
        """Return these passes, joined in order."""
        first = np.cumsum([0, *(len(rate.time_s) for rate in rates)])
        time_s = np.concatenate([np.empty(0), *(rate.time_s for rate in rates)])
        return cls.of(time_s, np.concatenate([np.empty(0), *(r.per_s for r in rates)]), first)

    @classmethod
    def of(cls, time_s: Floats, per_s: Floats, first: Longs) -> PassRates:
        """Return the passes with these rates."""
        return cls(time_s, per_s, first, _added_up(time_s, per_s, first))

    def each(self) -> list[PassRate]:
        """Return the passes one by one."""
        return [
            PassRate(time_s=self.time_s[begin:end], per_s=self.per_s[begin:end])
            for begin, end in itertools.pairwise(self.first.tolist())
        ]

    def until(self, which: Longs, t_s: Floats) -> Floats:
        """Return how much comes down in each of these passes until an instant of its own."""
        return _until(self.time_s, self.per_s, self.first, self.whole, which, t_s)

    def when(self, which: Longs, amount: Floats) -> Floats:
        """Return when an amount of its own has come down in each of these passes."""
        return _when(self.time_s, self.per_s, self.first, self.whole, which, amount)


@kernel
def _added_up(time_s: Floats, per_s: Floats, first: Longs) -> Floats:
    whole = np.zeros(len(time_s))
    for one in range(len(first) - 1):
        for k in range(first[one] + 1, first[one + 1]):
            step_s = time_s[k] - time_s[k - 1]
            whole[k] = whole[k - 1] + step_s * (per_s[k] + per_s[k - 1]) / 2
    return whole


@kernel
def _until(
    time_s: Floats, per_s: Floats, first: Longs, whole: Floats, which: Longs, t_s: Floats
) -> Floats:
    found = np.empty(len(which))
    for i in range(len(which)):
        begin, end = first[which[i]], first[which[i] + 1]
        at = begin + np.searchsorted(time_s[begin:end], t_s[i], side="right") - 1
        at = min(max(at, begin), end - 2)
        step_s = time_s[at + 1] - time_s[at]
        into_s = min(max(t_s[i] - time_s[at], 0.0), step_s)
        slope = (per_s[at + 1] - per_s[at]) / step_s
        found[i] = whole[at] + into_s * (per_s[at] + slope * into_s / 2.0)
    return found


@kernel
def _when(
    time_s: Floats, per_s: Floats, first: Longs, whole: Floats, which: Longs, amount: Floats
) -> Floats:
    found = np.empty(len(which))
    for i in range(len(which)):
        begin, end = first[which[i]], first[which[i] + 1]
        at = begin + np.searchsorted(whole[begin:end], amount[i]) - 1
        at = min(max(at, begin), end - 2)
        step_s = time_s[at + 1] - time_s[at]
        rise = (per_s[at + 1] - per_s[at]) / step_s
        missing = max(amount[i] - whole[at], 0.0)
        until = per_s[at] + np.sqrt(max(per_s[at] ** 2 + 2.0 * rise * missing, 0.0))
        into_s = 2.0 * missing / until if until > 0.0 else 0.0
        found[i] = time_s[at] + min(into_s, step_s)
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationLinks:
    """How each station affects a downlink. Shape ``(num_stations,)``.

    Attributes
    ----------
    gain
        Factor on the satellite's rate.
    setup_s
        Time at the beginning of each contact in which nothing comes down.
    """

    gain: Floats
    setup_s: Floats

    @classmethod
    def plain(cls, num_stations: int) -> StationLinks:
        """Return stations that change no rate and need no setup."""
        return cls(gain=np.ones(num_stations), setup_s=np.zeros(num_stations))


@dataclass(frozen=True, kw_only=True, eq=False)
class Downlinks:
    """How fast the contacts of a scenario take data down.

    Attributes
    ----------
    stations
        Gain and setup.
    passes
        By access number, the rate of each access whose rate follows the elevation, gain included.
        For all others the satellite's own rate holds, times the station's gain.
    """

    stations: StationLinks
    passes: Mapping[int, PassRate] = field(default_factory=dict)

    def volumes(
        self, rate_per_s: float, access: Ints, station: Ints, start_s: Floats, end_s: Floats
    ) -> Floats:
        """Return how much each contact of a satellite takes down, in recorder capacities.

        Parameters
        ----------
        rate_per_s
            The satellite's own rate, which holds if the rate does not follow the elevation.
        access, station, start_s, end_s
            Of its contacts. Shape ``(n,)`` each.
        """
        setup_s = self.stations.setup_s[station]
        useful_s = np.maximum(end_s - start_s - setup_s, 0.0)
        volume = useful_s * (rate_per_s * self.stations.gain[station])
        which = self.which(access)
        of = np.flatnonzero(which >= 0)
        ready_s = np.minimum(start_s[of] + setup_s[of], end_s[of])
        until_end, until_ready = (self.rates.until(which[of], t_s) for t_s in (end_s[of], ready_s))
        volume[of] = until_end - until_ready
        return np.asarray(volume)

    def which(self, access: Ints) -> Longs:
        """Return each access's index in ``rates``; -1 if the satellite's own rate holds."""
        if not self.passes:
            return np.full(len(access), -1)
        at = np.minimum(np.searchsorted(self._numbers, access), len(self._numbers) - 1)
        return np.where(self._numbers[at] == access, at, -1)

    @cached_property
    def rates(self) -> PassRates:
        """All passes, in order of their access numbers."""
        return PassRates.joined([self.passes[number] for number in self._numbers.tolist()])

    @cached_property
    def fastest_per_s(self) -> Floats:
        """The highest rate of each pass. Shape ``(num_passes,)``."""
        return np.asarray(np.maximum.reduceat(self.rates.per_s, self.rates.first[:-1]))

    @cached_property
    def _numbers(self) -> Longs:
        return np.array(sorted(self.passes), dtype=np.int64)
