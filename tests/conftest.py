"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the tests of the service together: they start servers and workers of their own.

    Where tests run in several processes (``--dist loadgroup``), one takes all of these.
    """
    for item in items:
        if _ROOT / "tests" / "service" in item.path.parents:
            item.add_marker(pytest.mark.xdist_group("service"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real reference data, or skip where it is absent."""
    place = Path(os.environ.get("SLEWLINE_TEST_DATA", _ROOT.parent / "shared" / "data"))
    if not place.is_dir():
        pytest.skip("the shared reference data is not on this machine")
    return place
