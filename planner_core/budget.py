"""How much time a job may spend, how it reports progress, and why it ends."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from planner_core.errors import Cancelled

Bytes = npt.NDArray[np.uint8]

_LOOK_S: Final = 0.05
"""How often the clock is read on behalf of kernels."""


class Termination(StrEnum):
    """Why a search ended."""

    OPTIMAL = "optimal"
    GAP_REACHED = "gap_reached"
    TIME_LIMIT = "time_limit"
    ITERATION_LIMIT = "iteration_limit"
    HORIZON_COMPLETE = "horizon_complete"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far the work has got. ``fraction`` is that of the phase, 0 to 1."""

    phase: Literal["access", "compile", "solve", "verify"]
    fraction: float
    reward: float | None = None
    bound: float | None = None
    message: str = ""


def ignored(_: Progress) -> None:
    """Ignore a progress report."""


class Budget:
    """The time left for one job, and whether it is cancelled; the only clock in the core.

    Parameters
    ----------
    time_s
        Seconds from now, or None for no limit.
    report
        Called with each progress report.
    num_threads
        How many threads may work at a time. Results do not depend on it, except for how far a
        search gets before its time is over.

    Attributes
    ----------
    stop
        One byte that kernels read inside long loops; if not 0, they stop at once. ``cancel`` sets
        it, from any thread. Shape ``(1,)``.
    """

    def __init__(
        self,
        time_s: float | None = None,
        report: Callable[[Progress], None] = ignored,
        num_threads: int = 1,
    ):
        self.stop: Bytes = np.zeros(1, dtype=np.uint8)
        self._cancelled: Bytes = np.zeros(1, dtype=np.uint8)
        self.report = report
        self.num_threads = num_threads
        self._deadline = None if time_s is None else time.monotonic() + time_s

    def part(self, share: float = 1.0, report: Callable[[Progress], None] | None = None) -> Budget:
        """Return a budget for a part of the work, which ends with the whole or before it.

        It has the same number of threads, and is cancelled with the whole.

        Parameters
        ----------
        share
            The share of the time now left, 0 to 1.
        report
            Called with the part's progress; by default the same as for the whole.
        """
        return _Part(self, share, report or self.report)

    def until_cancelled(self) -> Budget:
        """Return a budget for work that is useful only if complete: the time does not end it."""
        return _Whole(self)

    def proceed(self, progress: Progress) -> None:
        """Report the progress of work that is useful only if complete, unless it has to stop.

        Raises
        ------
        Cancelled
            The budget is spent.
        """
        if self.is_spent():
            raise Cancelled
        self.report(progress)

    def cancel(self) -> None:
        """Ask the work to stop; safe to call from another thread."""
        self._cancelled[0] = 1
        self.stop[0] = 1

    def expire(self) -> None:
        """Stop kernels because the time is over; they cannot read a clock themselves."""
        self._deadline = time.monotonic()
        self.stop[0] = 1

    @contextmanager
    def enforced(self) -> Iterator[None]:
        """Call ``expire`` once the time of the whole is over, so that kernels stop as well."""
        if self._deadline is None:
            yield
            return
        has_ended = threading.Event()

        def watch() -> None:
            while not has_ended.wait(_LOOK_S):
                if self.is_spent() and not self.is_cancelled:
                    self.expire()
                    return

        watching = threading.Thread(target=watch, name="budget", daemon=True)
        watching.start()
        try:
            yield
        finally:
            has_ended.set()
            watching.join()

    @property
    def is_cancelled(self) -> bool:
        """Whether someone asked the work to stop."""
        return bool(self._cancelled[0])

    def is_spent(self) -> bool:
        """Return whether the work should stop now and return the best it has."""
        return bool(self.stop[0]) or (
            self._deadline is not None and time.monotonic() >= self._deadline
        )

    def remaining_s(self) -> float | None:
        """Return the seconds left, or None if there is no limit."""
        return None if self._deadline is None else max(0.0, self._deadline - time.monotonic())

    def termination(self) -> Termination:
        """Return why a spent budget ended the search."""
        return Termination.CANCELLED if self.is_cancelled else Termination.TIME_LIMIT

    def ending(self, *, is_optimal: bool, is_close: bool) -> Termination:
        """Return why a search for plan and bound has ended: due to its result, or the budget."""
        if is_optimal:
            return Termination.OPTIMAL
        if is_close:
            return Termination.GAP_REACHED
        return self.termination() if self.is_spent() else Termination.HORIZON_COMPLETE


class _Part(Budget):
    """The budget of a part of the work, which ends no later than the whole and uses its clock."""

    def __init__(self, whole: Budget, share: float, report: Callable[[Progress], None]) -> None:
        super().__init__(None, report, whole.num_threads)
        self.stop = whole.stop
        self._cancelled = whole._cancelled
        self._whole = whole
        left_s = whole.remaining_s()
        # What the whole has left after this part.
        self._reserve_s = 0.0 if left_s is None else (1.0 - share) * left_s

    def cancel(self) -> None:
        self._whole.cancel()

    def expire(self) -> None:
        self._whole.expire()

    def is_spent(self) -> bool:
        return self._whole.is_spent() or (self._reserve_s > 0.0 and self.remaining_s() == 0.0)

    def remaining_s(self) -> float | None:
        left_s = self._whole.remaining_s()
        return None if left_s is None else max(0.0, left_s - self._reserve_s)


class _Whole(Budget):
    """The budget of work without which there is no plan: it only ends if somebody cancels."""

    def __init__(self, whole: Budget) -> None:
        super().__init__(None, whole.report, whole.num_threads)
        self._cancelled = self.stop = whole._cancelled
        self._whole = whole

    def cancel(self) -> None:
        self._whole.cancel()

    def expire(self) -> None:
        self._whole.expire()
