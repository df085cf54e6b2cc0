"""The attacks' targets: servers with owners and keys, on SQLite or the given PostgreSQL."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial

import httpx
import psutil
import pytest

from tests.patience import wait_until
from tests.plain_http import NO_TLS
from tests.service import prepared
from tests.service.access.conftest import Door, MakeDoor, door, make_door
from tests.service.jobs.conftest import SERVER_URL, Jobs, client, jobs, template_url, workers
from tests.service.webhooks.conftest import courier, post

__all__ = [
    "Door",
    "Jobs",
    "MakeDoor",
    "Program",
    "StartProgram",
    "client",
    "courier",
    "door",
    "jobs",
    "make_door",
    "post",
    "program",
    "template_url",
    "workers",
]

# A server has its own disk and locks.
collect_ignore = ["test_full_disk.py"] if SERVER_URL else []


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """An API that requires keys, and all the processes it starts."""

    door: Door
    process: prepared.Program

    @property
    def heavy(self) -> psutil.Process:
        """The process for heavy requests."""
        (fork_server,) = psutil.Process(self.process.pid).children()
        # It starts alongside the API, which may be ready first.
        wait_until(lambda: len(fork_server.children()) == 1)
        (process,) = fork_server.children()
        return process


StartProgram = Callable[..., AbstractContextManager[Program]]


@contextmanager
def running_program(jobs: Jobs, num_files: int = 0, **settings: object) -> Iterator[Program]:
    """Run the program on the database of jobs, with some settings changed."""
    url = jobs.settings.database_url
    words = ["service", "api", "--port", "0", "--database-url", url]
    given = {"require_keys": True} | settings
    variables = {f"SLEWLINE_{name}".upper(): str(value) for name, value in given.items()}
    with (jobs.folder / "api.log").open("ab") as log:
        process = prepared.start(words, os.environ | variables, stderr=log.fileno())
    if num_files:
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (num_files, num_files))
    assert process.stdout is not None
    try:
        address = process.stdout.readline().split()[-1]
        with httpx.Client(base_url=address, timeout=120, verify=NO_TLS) as client:
            yield Program(door=Door(client=client, jobs=jobs), process=process)
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()


@pytest.fixture
def program(jobs: Jobs) -> StartProgram:
    """Return a function that runs the program on the database of jobs with changed settings."""
    return partial(running_program, jobs)
