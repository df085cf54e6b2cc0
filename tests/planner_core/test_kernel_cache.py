"""Compiled kernels are loaded from disk as long as they match the sources, and no longer."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

_STEPS = """
from planner_core.jit import inlined, kernel
from typing import Final
import numpy as np

FACTOR: Final = {factor}
TABLE: Final = np.array([{entry}])

@inlined
def add(a, b):
    return a + {added}

@kernel
def step(x: float) -> float:
    {remark}
    return add(x, FACTOR) * TABLE[0]
"""

_WALK = """
from planner_core.jit import kernel
from steps import step

@kernel
def walk(x: float) -> float:
    return below(x) + step(x)

@kernel
def below(x: float) -> float:
    return x

@kernel
def apart(x: float) -> float:
    return 2.0 * x
"""

_ASK = """
from walk import apart, walk
print(walk(1.0), apart(1.0))
print([sum(each.stats.cache_hits.values()) for each in (walk, apart)])
"""

_AS_IT_IS = {"factor": "2.0", "entry": "3.0", "added": "b", "remark": "# as it is"}


def _run(folder: Path, kernels: Path, **changes: str) -> tuple[list[float], list[int]]:
    """Return the results of ``walk`` and ``apart``, and whether each was loaded from disk."""
    folder.mkdir(exist_ok=True)
    (folder / "steps.py").write_text(_STEPS.format(**_AS_IT_IS | changes))
    (folder / "walk.py").write_text(_WALK)
    said = subprocess.run(
        [sys.executable, "-B", "-c", _ASK],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.getcwd()]),
             "NUMBA_CACHE_DIR": str(kernels)},
        check=True, stdout=subprocess.PIPE, text=True,
    ).stdout.splitlines()  # fmt: skip
    values, hits = said
    return [float(value) for value in values.split()], [int(x) for x in hits[1:-1].split(", ")]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    kernels = tmp_path_factory.mktemp("kernels")
    assert _run(tmp_path_factory.mktemp("sources"), kernels) == ([10.0, 2.0], [0, 0])
    return kernels


def test_kernels_are_found_from_another_folder(compiled: Path, tmp_path: Path) -> None:
    assert _run(tmp_path / "moved", compiled, remark="# said otherwise") == ([10.0, 2.0], [1, 1])


@pytest.mark.parametrize(
    ("change", "value"),
    [({"factor": "4.0"}, 16.0), ({"entry": "5.0"}, 16.0), ({"added": "b + 1.0"}, 13.0)],
)
def test_an_edit_below_compiles_the_callers_and_nothing_else(
    compiled: Path, tmp_path: Path, change: dict[str, str], value: float
) -> None:
    assert _run(tmp_path, compiled, **change) == ([value, 2.0], [0, 1])
    assert _run(tmp_path, compiled, **change) == ([value, 2.0], [1, 1])


_SUM = """
from typing import NamedTuple
import numpy as np
from planner_core.bundles import bundle
from planner_core.jit import kernel

@bundle
class {name}(NamedTuple):
    values: np.ndarray

@kernel
def total(of):
    return of.values.sum()

print(total({name}(np.ones(3))))
"""


def test_what_was_compiled_for_a_class_that_is_gone_is_compiled_anew(tmp_path: Path) -> None:
    for name in ("Table", "Tables"):
        (tmp_path / "sums.py").write_text(_SUM.format(name=name))
        said = subprocess.run(
            [sys.executable, "-B", "-c", "import sums"],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.getcwd()]),
                 "NUMBA_CACHE_DIR": str(tmp_path / "kernels")},
            check=True, stdout=subprocess.PIPE, text=True,
        ).stdout  # fmt: skip
        assert said == "3.0\n"
