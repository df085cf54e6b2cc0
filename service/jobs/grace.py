"""How long a solver process may go on after its time is up."""

from __future__ import annotations

import time
from typing import Final

import psutil

GRACE_CPU_S: Final = {"access": 120.0, "compile": 120.0, "solve": 30.0, "verify": 60.0}
"""CPU seconds that the rest of each phase may take.

Measured for 20 satellites and 2,000 targets over one day: access 8, from the time limit to the end
of the search 4, verdict and reasons 8. A process that gets a tenth of a core takes ten times as
long by the clock, and its plan is worth the wait.
"""
STALL_S: Final = 30.0
"""Clock time; a process that uses no CPU time for this long hangs."""

_STILL_S: Final = 0.02  # CPU seconds; even a hundredth of a core uses more within STALL_S


class Grace:
    """What a process may still spend, in CPU seconds since others may keep the machine busy."""

    def __init__(self, pid: int, phase: str) -> None:
        self._process = psutil.Process(pid)
        self._began_cpu_s = self._moved_cpu_s = self._cpu_s()
        self._moved_s = time.monotonic()
        self._most_cpu_s = GRACE_CPU_S[phase]

    def is_over(self) -> bool:
        """Return whether it has used up its grace or hangs; False if it has ended."""
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
