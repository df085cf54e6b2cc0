"""A TCP proxy before a server that can silently stop passing data on."""

from __future__ import annotations

import contextlib
import socket
import threading
from types import TracebackType

import sqlalchemy as sa


class FreezingProxy:
    """Passes bytes on in both directions, except while frozen; it always accepts connections.

    Parameters
    ----------
    url
        SQLAlchemy URL of the server.
    """

    def __init__(self, url: str):
        address = sa.make_url(url)
        assert address.host is not None
        assert address.port is not None
        self._server = (address.host, address.port)
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=200)
        self._flowing = threading.Event()
        self._flowing.set()
        self._open: list[socket.socket] = []
        port = self._listener.getsockname()[1]
        self.url = address.set(host="127.0.0.1", port=port).render_as_string(hide_password=False)

    def __enter__(self) -> FreezingProxy:
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for each in (self._listener, *self._open):
            _close(each)
        self.thaw()

    def freeze(self) -> None:
        """Answer nothing from now on."""
        self._flowing.clear()

    def thaw(self) -> None:
        """Pass on what has arrived meanwhile, and whatever follows."""
        self._flowing.set()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                server = socket.create_connection(self._server)
                self._open += [client, server]
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                self._flowing.wait()
                sink.sendall(data)
        self._flowing.wait()
        _close(source)
        _close(sink)


def _close(each: socket.socket) -> None:
    with contextlib.suppress(OSError):
        each.shutdown(socket.SHUT_RDWR)
    each.close()
