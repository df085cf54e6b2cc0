"""Run the service on this machine: the API in this process, and workers in others."""

from __future__ import annotations

import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Final

import httpx
import uvicorn

from service.access import key_store
from service.db.migrate import upgrade
from service.db.session import Database
from service.heavy import HeavyProcess
from service.jobs.queue import DbosQueue, migrate_queue
from service.jobs.supervisor import Supervisor
from service.main import create_app
from service.process.connections import Protocol, allow_connections
from service.process.logs import configure_logging
from service.process.stopping import StopRequest
from service.process.tracing import start_tracing
from service.settings import Settings

_READY_WITHIN_S: Final = 300.0  # a first start may have kernels to compile
_LOOK_EVERY_S: Final = 0.1
_LAST_ANSWERS_WITHIN_S: Final = 3


class CannotServe(Exception):
    """The service cannot run as configured; the message says what to change."""


class NoKey(CannotServe):
    """Others could reach the service, but there is no valid key for it to require."""


def prepare_database(settings: Settings) -> None:
    """Create or update the tables of the service and of its queue."""
    upgrade(settings.database_url)
    migrate_queue(settings)


def require_key(settings: Settings) -> None:
    """Refuse to serve beyond this machine until there is a key.

    Raises
    ------
    NoKey
        If there is no valid key.
    """
    if settings.is_local or settings.static_keys:
        return
    upgrade(settings.database_url)
    with closing(Database(settings.database_url)) as database, database.reading() as session:
        if key_store.has_good_key(session):
            return
    raise NoKey(
        f"Will not listen on {settings.host} without a key: make one with slewline keys create, "
        "or set SLEWLINE_API_KEYS."
    )


def listen(host: str, port: int) -> socket.socket:
    """Return a socket bound to the address; with port 0, to a free port.

    Raises
    ------
    CannotServe
        If the port is taken, or the host is not an address of this machine.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listener = socket.create_server(address[:2], family=family, backlog=2048)
    except OSError as error:
        raise CannotServe(
            f"Cannot listen on {host} port {port}: {error.strerror}. Give another --port; 0 picks "
            "a free one."
        ) from error
    # Connections inherit this option. asyncio sets it only if a socket names its protocol, and
    # without it each answer's body waits for the client's delayed acknowledgement (40 ms).
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener


def address_of(listener: socket.socket) -> str:
    """Return the URL of a listening socket."""
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def serve(settings: Settings, *, with_workers: bool) -> int:
    """Serve until SIGTERM or SIGINT, then end everything started. Return the exit status."""
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.ask())
    allow_connections()
    with ExitStack() as stack:
        heavy = HeavyProcess(settings)
        stack.callback(heavy.close)
        require_key(settings)
        listener = stack.enter_context(listen(settings.host, settings.port))
        configure_logging()
        if (provider := start_tracing(settings, "api")) is not None:
            stack.callback(provider.shutdown)
        prepare_database(settings)
        heavy.start()
        api = stack.enter_context(_running_api(settings, listener, heavy.path))
        health = "live"
        if with_workers and settings.workers:
            supervisor = Supervisor(settings)
            stack.callback(supervisor.stop)
            supervisor.start()
            health = "ready"
        url = address_of(listener)

        def is_over() -> bool:
            return stop.is_asked() or not api.is_alive() or not heavy.is_watched()

        if _wait_for(f"{url}/health/{health}", is_over):
            print(f"Slewline is ready at {url}", flush=True)
        while not is_over():
            stop.wait(_LOOK_EVERY_S)
    return 0 if stop.is_asked() else 1


@contextmanager
def _running_api(
    settings: Settings, listener: socket.socket, heavy: str
) -> Iterator[threading.Thread]:
    queue = DbosQueue(settings.database_url, settings.database_timeout_s)
    config = uvicorn.Config(
        create_app(settings, queue, heavy=heavy),
        log_config=None,
        access_log=False,
        http=Protocol,
        timeout_graceful_shutdown=_LAST_ANSWERS_WITHIN_S,
    )
    server = uvicorn.Server(config)
    # In a thread, uvicorn leaves signals to the main thread, which must also stop workers.
    thread = threading.Thread(target=server.run, args=([listener],), name="api", daemon=True)
    thread.start()
    try:
        yield thread
    finally:
        server.should_exit = True
        thread.join()
        queue.close()


def _wait_for(url: str, is_over: Callable[[], bool]) -> bool:
    """Return whether the URL answered 200 before ``is_over``."""
    deadline_s = time.monotonic() + _READY_WITHIN_S
    with httpx.Client(trust_env=False) as client:
        while not is_over():
            if time.monotonic() > deadline_s:
                raise CannotServe(f"No worker became ready within {_READY_WITHIN_S:.0f} s.")
            try:
                if client.get(url).is_success:
                    return True
            except httpx.HTTPError:
                pass  # not listening yet
            time.sleep(_LOOK_EVERY_S)
    return False
