"""How long a solver process may go on once its time is over."""

from __future__ import annotations

import time
from typing import Final

import psutil

GRACE_CPU_S: Final = {"access": 120.0, "compile": 120.0, "solve": 30.0, "verify": 60.0}
"""CPU seconds that what is left of each phase may take.

Of 20 satellites and 2,000 targets, a day: access 8, from the limit to the end of the search 4,
verdict and reasons 8. A process that gets a tenth of a core takes ten times as long by the clock,
and its plan is worth the wait.
"""
STALL_S: Final = 30.0
"""By the clock; a process that computes nothing for as long hangs."""

_STILL_S: Final = 0.02  # CPU seconds; a hundredth of a core would be more than that in STALL_S


class Grace:
    """What a process may spend from now on, in CPU seconds: others may keep the machine busy."""

    def __init__(self, pid: int, phase: str) -> None:
        self._process = psutil.Process(pid)
        self._began_cpu_s = self._moved_cpu_s = self._cpu_s()
        self._moved_s = time.monotonic()
        self._most_cpu_s = GRACE_CPU_S[phase]

    def is_over(self) -> bool:
        """Return whether it has spent its grace, or does nothing; not so where it has ended."""
        try:
            cpu_s, now_s = self._cpu_s(), time.monotonic()
        except psutil.NoSuchProcess:
            return False
        if cpu_s > self._moved_cpu_s + _STILL_S:
            self._moved_cpu_s, self._moved_s = cpu_s, now_s
        return cpu_s - self._began_cpu_s > self._most_cpu_s or now_s - self._moved_s > STALL_S

    def _cpu_s(self) -> float:
        used = self._process.cpu_times()
        return float(used.user + used.system)
