"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests of the service together that start servers and workers of their own.

    Where tests run in several processes (``--dist loadgroup``), one takes each of these groups.
    """
    service = _ROOT / "tests" / "service"
    for item in items:
        if service in item.path.parents:
            part = item.path.relative_to(service).parts[0]
            item.add_marker(pytest.mark.xdist_group("jobs" if part == "jobs" else "service"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real reference data, or skip where it is absent."""
    place = Path(os.environ.get("SLEWLINE_TEST_DATA", _ROOT.parent / "shared" / "data"))
    if not place.is_dir():
        pytest.skip("the shared reference data is not on this machine")
    return place
