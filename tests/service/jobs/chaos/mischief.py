"""Faults, one after the other and partly at once: processes die or freeze, databases fail."""

from __future__ import annotations

import contextlib
import os
import random
import shlex
import signal
import sqlite3
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from typing import Protocol

import psutil
from sqlalchemy.exc import SQLAlchemyError

from tests.service.jobs.chaos.api import Api
from tests.service.jobs.conftest import SERVER_URL, Jobs
from tests.service.jobs.unwritable import no_room_for, read_only_server

SERVER_CONTROL = shlex.split(os.environ.get("SLEWLINE_TEST_SERVER_CONTROL", ""))
"""The ``pg_ctl`` command of the server that SERVER_URL names."""


class HasWorkers(Protocol):
    """The owner of the workers."""

    def pids(self) -> list[int]:
        """Return their process ids."""
        ...


class Mischief:
    """Causes faults in one running service; all of them are over when ``run`` returns.

    Attributes
    ----------
    done
        How often each fault has been caused.
    """

    def __init__(self, jobs: Jobs, api: Api, workers: HasWorkers, seed: int):
        self.done: Counter[str] = Counter()
        self._jobs = jobs
        self._api = api
        self._workers = workers
        self._random = random.Random(seed)
        self._too_long_s = 1.5 * jobs.settings.lease_s
        self._frozen: dict[int, threading.Timer] = {}

    def run(self, rounds: int, pause_s: float) -> None:
        """Cause every fault this number of times, in random order."""
        if SERVER_URL is None:
            of_database = [self.hold_lock, self.fill_disk]
        else:
            of_database = [self.crash_server, self.stop_server, self.forbid_writing]
        kinds = [self.kill_worker, *2 * [self.freeze_worker], self.kill_api, *of_database]
        for _ in range(rounds):
            for fault in self._random.sample(kinds, len(kinds)):
                time.sleep(self._random.uniform(0.2, pause_s))
                fault()
                self.done[fault.__name__] += 1
        for timer in self._frozen.values():
            timer.join()

    def kill_worker(self) -> None:
        """Send SIGKILL to a worker, whether busy or frozen."""
        os.kill(self._some_worker(), signal.SIGKILL)

    def kill_workers(self) -> None:
        """Send SIGKILL to all of them at once."""
        for pid in self._workers.pids():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def freeze_worker(self) -> None:
        """Send SIGSTOP for longer than a lease, while other faults go on."""
        pid = self._busy_worker()
        os.kill(pid, signal.SIGSTOP)
        # It may wake while the next owner is still at work, or when everything is over.
        frozen_s = self._jobs.settings.lease_s * self._random.uniform(1.5, 3.0)
        timer = threading.Timer(frozen_s, _wake, [pid])
        timer.start()
        self._frozen[pid] = timer

    def kill_api(self) -> None:
        """Send SIGKILL in the middle of any answer."""
        self._api.kill()

    def hold_lock(self) -> None:
        """Lock a SQLite file against all writers."""
        with closing(sqlite3.connect(self._jobs.folder / "jobs.db", timeout=60.0)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            time.sleep(self._too_long_s)

    def fill_disk(self) -> None:
        """Make all writes to the files fail."""
        with self._no_room():
            time.sleep(self._too_long_s)

    def crash_server(self) -> None:
        """Send SIGKILL to PostgreSQL and start it again; it recovers from its log."""
        _control("kill", "KILL", str(_server_pid()))
        _start_server()

    def stop_server(self) -> None:
        """Stop PostgreSQL at once, for longer than a lease."""
        _control("stop", "-m", "immediate")
        time.sleep(self._too_long_s)
        _start_server()

    def forbid_writing(self) -> None:
        """Make PostgreSQL read-only for longer than a lease."""
        assert SERVER_URL is not None
        with read_only_server(SERVER_URL):
            time.sleep(self._too_long_s)

    def _some_worker(self) -> int:
        while not (pids := self._workers.pids()):
            time.sleep(0.1)
        return self._random.choice(pids)

    def _busy_worker(self) -> int:
        """Return a worker whose solver is running, or any worker if there is none."""
        for start in reversed(self._jobs.starts()):
            try:
                _fork_server, worker, *_ = psutil.Process(int(start.split()[-1])).parents()
            except (psutil.NoSuchProcess, ValueError):
                continue
            if worker.pid in self._workers.pids():
                return worker.pid
        return self._some_worker()

    @contextlib.contextmanager
    def _no_room(self) -> Iterator[None]:
        # A worker that has not enrolled is still starting the server that forks its solvers, which
        # would inherit the limit.
        enrolled = {int(name.split("-")[-2]) for name in self._jobs.workers()}
        pids = [pid for pid in self._workers.pids() if pid in enrolled]
        api = self._api.pid()
        with ExitStack() as stack:
            for pid in pids if api is None else [*pids, api]:
                stack.enter_context(_unless_it_ends(pid))
            yield


@contextlib.contextmanager
def _unless_it_ends(pid: int) -> Iterator[None]:
    """Leave a process no disk space; it may have ended before, or may end meanwhile."""
    with contextlib.suppress(ProcessLookupError), ExitStack() as stack:
        with contextlib.suppress(ProcessLookupError):
            stack.enter_context(no_room_for(pid))
        yield


def _wake(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGCONT)


def _server_pid() -> int:
    status = subprocess.run(
        [*SERVER_CONTROL[: SERVER_CONTROL.index("-w")], "status"],
        cwd="/",
        capture_output=True,
        text=True,
        check=True,
    )
    return int(status.stdout.partition("PID: ")[2].partition(")")[0])


def _control(*arguments: str) -> None:
    subprocess.run([*SERVER_CONTROL, *arguments], cwd="/", check=True)


def _start_server() -> None:
    """Start the server, as soon as the processes of the previous one are gone."""
    _until_it_works(lambda: _control("start"))


def _until_it_works(action: Callable[[], None]) -> None:
    while True:
        try:
            action()
            return
        except (subprocess.CalledProcessError, SQLAlchemyError):
            time.sleep(0.2)
