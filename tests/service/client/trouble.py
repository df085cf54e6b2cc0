"""A proxy before a real service, on which connections fail on command."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx

from tests.plain_http import NO_TLS

_OF_ONE_CONNECTION = {"connection", "transfer-encoding", "content-length", "date", "server"}


@dataclass(frozen=True, slots=True)
class Seen:
    """A received request."""

    method: str
    path: str
    query: Mapping[str, str]
    headers: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class LostAnswer:
    """The service receives the request and answers; the connection breaks before the answer."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The proxy answers; the service never sees the request."""

    status: int
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b"<h1>Trouble</h1>"


@dataclass(frozen=True, slots=True)
class Cut:
    """The connection breaks as soon as enough of the answer has passed."""

    is_far_enough: Callable[[bytes], bool]


Fault = LostAnswer | Answer | Cut


class Proxy(ThreadingHTTPServer):
    """Passes requests on to a service; the faults planned for a call occur one after the other."""

    daemon_threads = True

    def __init__(self, upstream: str):
        super().__init__(("127.0.0.1", 0), _Handler)
        self.upstream = upstream
        self.seen: list[Seen] = []
        self._planned: list[tuple[str, str, Fault]] = []

    @property
    def url(self) -> str:
        """The proxy's address."""
        return f"http://127.0.0.1:{self.server_address[1]}"

    def plan(self, method: str, ending: str, *faults: Fault) -> None:
        """Let the next calls fail whose path has this ending."""
        self._planned += [(method, ending, fault) for fault in faults]

    def take(self, method: str, path: str) -> Fault | None:
        """Return the fault for this request, if any."""
        for position, (of_method, ending, fault) in enumerate(self._planned):
            if of_method == method and path.endswith(ending):
                del self._planned[position]
                return fault
        return None

    def requests(self, method: str, ending: str) -> list[Seen]:
        """Return the requests of one call."""
        return [s for s in self.seen if s.method == method and s.path.endswith(ending)]


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Proxy

    def do_GET(self) -> None:
        self._pass_on()

    do_POST = do_PUT = do_DELETE = do_GET  # noqa: N815

    def log_message(self, *_: object) -> None:
        pass

    def _pass_on(self) -> None:
        self.close_connection = True
        body = self.rfile.read(int(self.headers.get("content-length", 0)))
        url = httpx.URL(self.server.upstream + self.path)
        headers = {name.lower(): value for name, value in self.headers.items()}
        self.server.seen.append(Seen(self.command, url.path, dict(url.params), headers))
        fault = self.server.take(self.command, url.path)
        if isinstance(fault, Answer):
            self._begin(fault.status, {**fault.headers, "Content-Length": str(len(fault.body))})
            self.wfile.write(fault.body)
            return
        sent = {n: v for n, v in headers.items() if n not in ("host", "connection")}
        with (
            httpx.Client(trust_env=False, timeout=60.0, verify=NO_TLS) as client,
            client.stream(self.command, url, headers=sent, content=body) as answer,
        ):
            if isinstance(fault, LostAnswer):
                answer.read()
                return
            self._relay(answer, fault)

    def _relay(self, answer: httpx.Response, fault: Cut | None) -> None:
        kept = {n: v for n, v in answer.headers.items() if n not in _OF_ONE_CONNECTION}
        has_body = answer.status_code not in (204, 304)
        self._begin(
            answer.status_code, {**kept, "Transfer-Encoding": "chunked"} if has_body else kept
        )
        so_far = b""
        for chunk in answer.iter_raw() if has_body else ():
            so_far += chunk
            self.wfile.write(b"%x\r\n%b\r\n" % (len(chunk), chunk))
            self.wfile.flush()
            if fault is not None and fault.is_far_enough(so_far):
                return  # without the last chunk, so that the other side notices
        if has_body:
            self.wfile.write(b"0\r\n\r\n")

    def _begin(self, status: int, headers: Mapping[str, str]) -> None:
        self.send_response_only(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.send_header("Connection", "close")
        self.end_headers()


@contextmanager
def proxy_before(upstream: str) -> Iterator[Proxy]:
    """Run a proxy before a service."""
    with Proxy(upstream) as proxy:
        thread = threading.Thread(target=proxy.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield proxy
        finally:
            proxy.shutdown()
            thread.join()
