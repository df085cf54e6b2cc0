"""How long tests wait for what must come.

Whoever waits asks again and again, and goes on at once when it has come. So this costs time
only where something is broken, and is far beyond what anything takes on a busy machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

import psutil

PATIENCE_S: Final = 300.0


def wait_until(condition: Callable[[], object], what: object = "it never happened") -> None:
    """Return when the condition holds.

    Parameters
    ----------
    what
        What is said where it does not; if it can be called, what it returns.
    """
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, what() if callable(what) else what
        time.sleep(0.05)


def wait_for_the_end_of(pid: int) -> None:
    """Return when there is no such process; who has ended may not be collected at once."""
    wait_until(lambda: not psutil.pid_exists(pid), f"process {pid} has not ended")
