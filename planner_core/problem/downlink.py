"""What contacts take down: a rate over time for the referee, one number each for solvers.

Where the rate follows the elevation it is known at instants of each pass, and linear between them.
Both the referee and the solvers count with that same rate; each adds it up in its own way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.integer]


@dataclass(frozen=True, kw_only=True, eq=False)
class PassRate:
    """How fast data comes down during one access to a station, setup aside.

    Attributes
    ----------
    time_s
        Instants from the first to the last of the access, ascending. Shape ``(k,)``.
    per_s
        Rates there, in recorder capacities per second; linear between. Shape ``(k,)``.
    """

    time_s: Floats
    per_s: Floats

    def until(self, t_s: Floats) -> Floats:
        """Return what comes down from the first instant until each of these.

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
        # The quadratic's root in the form that holds where the rate stays the same, too.
        until = first + np.sqrt(np.maximum(first**2 + 2.0 * rise * missing, 0.0))
        into_s = np.divide(2.0 * missing, until, out=np.zeros_like(missing), where=until > 0.0)
        return np.asarray(self.time_s[at] + np.minimum(into_s, steps_s[at]))

    @cached_property
    def _added_up(self) -> tuple[Floats, Floats]:
        """Return the seconds between the instants, and what has come down at each instant."""
        steps_s = np.diff(self.time_s)
        parts = steps_s * (self.per_s[1:] + self.per_s[:-1]) / 2
        return steps_s, np.concatenate([[0.0], np.cumsum(parts)])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationLinks:
    """What each station does to a downlink. Shape ``(num_stations,)``.

    Attributes
    ----------
    gain
        Factor on the satellite's rate.
    setup_s
        At the beginning of each contact, in which nothing comes down.
    """

    gain: Floats
    setup_s: Floats

    @classmethod
    def plain(cls, num_stations: int) -> StationLinks:
        """Return stations that change no rate and need no setup."""
        return cls(gain=np.ones(num_stations), setup_s=np.zeros(num_stations))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Downlinks:
    """How fast the contacts of a scenario take data down.

    Attributes
    ----------
    stations
        Gain and setup.
    passes
        The rate over each access where it follows the elevation, gain included, by the access's
        number. Elsewhere the satellite's own rate holds, times the station's gain.
    """

    stations: StationLinks
    passes: Mapping[int, PassRate] = field(default_factory=dict)

    def volumes(
        self, rate_per_s: float, access: Ints, station: Ints, start_s: Floats, end_s: Floats
    ) -> Floats:
        """Return what each contact of a satellite takes down, in recorder capacities.

        Parameters
        ----------
        rate_per_s
            Of the satellite, where no elevation counts.
        access, station, start_s, end_s
            Of its contacts. Shape ``(n,)`` each.
        """
        setup_s = self.stations.setup_s[station]
        useful_s = np.maximum(end_s - start_s - setup_s, 0.0)
        volume = useful_s * (rate_per_s * self.stations.gain[station])
        for row in np.flatnonzero([int(number) in self.passes for number in access]):
            rate = self.passes[int(access[row])]
            span_s = np.array([min(start_s[row] + setup_s[row], end_s[row]), end_s[row]])
            volume[row] = float(np.diff(rate.until(span_s))[0])
        return np.asarray(volume)
