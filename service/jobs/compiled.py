"""Whether the planning kernels are compiled, found out without importing any."""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Literal

from planner_core.kernel_folder import kernel_folder
from planner_core.sources import PACKAGE, fingerprint

Name = Literal["all", "demonstration"]


def is_ready(name: Name) -> bool:
    """Return whether they were compiled from exactly the present sources."""
    return _noted(name)[1:] == [_sources()]


def stamps(name: Name) -> str | None:
    """Return the stamps noted when the kernels were last compiled; None if there are none."""
    noted = _noted(name)
    return noted[0] if noted else None


def note(name: Name, stamps: str) -> None:
    """Note that they are compiled now.

    Parameters
    ----------
    stamps
        Everything that decides what is compiled (``planner_core.jit.all_stamps``).
    """
    with suppress(OSError):  # not writable: the next process checks again
        kernel_folder().mkdir(parents=True, exist_ok=True)
        _marker(name).write_text(f"{stamps}\n{_sources()}\n")


def _noted(name: Name) -> list[str]:
    try:
        return _marker(name).read_text().split()
    except OSError:
        return []


def _marker(name: Name) -> Path:
    return kernel_folder() / f"{name}.ready"


@cache
def _sources() -> str:
    return fingerprint(PACKAGE, PACKAGE.rglob("*.py"))
