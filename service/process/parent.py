"""A process's name, what it holds, and its end with its parent's."""

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
    """Ask for this signal when the parent ends, at once if it has; only Linux can do it."""
    if sys.platform != "linux":
        return
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
    if os.getppid() != parent:
        os.kill(os.getpid(), number)


def held_mb(pid: int | None) -> float:
    """Return the memory that a process holds; 0 where it has ended."""
    try:
        return float(psutil.Process(pid).memory_info().rss) / 1e6
    except psutil.NoSuchProcess:
        return 0.0


def name_this_process(name: str) -> None:
    """Set the name that ``ps -o comm`` and ``top`` show, of at most 15 bytes; only on Linux.

    A forked process has the command line of the one that it was forked from.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())
