"""Fixtures of all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real data beside the repository; its tests skip where it is absent."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("SLEWLINE_TEST_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"no shared data at {folder} (SLEWLINE_TEST_DATA names another place)")
    return folder
