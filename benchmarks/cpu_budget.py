"""A budget in CPU seconds, so that a limit means the same on a busy machine."""

from __future__ import annotations

import math
import time

from planner_core.budget import Budget

_PACE_FROM_S = 0.05  # CPU seconds; before that the pace is a guess


class CpuBudget(Budget):
    """A budget that ends after CPU seconds of this process, or at a wall-clock time.

    Parameters
    ----------
    cpu_s
        CPU seconds from now, infinite for no limit.
    deadline
        When to stop in any case, as ``time.time`` gives it.
    """

    def __init__(self, cpu_s: float, deadline: float):
        super().__init__(max(0.0, deadline - time.time()))
        self._cpu_s = cpu_s
        self._began_s, self._began_cpu_s = time.monotonic(), time.process_time()

    def is_spent(self) -> bool:
        """Return whether the CPU seconds or the time are used up."""
        return super().is_spent() or self._used_s() >= self._cpu_s

    def remaining_s(self) -> float:
        """Return how long the remaining CPU seconds last at the pace so far."""
        used_s = self._used_s()
        passed_s = time.monotonic() - self._began_s
        pace = max(1.0, passed_s / used_s) if used_s > _PACE_FROM_S else 1.0
        clock_s = super().remaining_s()
        return min(math.inf if clock_s is None else clock_s, max(0.0, self._cpu_s - used_s) * pace)

    def _used_s(self) -> float:
        return time.process_time() - self._began_cpu_s
