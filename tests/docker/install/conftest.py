"""Installations, made once for all tests of this folder, as by users and by the image's build."""

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

ROOT = Path(__file__).resolve().parents[3]
_KERNEL_FOLDER = "from planner_core.kernel_folder import kernel_folder; print(kernel_folder())"

COMPILED = os.environ.get("SLEWLINE_TEST_KERNELS")
"""Folder of the kernels from this checkout's warm-up, copied before tests compiled any others:
in ``demonstration`` those of its first part, in ``all`` those of the whole. Without it each
installation compiles all its own kernels, which takes minutes."""

_LEFT_TO_USER = "planner_core.referee.delivery"
_LEFT_TO_IMAGE = "planner_core.certified.dp.start_labels"
"""Modules whose kernels no kernel of another module needs; the demonstration uses the first one's.
"""


@dataclass(frozen=True, slots=True)
class Distribution:
    """An sdist, and the wheel that is built from it."""

    sdist: Path
    wheel: Path


@dataclass(frozen=True, slots=True)
class User:
    """An environment with only the wheel and its requirements, and the user's working folder."""

    folder: Path

    def run(self, program: str, *arguments: str) -> str:
        """Run a program of the environment, and return its output."""
        return run(self.folder / "venv" / "bin" / program, *arguments, cwd=self.folder)

    @property
    def kernels(self) -> Path:
        """The program's folder for compiled kernels."""
        return Path(self.run("python", "-c", _KERNEL_FOLDER).strip())


@dataclass(frozen=True, slots=True)
class Demonstrated:
    """The output of ``slewline demo`` in a new environment, and of a second run."""

    user: User
    said: str
    said_again: str


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command that sees nothing of this tree except its arguments."""
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
    pip = ("python", "-m", "pip", "-qq", "--disable-pip-version-check", "install", "--no-compile")
    user.run(*pip, str(dist.wheel))
    return user


def compiled(part: str, left: str) -> list[Path]:
    """Return the folders of this checkout's kernels except one module's; none if not given."""
    folders = sorted(Path(COMPILED, part).glob("planner_core.*")) if COMPILED else []
    taken = [folder for folder in folders if folder.name != left]
    assert len(taken) == max(len(folders) - 1, 0)
    return taken


@pytest.fixture(scope="session")
def demonstrated(user: User) -> Demonstrated:
    """Run the demonstration, given the kernels of this checkout's warm-up except one module's.

    Compiling all of them again would take more than a minute of processor time.
    """
    for folder in compiled("demonstration", _LEFT_TO_USER):
        shutil.copytree(folder, user.kernels / folder.name)
    said, said_again = (user.run("slewline", "demo") for _ in range(2))
    return Demonstrated(user, said, said_again)


@pytest.fixture(scope="session")
def prefix(demonstrated: Demonstrated) -> Iterator[Path]:
    """The program as in the image, in a folder that everybody may read.

    Its build is given the kernels that the demonstration has compiled and the others of this
    checkout's warm-up, except one module's.
    """
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    prefix, user = folder / "slewline", demonstrated.user
    kernels = user.kernels
    place = prefix / kernels.relative_to(user.folder / "venv")
    environment = os.environ | {"PYTHON": sys.executable}
    commands: list[list[str | Path]] = [
        [ROOT / "docker" / "install", "libraries", prefix],
        ["mkdir", "-p", place],
        ["cp", "-R", *compiled("all", _LEFT_TO_IMAGE), f"{kernels}/.", place],
        [ROOT / "docker" / "install", "program", prefix],
    ]
    try:
        for command in commands:
            subprocess.run(command, env=environment, cwd=ROOT, check=True, umask=0o022)
        yield prefix
    finally:
        shutil.rmtree(folder)
