"""What is installed, once for all tests of this folder, as users and as the image's build do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from planner_core.kernel_folder import kernel_folder

ROOT = Path(__file__).resolve().parents[3]
_KERNEL_FOLDER = "from planner_core.kernel_folder import kernel_folder; print(kernel_folder())"

_LEFT = "planner_core.certified.dp.start_labels"
"""A module whose kernels neither the demonstration nor a kernel of another module needs."""


@dataclass(frozen=True, slots=True)
class Distribution:
    """An sdist, and the wheel that is built from it."""

    sdist: Path
    wheel: Path


@dataclass(frozen=True, slots=True)
class User:
    """An environment with nothing but the wheel and what it asks for; where its user works."""

    folder: Path

    def run(self, program: str, *arguments: str) -> str:
        """Run a program of the environment, and return what it says."""
        return run(self.folder / "venv" / "bin" / program, *arguments, cwd=self.folder)

    @property
    def kernels(self) -> Path:
        """Where the program keeps what it compiles."""
        return Path(self.run("python", "-c", _KERNEL_FOLDER).strip())


@dataclass(frozen=True, slots=True)
class Demonstrated:
    """What ``slewline demo`` says in an environment where nothing was compiled, and then again."""

    user: User
    said: str
    said_again: str


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command that sees nothing of this tree but what it is told."""
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    environment["XDG_DATA_HOME"] = str(cwd / "data")
    done = subprocess.run(
        command, cwd=cwd, env=environment, stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout


@pytest.fixture(scope="session")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Distribution:
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, cwd=ROOT)
    (sdist,) = folder.glob("*.tar.gz")
    (wheel,) = folder.glob("*.whl")
    return Distribution(sdist, wheel)


@pytest.fixture(scope="session")
def user(dist: Distribution, tmp_path_factory: pytest.TempPathFactory) -> User:
    user = User(tmp_path_factory.mktemp("user"))
    run(sys.executable, "-m", "venv", user.folder / "venv", cwd=user.folder)
    user.run(
        "python", "-m", "pip", "-qq", "--disable-pip-version-check", "install", str(dist.wheel)
    )
    return user


@pytest.fixture(scope="session")
def demonstrated(user: User) -> Demonstrated:
    said, said_again = (user.run("slewline", "demo") for _ in range(2))
    return Demonstrated(user, said, said_again)


def warmed_up(demonstrated: Path) -> list[Path]:
    """Return the folders of this checkout's kernels that are just as the warm-up left them.

    Tests may have had others compiled, or for more arguments: these prove nothing of the warm-up.
    Where the demonstration has not compiled them all the whole is of no use, since what is compiled
    already asks for nothing that it calls.
    """
    ready = kernel_folder() / "all.ready"
    ended_at = ready.stat().st_mtime_ns if ready.exists() else 0

    def is_as_it_was(folder: Path) -> bool:
        try:
            times = [path.stat().st_mtime_ns for path in folder.iterdir()]
        except FileNotFoundError:  # somebody writes there
            return False
        num_kernels, num_compiled = (len(list(folder.glob(f"*.{end}"))) for end in ("nbi", "nbc"))
        return num_kernels == num_compiled and max(times, default=0) <= ended_at

    folders = list(kernel_folder().glob("planner_core.*"))
    taken = [each for each in folders if is_as_it_was(each)]
    left = [path for each in folders if each not in taken for path in each.glob("*.nbi")]
    is_whole = all((demonstrated / path.parent.name / path.name).exists() for path in left)
    return taken if is_whole else []


@pytest.fixture(scope="session")
def prefix(demonstrated: Demonstrated) -> Iterator[Path]:
    """The program as the image has it, in a folder that all may read.

    What the demonstration has compiled its build finds there, and what else the warm-up of this
    checkout has, but for a module: to compile all of it would take two minutes once more.
    """
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    prefix, user = folder / "slewline", demonstrated.user
    kernels = user.kernels
    compiled = prefix / kernels.relative_to(user.folder / "venv")
    environment = os.environ | {"PYTHON": sys.executable}
    given = [each for each in warmed_up(kernels) if each.name != _LEFT]
    commands: list[list[str | Path]] = [
        [ROOT / "docker" / "install", "libraries", prefix],
        ["mkdir", "-p", compiled],
        ["cp", "-R", *given, f"{kernels}/.", compiled],
        [ROOT / "docker" / "install", "program", prefix],
    ]
    try:
        for command in commands:
            subprocess.run(command, env=environment, cwd=ROOT, check=True, umask=0o022)
        yield prefix
    finally:
        shutil.rmtree(folder)
