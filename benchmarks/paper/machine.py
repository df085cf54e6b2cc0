"""A description of the study's machine, without its name or paths."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path

import planner_core

_PACKAGES = ("numpy", "numba", "highspy", "sgp4")


def description() -> str:
    """Return processor, cores, system and versions in one sentence."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in _PACKAGES)
    return (
        f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}; "
        f"Python {platform.python_version()}, {versions}, Slewline {planner_core.__version__}"
    )


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
