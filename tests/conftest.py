"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.examples import load_profile

_ROOT = Path(__file__).resolve().parents[1]

# Before any test module is read: their counts of examples follow from it.
load_profile()


# What shares a service is done by one process.
_SHARED = {
    "tests/service/jobs/test_diff.py": "mission",
    "tests/service/jobs/test_explanation.py": "mission",
    "tests/service/jobs/test_fleet.py": "mission",
    "tests/service/jobs/test_what_if.py": "mission",
    "tests/service/client/test_answers.py": "client",
    "tests/service/client/test_plan_command.py": "client",
    "tests/service/client/test_resources.py": "client",
}

# What takes longest begins first, so that nobody waits for it in the end.
_LONG = (
    "tests/service/jobs/test_worker.py",
    "tests/service/test_mission.py",
    "tests/service/test_schemathesis.py",
    "tests/service/test_readme.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep each module together, as its tests share servers and problems, the long ones first.

    Where tests run in several processes (``--dist loadgroup``), one takes each of these groups,
    in this order.
    """
    for item in items:
        module = _module(item)
        item.add_marker(pytest.mark.xdist_group(_SHARED.get(module, module)))
    items.sort(key=lambda item: _module(item) not in _LONG)


def _module(item: pytest.Item) -> str:
    return item.path.relative_to(_ROOT).as_posix()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real reference data, or skip where it is absent."""
    place = Path(os.environ.get("SLEWLINE_TEST_DATA", _ROOT.parent / "shared" / "data"))
    if not place.is_dir():
        pytest.skip("the shared reference data is not on this machine")
    return place
