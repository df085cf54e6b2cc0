"""How likely the sky over each target is clear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planner_core.domain.checks import require


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SkySeries:
    """Probabilities of a clear sky over some targets at the same instants; linear between them.

    Attributes
    ----------
    target
        Indices into the scenario's targets, each once. Shape ``(m,)``.
    time_s
        Seconds from the horizon's start, ascending. Shape ``(k,)``.
    clear_probability
        From 0 to 1. Shape ``(m, k)``.
    """

    target: npt.NDArray[np.int64]
    time_s: npt.NDArray[np.float64]
    clear_probability: npt.NDArray[np.float64]

    def __post_init__(self) -> None:
        require(len(self.time_s) > 0, "times", "at least one is needed")
        require(bool(np.all(np.diff(self.time_s) > 0.0)), "times", "must ascend")
        shape = (len(self.target), len(self.time_s))
        require(
            self.clear_probability.shape == shape,
            "clear_probability",
            "needs one value for each of times",
        )
        inside = (self.clear_probability >= 0.0) & (self.clear_probability <= 1.0)
        require(bool(np.all(inside)), "clear_probability", "must be between 0 and 1")
        for values in (self.target, self.time_s, self.clear_probability):
            values.flags.writeable = False

    def __eq__(self, other: object) -> bool:
        """Return whether both hold the same values."""
        return isinstance(other, SkySeries) and (
            np.array_equal(self.target, other.target)
            and np.array_equal(self.time_s, other.time_s)
            and np.array_equal(self.clear_probability, other.clear_probability)
        )

    __hash__ = None  # type: ignore[assignment]  # equal by what arrays hold


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """Probabilities of a clear sky over the targets of a scenario.

    Attributes
    ----------
    series
        No target is in two of them.
    default_clear_probability
        For targets and instants that no series covers. None if there are none.
    """

    series: tuple[SkySeries, ...] = ()
    default_clear_probability: float | None = None

    def __post_init__(self) -> None:
        default = self.default_clear_probability
        require(
            default is None or 0.0 <= default <= 1.0,
            "default_clear_probability",
            "must be between 0 and 1",
        )
        named = np.concatenate([np.empty(0, dtype=np.int64), *(s.target for s in self.series)])
        require(len(np.unique(named)) == len(named), "series", "a target is in two of them")

    def coverage_s(self, num_targets: int) -> npt.NDArray[np.float64]:
        """Return the first and the last instant of each target's series.

        Returns
        -------
        Shape ``(num_targets, 2)``; infinity and its negative for targets without a series.
        """
        covered_s = np.tile([np.inf, -np.inf], (num_targets, 1))
        for one in self.series:
            covered_s[one.target] = one.time_s[0], one.time_s[-1]
        return covered_s
