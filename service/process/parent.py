"""A process's name, its memory, and its end when its parent ends."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from typing import Final

import psutil

_PR_SET_PDEATHSIG: Final = 1
_PR_SET_NAME: Final = 15


def die_with_parent(number: signal.Signals) -> None:
    """Request this signal for when the parent ends, or at once if it has; only on Linux."""
    if sys.platform != "linux":
        return
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
    if os.getppid() != parent:
        os.kill(os.getpid(), number)


def held_mb(pid: int | None) -> float:
    """Return the resident memory of a process; 0 if it has ended."""
    try:
        return float(psutil.Process(pid).memory_info().rss) / 1e6
    except psutil.NoSuchProcess:
        return 0.0


def name_this_process(name: str) -> None:
    """Set the name shown by ``ps -o comm`` and ``top``, at most 15 bytes; only on Linux.

    A forked process keeps the command line of the process it was forked from.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())
