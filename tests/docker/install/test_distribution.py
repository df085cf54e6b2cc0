"""What a user of pip gets: sdist and wheel, an empty environment, ``slewline demo``.

Not among the ordinary tests: it takes minutes and the package index. ``.ci/run`` runs it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from planner_core.solvers.registry import SOLVERS

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = {"migrations", "planner_core", "service", "slewline"}


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command that sees nothing of this tree but what it is told."""
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    environment["XDG_DATA_HOME"] = str(cwd / "data")
    done = subprocess.run(
        command, cwd=cwd, env=environment, stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sdist, and the wheel that is built from it."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, cwd=ROOT)
    return folder


@pytest.fixture(scope="module")
def python(dist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with nothing but the wheel and what it asks for."""
    folder = tmp_path_factory.mktemp("user")
    run(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    (wheel,) = dist.glob("*.whl")
    python = folder / "venv" / "bin" / "python"
    run(python, "-m", "pip", "-qq", "--disable-pip-version-check", "install", wheel, cwd=folder)
    return python


def test_both_hold_every_package_and_its_data_and_no_tests(dist: Path) -> None:
    (sdist,) = dist.glob("*.tar.gz")
    (wheel,) = dist.glob("*.whl")
    with tarfile.open(sdist) as archive:
        in_sdist = {name.partition("/")[2] for name in archive.getnames()}
    in_wheel = set(zipfile.ZipFile(wheel).namelist())
    ours = {name for name in in_wheel if ".dist-info/" not in name}
    assert {name.partition("/")[0] for name in ours} == PACKAGES
    assert ours <= in_sdist
    tracked = run("git", "ls-files", "-z", *sorted(PACKAGES), cwd=ROOT).split("\0")
    needed = {name for name in tracked if name and not name.endswith("README.md")}
    assert needed - {"planner_core/data/make_eop.py"} <= ours


def test_the_client_and_the_core_are_imported_by_the_products_name(python: Path) -> None:
    said = run(
        python, "-c",
        "import slewline, sys; print('numpy' in sys.modules, slewline.Client('http://h'));"
        "from slewline import core; print(core.plan_scenario.__name__)",
        cwd=python.parent,
    )  # fmt: skip
    assert said.splitlines() == ["False Client('http://h')", "plan_scenario"]


def test_the_demo_runs_and_runs_again_with_nothing_left_to_compile(
    python: Path, tmp_path: Path
) -> None:
    first, again = (run(python.parent / "slewline", "demo", cwd=tmp_path) for _ in range(2))
    for said in (first, again):
        valid = {line.split()[0] for line in said.splitlines() if line.endswith(" valid")}
        assert valid == set(SOLVERS)
    assert "Compiling" in first
    assert "Compiling" not in again
    assert {path.name for path in (tmp_path / "demo-output").glob("timeline-*")} == {
        f"timeline-{solver}.json" for solver in SOLVERS
    }
