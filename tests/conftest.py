"""Fixtures for all tests."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

from service.process.imports import importing
from tests.examples import load_profile
from tests.service import prepared

_ROOT = Path(__file__).resolve().parents[1]

# Before any test module is imported: the number of examples depends on it.
load_profile()

# Applications, servers and problems stay alive for a whole module: collecting garbage as often as
# Python does by default costs a tenth of the time of the service's tests.
gc.set_threshold(20_000, 20, 20)

# As in a worker, for this process's children: matrices are small, and OpenBLAS threads spin while
# they wait for the next one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Modules that share a service run in one process.
_TOGETHER = {
    "tests/service/jobs/test_diff.py": "mission",
    "tests/service/jobs/test_explanation.py": "mission",
    "tests/service/jobs/test_fleet.py": "mission",
    "tests/service/jobs/test_what_if.py": "mission",
    "tests/service/client/test_answers.py": "client",
    "tests/service/client/test_plan_command.py": "client",
    "tests/service/client/test_replans.py": "client",
    "tests/service/client/test_resources.py": "client",
}

# The longest modules begin first, so that nothing waits for them at the end: all modules of more
# than 6 s of processor time in the quick profile, by what they use with all programs they start.
# Of modules that share a service one is named. The last one mostly waits.
_LONG = (
    "tests/planner_core/test_certified_delivered.py",
    "tests/service/test_readme.py",
    "tests/service/test_schemathesis.py",
    "tests/service/test_plan_job.py",
    "tests/attack/test_bulkhead.py",
    "tests/service/test_mission.py",
    "tests/service/client/test_resources.py",
    "tests/service/test_server.py",
    "tests/service/jobs/test_worker.py",
    "tests/planner_core/test_latency.py",
    "tests/service/test_nasty_bodies.py",
    "tests/service/jobs/test_what_if.py",
    "tests/reference/test_completeness.py",
    "tests/service/test_openapi.py",
    "tests/planner_core/test_spent_budgets.py",
    "tests/planner_core/test_certified_resources.py",
    "tests/attack/test_slow_peers.py",
    "tests/service/test_stapi.py",
    "tests/planner_core/test_replanning.py",
    "tests/attack/test_connections.py",
    "tests/service/test_generated_client.py",
    "tests/planner_core/test_kernel_cache.py",
    "tests/service/test_compare_spacing.py",
    "tests/planner_core/test_certified.py",
    "tests/service/jobs/test_restore.py",
    "tests/planner_core/test_resource_bound.py",
    "tests/service/test_first_impressions.py",
    "tests/service/webhooks/test_delivery.py",
)

# Tests of these modules share nothing: they are handed out one by one.
_APART = {
    "tests/planner_core/test_certified.py",
    "tests/planner_core/test_certified_delivered.py",
    "tests/planner_core/test_certified_resources.py",
    "tests/planner_core/test_contact_queues.py",
    "tests/planner_core/test_latency.py",
    "tests/planner_core/test_pins.py",
    "tests/planner_core/test_resource_bound.py",
    "tests/planner_core/test_spent_budgets.py",
}


class _ByModule(LoadScopeScheduling):  # type: ignore[misc]  # it has no types
    """A module's tests share servers and problems: one process has them all."""

    def _split_scope(self, nodeid: str) -> str:
        module = nodeid.partition("::")[0]
        if module in _APART:
            return nodeid.partition("[")[0]
        return _TOGETHER.get(module, module)


def pytest_configure(config: pytest.Config) -> None:
    """Start the one process from which all test processes fork their programs."""
    if sys.platform == "linux" and config.getoption("numprocesses", None):
        prepared.share()


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return two for each core: many tests wait for programs they started."""
    return 2 * (os.cpu_count() or 1)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> _ByModule:
    """Hand modules out in the order in which they were found."""
    config.option.loadscopereorder = False
    return _ByModule(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Import the tests and all they need without collecting garbage."""
    with importing():
        return (yield)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the long modules first; given a database server, deselect tests that do not use it."""
    place = {module: number for number, module in enumerate(_LONG)}
    items.sort(key=lambda item: place.get(item.nodeid.partition("::")[0], len(place)))
    if "SLEWLINE_TEST_SERVER_URL" in os.environ:
        elsewhere = [item for item in items if not _asks_the_server(item)]
        items[:] = [item for item in items if _asks_the_server(item)]
        config.hook.pytest_deselected(items=elsewhere)


def _asks_the_server(item: pytest.Item) -> bool:
    """Return whether a test uses a database on the given server, by a fixture or by itself.

    All other tests run the same way without it, and `make test` runs them.
    """
    assert isinstance(item, pytest.Function)
    return "template_url" in item.fixturenames or hasattr(item.module, "SERVER_URL")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real reference data, or skip the test if it is absent."""
    place = Path(os.environ.get("SLEWLINE_TEST_DATA", _ROOT.parent / "shared" / "data"))
    if not place.is_dir():
        pytest.skip("the shared reference data is not on this machine")
    return place
