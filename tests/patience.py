"""How long tests wait for an event that must occur.

Waiting polls the condition and ends as soon as it holds. So the limit costs time only if something
is broken; it is far beyond what anything takes on a busy machine.
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
        The failure message, or a function that returns it.
    """
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, what() if callable(what) else what
        time.sleep(0.05)


def wait_for_the_end_of(pid: int) -> None:
    """Return when the process no longer exists; one that has ended may be reaped late."""
    wait_until(lambda: not psutil.pid_exists(pid), f"process {pid} has not ended")
