"""The kernels compiled after the warm-up: all of them, each for one signature."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from service.jobs import warm
from tests.docker.install.conftest import Demonstrated, run

_ASK = """
import importlib, json, pkgutil
import planner_core
for module in pkgutil.walk_packages(planner_core.__path__, "planner_core."):
    importlib.import_module(module.name)
from planner_core.jit import stored_signatures
print(json.dumps(stored_signatures()))
"""


def stored(python: Path) -> dict[str, list[str]]:
    """Return the compiled signatures of each kernel of an installation, by its name."""
    found: dict[str, list[str]] = json.loads(run(python, "-c", _ASK, cwd=python.parent))
    return found


@pytest.fixture(scope="module")
def whole(prefix: Path) -> dict[str, list[str]]:
    """The kernels of the image: its build lets the warm-up compile all that are missing."""
    return stored(prefix / "bin" / "python")


def test_every_kernel_is_compiled_by_the_warm_up(whole: dict[str, list[str]]) -> None:
    assert [name for name, kinds in whole.items() if not kinds] == []


def test_no_kernel_is_compiled_twice(whole: dict[str, list[str]]) -> None:
    assert len(whole) > 100
    assert {name: kinds for name, kinds in whole.items() if len(kinds) > 1} == {}


def test_the_demonstration_compiles_nothing_in_its_searches(
    demonstrated: Demonstrated, whole: dict[str, list[str]]
) -> None:
    kernels = demonstrated.user.kernels
    compiled_at = (kernels / "demonstration.ready").stat().st_mtime_ns
    files = [path for path in kernels.rglob("*") if path.is_file()]
    assert len(files) > 100
    assert [path for path in files if path.stat().st_mtime_ns > compiled_at] == []
    num_first = sum(map(bool, stored(demonstrated.user.folder / "venv/bin/python").values()))
    assert num_first / len(whole) == pytest.approx(warm.DEMONSTRATED, abs=0.1)
