"""The process that does what is heavy: the same application, behind ``service.api.bulkhead``.

Its memory is watched. When it holds too much it is ended, with all that it was doing, and
a new one begins: the API beside it goes on.
"""

from __future__ import annotations

import argparse
import logging
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import psutil
import uvicorn

from service.jobs.parent import die_with_parent
from service.jobs.queue import DbosQueue
from service.jobs.supervisor import environment_of
from service.main import create_app
from service.process.logs import STDERR, configure_logging
from service.process.tracing import start_tracing
from service.settings import Settings

log = logging.getLogger(__name__)

_LOOK_EVERY_S: Final = 0.1
_STOP_WITHIN_S: Final = 5.0
_NICENESS: Final = 10


@contextmanager
def running_heavy(settings: Settings) -> Iterator[str]:
    """Keep such a process running; yield the socket file at which it listens."""
    stopping = threading.Event()
    # A folder of our own: nobody else may reach a server that believes whatever caller is named.
    with tempfile.TemporaryDirectory(prefix="slewline-") as folder:
        path = str(Path(folder) / "heavy")
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(path)
            listener.listen(128)
            watch = threading.Thread(target=_keep, args=(settings, listener, stopping), daemon=True)
            watch.start()
            try:
                yield path
            finally:
                stopping.set()
                watch.join()


def _keep(settings: Settings, listener: socket.socket, stopping: threading.Event) -> None:
    # Requests wait in the listener while there is no process.
    number = listener.fileno()
    command = [sys.executable, "-m", "service.heavy"]
    command += ["--fd", str(number), "--parent", str(os.getpid())]
    environment = os.environ | environment_of(settings)
    while not stopping.is_set():
        process = subprocess.Popen(  # noqa: S603 - our own command
            command, env=environment, stdout=STDERR, pass_fds=[number], start_new_session=True
        )
        while process.poll() is None and not stopping.wait(_LOOK_EVERY_S):
            if (held_mb := _held_mb(process.pid)) > settings.heavy_memory_mb:
                log.warning("the process for heavy work held %.0f MB and is ended", held_mb)
                process.kill()
        if stopping.is_set():
            process.terminate()
        else:
            log.warning("the process for heavy work ended with status %s", process.wait())
            stopping.wait(_LOOK_EVERY_S)
    try:
        process.wait(_STOP_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _held_mb(pid: int) -> float:
    try:
        return float(psutil.Process(pid).memory_info().rss) / 1e6
    except psutil.NoSuchProcess:
        return 0.0


def main() -> None:
    """Serve on an inherited socket until SIGTERM, or until the parent is gone."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--fd", type=int, required=True)
    parser.add_argument("--parent", type=int, required=True)
    options = parser.parse_args()
    die_with_parent(signal.SIGTERM)
    if os.getppid() != options.parent:
        return  # it ended while this process began
    os.nice(_NICENESS)  # whatever is light goes first
    settings = Settings()
    configure_logging()
    provider = start_tracing(settings, "api")
    queue = DbosQueue(settings.database_url, settings.database_timeout_s)
    app = create_app(settings, queue, is_heavy=True)
    listener = socket.socket(fileno=options.fd)
    config = uvicorn.Config(
        app, log_config=None, access_log=False, server_header=False, date_header=False
    )
    uvicorn.Server(config).run(sockets=[listener])
    queue.close()
    if provider is not None:
        provider.shutdown()


if __name__ == "__main__":
    main()
