"""The process for heavy requests: the same application, behind ``service.api.bulkhead``.

Its memory is watched. If it holds too much, it is killed with all its work, and a new one
begins, while the API goes on.

A fork server between the two is itself forked from the API before anything is opened and any
thread begins. It watches the heavy process and forks a new one when one has ended, so that each
finds everything imported. The fork server of ``multiprocessing`` would import everything again.
"""

from __future__ import annotations

import gc
import logging
import os
import signal
import socket
import tempfile
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final

import uvicorn

from service.jobs.queue import DbosQueue
from service.main import create_app
from service.process.logs import STDERR, configure_logging
from service.process.parent import die_with_parent, held_mb, name_this_process
from service.process.tracing import start_tracing
from service.settings import Settings

log = logging.getLogger(__name__)

_FORK: Final = get_context("fork")
_LOOK_EVERY_S: Final = 0.1
_STOP_WITHIN_S: Final = 5.0
_NICENESS: Final = 10


class HeavyProcess:
    """Keeps a heavy process running.

    Make one before any thread begins, ``start`` it when the database is ready, and ``close`` it.

    Attributes
    ----------
    path
        The socket file on which it listens.
    """

    def __init__(self, settings: Settings) -> None:
        # A private folder: the heavy process trusts whoever can reach it to name the caller.
        self._folder = tempfile.TemporaryDirectory(prefix="slewline-")
        self.path = str(Path(self._folder.name) / "heavy")
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(self.path)
            listener.listen(128)
            theirs, self._pipe = _FORK.Pipe(duplex=False)
            # Existing objects are never collected, so that their pages stay shared: 90 MB less.
            gc.freeze()
            self._fork_server = _FORK.Process(
                target=_keep_running, args=(settings, listener, theirs, self._pipe)
            )
            self._fork_server.start()
        theirs.close()

    def start(self) -> None:
        """Let the heavy process begin."""
        with suppress(BrokenPipeError):
            self._pipe.send(None)

    def is_watched(self) -> bool:
        """Return whether the fork server is alive, which must start any new heavy process."""
        return self._fork_server.is_alive()

    def close(self) -> None:
        """End the heavy process and the fork server."""
        self._pipe.close()
        self._fork_server.join()
        self._folder.cleanup()


def _keep_running(
    settings: Settings,
    listener: socket.socket,
    pipe: Connection[Any, Any],
    other_end: Connection[Any, Any],
) -> None:
    """Keep one running from the first message in the pipe until the pipe is closed."""
    other_end.close()
    name_this_process("slewline-fork")
    # In a session of its own, so that Ctrl-C reaches only the API. A library's prints go to
    # stderr, since stdout is for the service's own output.
    os.setsid()
    os.dup2(STDERR, 1)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)
    try:
        pipe.recv()
    except EOFError:
        return
    configure_logging()
    # Requests wait in the listener while there is no heavy process.
    while True:
        process = _FORK.Process(target=_serve, args=(settings, listener))
        process.start()
        if not _watch(process, pipe, settings.heavy_memory_mb):
            return
        log.warning("the process for heavy work ended with status %s", process.exitcode)
        wait([pipe], _LOOK_EVERY_S)


def _watch(process: BaseProcess, pipe: Connection[Any, Any], most_mb: float) -> bool:
    """Return True when the process has ended; when the pipe closes, end it and return False."""
    while process.is_alive():
        if pipe in wait([pipe, process.sentinel], _LOOK_EVERY_S):
            process.terminate()
            process.join(_STOP_WITHIN_S)
            process.kill()
            process.join()
            return False
        if (now_mb := held_mb(process.pid)) > most_mb:
            log.warning("the process for heavy work used %.0f MB and is being ended", now_mb)
            process.kill()
            process.join()
    return True


def _serve(settings: Settings, listener: socket.socket) -> None:
    """Serve on a socket until SIGTERM, or until the parent has ended."""
    die_with_parent(signal.SIGTERM)
    name_this_process("slewline-heavy")
    os.nice(_NICENESS)  # light requests go first
    provider = start_tracing(settings, "api")
    queue = DbosQueue(settings.database_url, settings.database_timeout_s)
    app = create_app(settings, queue, is_heavy=True)
    config = uvicorn.Config(
        app, log_config=None, access_log=False, server_header=False, date_header=False
    )
    uvicorn.Server(config).run(sockets=[listener])
    queue.close()
    if provider is not None:
        provider.shutdown()
