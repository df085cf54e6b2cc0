"""Renewing a lease in parallel with the run, so that a hanging database delays nothing else."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Final

from planner_core.budget import Progress
from service.jobs.runner import Order

_PATIENCE_S: Final = 0.25


class Renewal:
    """Calls ``renew`` in a thread of its own, one call at a time.

    While a renewal is unanswered, the run's limits are still enforced, and a worker told to stop
    still gives up its job.

    Parameters
    ----------
    renew
        Renews the lease with the newest progress (None if there is none) and returns how to
        go on.
    """

    def __init__(self, renew: Callable[[Progress | None], Order]):
        self._renew = renew
        self._thread = ThreadPoolExecutor(1, "renewal")
        self._pending: Future[Order] | None = None
        self._unsent: Progress | None = None

    def tick(self, progress: Progress | None) -> Order:
        """Renew, or look for the answer to the last renewal; go on if there is none yet."""
        self._unsent = progress or self._unsent
        if self._pending is None:
            self._pending = self._thread.submit(self._renew, self._unsent)
            self._unsent = None
        done, _ = wait([self._pending], _PATIENCE_S)
        if not done:
            return Order.GO_ON
        answered, self._pending = self._pending, None
        return answered.result()

    def end(self) -> None:
        """Stop renewing. A renewal still under way does no harm: the run number guards it."""
        self._thread.shutdown(wait=False)
