"""What is compiled once the warm-up is through: every kernel, each for one signature."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

_ASK = """
import importlib, json, pkgutil
import planner_core
for module in pkgutil.walk_packages(planner_core.__path__, "planner_core."):
    importlib.import_module(module.name)
from planner_core.jit import stored_signatures
print(json.dumps(stored_signatures()))
"""


def _run(*arguments: str, folder: Path) -> str:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, check=True, stdout=subprocess.PIPE, text=True
    ).stdout


@pytest.fixture(scope="module")
def said_and_signatures(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[str, dict[str, list[str]]]:
    folder = tmp_path_factory.mktemp("kernels")
    said = _run("-m", "service.jobs.warm", folder=folder)
    return said, json.loads(_run("-c", _ASK, folder=folder))


@pytest.mark.full_size
def test_every_kernel_is_compiled_by_the_warm_up(
    said_and_signatures: tuple[str, dict[str, list[str]]],
) -> None:
    said, signatures = said_and_signatures
    assert "Compiling" in said
    assert [name for name, kinds in signatures.items() if not kinds] == []


@pytest.mark.full_size
def test_no_kernel_is_compiled_twice(
    said_and_signatures: tuple[str, dict[str, list[str]]],
) -> None:
    _, signatures = said_and_signatures
    assert len(signatures) > 100
    assert {name: kinds for name, kinds in signatures.items() if len(kinds) > 1} == {}
