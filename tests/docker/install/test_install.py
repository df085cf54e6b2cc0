"""The commands of the image's build, without Docker: installed by root, run by nobody, read-only.

Not among the ordinary tests: it takes minutes and the package index. ``.ci/run`` runs it.
"""

from __future__ import annotations

import filecmp
import os
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.patience import PATIENCE_S
from tests.service import factories

AS_NOBODY = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
# It may read everything: the interpreter may lie in a private folder of root.
AS_NOBODY += ["--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"]


@pytest.fixture
def scratch() -> Iterator[Path]:
    """The folder that a container may write to."""
    folder = Path(tempfile.mkdtemp())
    os.chown(folder, 65534, 65534)
    yield folder
    shutil.rmtree(folder)


def package(prefix: Path) -> Path:
    (found,) = prefix.glob("lib/python*/site-packages/planner_core")
    return found


def test_what_is_installed_is_settled(prefix: Path) -> None:
    """No tools to install more, nothing others may write, and times that an image can hold."""
    programs = {path.name for path in (prefix / "bin").iterdir()}
    assert "slewline" in programs
    assert not {name for name in programs if name.startswith(("pip", "nox", "virtualenv"))}
    files = [path for path in prefix.rglob("*") if not path.is_symlink()]
    assert not [path for path in files if path.stat().st_mode & (stat.S_IWGRP | stat.S_IWOTH)]
    sources = list(package(prefix).rglob("*.py"))
    assert len(sources) > 30
    assert all(path.stat().st_mtime_ns % 1_000_000_000 == 0 for path in sources)


def test_nobody_runs_a_job_and_no_kernel_is_compiled_for_it(prefix: Path, scratch: Path) -> None:
    compiled = package(prefix) / "__pycache__" / "kernels"
    environment = {
        "PATH": "/usr/bin:/bin",
        "HOME": "/nonexistent",
        "XDG_CACHE_HOME": str(scratch / "cache"),
        "SLEWLINE_DATABASE_URL": f"sqlite:///{scratch / 'slewline.db'}",
        "SLEWLINE_WORKERS": "1",
        "SLEWLINE_PORT": "0",
    }
    process = subprocess.Popen(
        [*AS_NOBODY, prefix / "bin" / "slewline", "serve"],
        env=environment,
        cwd="/",
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    try:
        line = process.stdout.readline()
        assert line.startswith("Slewline is ready at "), line
        with httpx.Client(base_url=line.split()[-1], timeout=PATIENCE_S) as client:
            job = plan(client)
        assert job["state"] == "succeeded", job["error"]
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
    (used,) = (scratch / "cache" / "slewline").glob("kernels-*")
    assert same(compiled, used)


def plan(client: httpx.Client) -> dict[str, object]:
    satellite = factories.post(client, "/v1/satellites", factories.satellite())
    station = factories.post(client, "/v1/ground-stations", factories.ground_station())
    targets = [factories.target(id=f"t{n}", lat_deg=4.0 * n - 60) for n in range(30)]
    catalog = factories.post(client, "/v1/target-catalogs", {"name": "c", "targets": targets})
    scenario = {
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-02T00:00:00Z"},
        "satellite_ids": [satellite["id"]],
        "target_catalog_ids": [catalog["id"]],
        "ground_station_ids": [station["id"]],
    }
    body = {"scenario": scenario, "solver": "certified", "limits": {"time_s": 30}}
    job = factories.post(client, "/v1/jobs", body)
    while job["state"] in ("queued", "running"):
        job = client.get(f"/v1/jobs/{job['id']}", params={"wait": 10}).json()
    return job


def same(one: Path, other: Path) -> bool:
    """Return whether two folders hold the same files with the same content."""
    found = filecmp.dircmp(one, other)
    assert not found.left_only
    assert not found.right_only, "a kernel was compiled that the installation lacks"
    _, changed, unreadable = filecmp.cmpfiles(one, other, found.common_files, shallow=False)
    return (
        not changed
        and not unreadable
        and all(same(one / name, other / name) for name in found.common_dirs)
    )
