"""What is compiled once the warm-up is through: every kernel, each for one signature."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from service.jobs import warm

_ASK = """
import importlib, json, pkgutil
import planner_core
for module in pkgutil.walk_packages(planner_core.__path__, "planner_core."):
    importlib.import_module(module.name)
from planner_core.jit import stored_signatures
print(json.dumps(stored_signatures()))
"""


_COMPILE_FIRST = """
from service.jobs import warm
warm.make_ready(warm.DEMONSTRATION)
"""


def _run(*arguments: str, folder: Path) -> str:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, check=True, stdout=subprocess.PIPE, text=True
    ).stdout


@dataclass(frozen=True, slots=True)
class Compiled:
    """What is on disk after each step, by kernel, and what the last one said."""

    first: dict[str, list[str]]
    demonstrated: dict[str, list[str]]
    whole: dict[str, list[str]]
    said: str


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    folder = tmp_path_factory.mktemp("kernels")

    def stored() -> dict[str, list[str]]:
        found: dict[str, list[str]] = json.loads(_run("-c", _ASK, folder=folder))
        return found

    _run("-c", _COMPILE_FIRST, folder=folder)
    first = stored()
    _run("-m", "service", "demo", "--out", str(tmp_path_factory.mktemp("demo")), folder=folder)
    demonstrated = stored()
    said = _run("-m", "service.jobs.warm", folder=folder)
    return Compiled(first=first, demonstrated=demonstrated, whole=stored(), said=said)


@pytest.mark.full_size
def test_the_demonstration_compiles_nothing_in_its_searches(compiled: Compiled) -> None:
    assert compiled.demonstrated == compiled.first
    num_first, num_all = (sum(map(bool, k.values())) for k in (compiled.first, compiled.whole))
    assert num_first / num_all == pytest.approx(warm.DEMONSTRATED, abs=0.1)


@pytest.mark.full_size
def test_every_kernel_is_compiled_by_the_warm_up(compiled: Compiled) -> None:
    assert "Compiling" in compiled.said
    assert [name for name, kinds in compiled.whole.items() if not kinds] == []


@pytest.mark.full_size
def test_no_kernel_is_compiled_twice(compiled: Compiled) -> None:
    assert len(compiled.whole) > 100
    assert {name: kinds for name, kinds in compiled.whole.items() if len(kinds) > 1} == {}
