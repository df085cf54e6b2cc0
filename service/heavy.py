"""The process that does what is heavy: the same application, behind ``service.api.bulkhead``.

Its memory is watched. When it holds too much it is ended, with all that it was doing, and
a new one begins: the API beside it goes on.

A fork server between the two is itself forked from the API before anything is opened and any
thread begins. It watches the heavy process and forks a new one whenever one has ended: each finds
everything imported. The fork server of ``multiprocessing`` would import it all once more.
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
    """Keeps such a process running.

    Make one before any thread begins, ``start`` it when the database is ready, and ``close`` it.

    Attributes
    ----------
    path
        The socket file at which it listens.
    """

    def __init__(self, settings: Settings) -> None:
        # A folder of our own: nobody else may reach who believes whatever caller is named.
        self._folder = tempfile.TemporaryDirectory(prefix="slewline-")
        self.path = str(Path(self._folder.name) / "heavy")
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(self.path)
            listener.listen(128)
            theirs, self._pipe = _FORK.Pipe(duplex=False)
            # What is there now is never collected, so that its pages stay common: 90 MB less.
            gc.freeze()
            self._fork_server = _FORK.Process(
                target=_keep_running, args=(settings, listener, theirs, self._pipe)
            )
            self._fork_server.start()
        theirs.close()

    def start(self) -> None:
        """Let it begin."""
        with suppress(BrokenPipeError):
            self._pipe.send(None)

    def is_watched(self) -> bool:
        """Return whether the fork server is alive, without which no new one would begin."""
        return self._fork_server.is_alive()

    def close(self) -> None:
        """End it, and the fork server."""
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
    # In a session of its own, so that Ctrl-C reaches the API alone; what a library prints must
    # not be taken for words of the service.
    os.setsid()
    os.dup2(STDERR, 1)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)
    try:
        pipe.recv()
    except EOFError:
        return
    configure_logging()
    # Requests wait in the listener while there is no process.
    while True:
        process = _FORK.Process(target=_serve, args=(settings, listener))
        process.start()
        if not _watch(process, pipe, settings.heavy_memory_mb):
            return
        log.warning("the process for heavy work ended with status %s", process.exitcode)
        wait([pipe], _LOOK_EVERY_S)


def _watch(process: BaseProcess, pipe: Connection[Any, Any], most_mb: float) -> bool:
    """Return True when the process has ended, or end it and return False as the pipe closes."""
    while process.is_alive():
        if pipe in wait([pipe, process.sentinel], _LOOK_EVERY_S):
            process.terminate()
            process.join(_STOP_WITHIN_S)
            process.kill()
            process.join()
            return False
        if (now_mb := held_mb(process.pid)) > most_mb:
            log.warning("the process for heavy work held %.0f MB and is ended", now_mb)
            process.kill()
            process.join()
    return True


def _serve(settings: Settings, listener: socket.socket) -> None:
    """Serve on a socket until SIGTERM, or until the parent is gone."""
    die_with_parent(signal.SIGTERM)
    name_this_process("slewline-heavy")
    os.nice(_NICENESS)  # whatever is light goes first
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
