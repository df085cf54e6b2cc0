"""Keeps a number of worker processes running on this machine."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import threading
import time
from typing import Final

from service.jobs.runner import Work
from service.process.logs import STDERR
from service.settings import Settings

log = logging.getLogger(__name__)

_LOOK_EVERY_S: Final = 0.2
_SHORT_LIFE_S: Final = 10.0
_LONGEST_PAUSE_S: Final = 30.0


class Supervisor:
    """Starts workers, replaces each one that dies, and stops them all.

    Each worker is a fresh process with an executor id of its own: a queue must never mistake a
    new worker for the one that died.
    """

    def __init__(self, settings: Settings, *, work: Work | None = None):
        self._command = _command(work or Work())
        self._environment = os.environ | environment_of(settings)
        self._slots = [_Slot() for _ in range(settings.workers)]
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="supervisor", daemon=True)

    def start(self) -> None:
        """Start the workers without waiting for them."""
        self._thread.start()

    def stop(self, *, within_s: float = 10.0) -> None:
        """Ask all workers to hand back their jobs and end; kill those that do not."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()
        for slot in self._slots:
            slot.terminate()
        deadline_s = time.monotonic() + within_s
        for slot in self._slots:
            slot.join(deadline_s - time.monotonic())

    def pids(self) -> list[int]:
        """Return the process ids of the running workers."""
        return [pid for slot in self._slots if (pid := slot.pid()) is not None]

    def _watch(self) -> None:
        while not self._stopping.is_set():
            for slot in self._slots:
                slot.keep_running(self._command, self._environment)
            self._stopping.wait(_LOOK_EVERY_S)


class _Slot:
    """The slot of one worker."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._started_s = 0.0
        self._pause_s = 0.0

    def pid(self) -> int | None:
        if self._process is None or self._process.poll() is not None:
            return None
        return self._process.pid

    def keep_running(self, command: list[str], environment: dict[str, str]) -> None:
        """Start a worker if there is none; wait longer each time one dies young."""
        now_s = time.monotonic()
        if self._process is not None and self._process.poll() is not None:
            log.warning("a worker ended with status %s", self._process.returncode)
            died_young = now_s - self._started_s < _SHORT_LIFE_S
            self._pause_s = min(_LONGEST_PAUSE_S, 2 * self._pause_s + 1.0) if died_young else 0.0
            self._process = None
        if self._process is None and now_s >= self._started_s + self._pause_s:
            self._started_s = now_s
            # In a session of its own, so that Ctrl-C reaches only the supervisor. A library's
            # prints go to stderr, since stdout is for the service's own output.
            self._process = subprocess.Popen(  # noqa: S603 - our own command
                command, env=environment, stdout=STDERR, start_new_session=True
            )

    def terminate(self) -> None:
        if self._process is not None:
            self._process.terminate()

    def join(self, within_s: float) -> None:
        if self._process is None:
            return
        try:
            self._process.wait(max(within_s, 0.0))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _command(work: Work) -> list[str]:
    options = ["--work", work.function, "--preload", work.preload]
    return [sys.executable, "-m", "service.jobs", *options, "--supervisor", str(os.getpid())]


def environment_of(settings: Settings) -> dict[str, str]:
    """Return settings as the environment variables that would produce them."""
    prefix = settings.model_config.get("env_prefix", "")
    return {
        f"{prefix}{name}".upper(): value if isinstance(value, str) else json.dumps(value)
        for name, value in settings.model_dump(mode="json").items()
        if value is not None
    }
