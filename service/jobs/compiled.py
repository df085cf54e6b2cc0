"""Whether the planning kernels are compiled, told without importing any."""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Literal

from planner_core.kernel_folder import kernel_folder
from planner_core.sources import PACKAGE, fingerprint

Name = Literal["all", "demonstration"]


def is_ready(name: Name) -> bool:
    """Return whether they were compiled from the sources as they are now, to the letter."""
    return _noted(name)[1:] == [_sources()]


def stamps(name: Name) -> str | None:
    """Return what was noted of the kernels when they were compiled last; None for nothing."""
    noted = _noted(name)
    return noted[0] if noted else None


def note(name: Name, stamps: str) -> None:
    """Note that they are compiled now.

    Parameters
    ----------
    stamps
        What decides all that is compiled (``planner_core.jit.all_stamps``).
    """
    with suppress(OSError):  # nowhere to write: the next one looks again
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
