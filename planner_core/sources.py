"""Fingerprints of the core's own sources, so that results stored by other code are recomputed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Final

PACKAGE: Final = Path(__file__).parent

_WHAT_MAKES_OPPORTUNITIES: Final = ("domain", "access", "data", "orbits", "problem")


def fingerprint(package: Path, paths: Iterable[Path]) -> str:
    """Return a hash of files and of their paths in the package."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def opportunity_sources(package: Path = PACKAGE) -> tuple[Path, ...]:
    """Return the files on which a scenario's opportunities and their stored form depend."""
    found: list[Path] = []
    for name in _WHAT_MAKES_OPPORTUNITIES:
        path = package / name
        found += [path] if path.is_file() else [*path.rglob("*.py"), *path.rglob("*.csv")]
    return tuple(found)


@cache
def opportunity_version() -> str:
    """Return a version that changes whenever opportunities or their stored form may change."""
    return fingerprint(PACKAGE, opportunity_sources())
