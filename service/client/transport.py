"""Requests that survive lost connections: resent if, and only if, that is safe."""

from __future__ import annotations

import logging
import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import IO, Any, Final, TypeVar
from urllib.parse import quote

import httpx
from pydantic import ValidationError
from tenacity import (
    RetryCallState,
    Retrying,
    retry_if_exception,
    stop_before_delay,
    wait_random_exponential,
)

from service.client.errors import ServiceError, UnexpectedAnswer, Unreachable, error_of
from service.wire.base import Json, Listed, Stored, Wire, read
from service.wire.instants import instant_text

log = logging.getLogger("service.client")

M = TypeVar("M", bound=Wire)
R = TypeVar("R")

Params = Mapping[str, str | int | float | bool | datetime | None]

_COME_BACK: Final = frozenset({429, 502, 503, 504})
_NEVER_SENT: Final = (httpx.ConnectError, httpx.ConnectTimeout, httpx.PoolTimeout)
_LOST: Final = (httpx.NetworkError, httpx.TimeoutException, httpx.RemoteProtocolError)
_PAUSE: Final = wait_random_exponential(multiplier=0.5, max=10.0)


class Transport:
    """Sends requests of one client.

    A request is resent after a lost connection, 429, 502, 503 and 504 if repeating it is
    harmless: GET, PUT and DELETE without ``If-Match``, and POST with an idempotency key.
    Any request is resent if the service was never reached. Pauses grow, are partly random,
    and never end before ``Retry-After``.
    """

    def __init__(self, http: httpx.Client, *, patience_s: float):
        self.http = http
        self.patience_s = patience_s

    def request(
        self,
        method: str,
        path: str,
        *,
        params: Params | None = None,
        headers: Mapping[str, str] | None = None,
        patience_s: float | None = None,
        **body: Any,
    ) -> httpx.Response:
        """Return the answer to a request: a success or 304.

        Parameters
        ----------
        patience_s
            How long to try again, at most.
        body
            ``json`` or ``content``.

        Raises
        ------
        ServiceError
            If the service refuses.
        Unreachable
            If no answer comes.
        """
        sent = httpx.Headers(headers)
        given = said(**(params or {}))

        def send() -> httpx.Response:
            answer = self.http.request(method, path, params=given, headers=sent, **body)
            return checked(answer)

        return self._again(send, is_repeatable(method, sent), patience_s)

    def get(self, path: str, shape: type[M], params: Params | None = None) -> M:
        """Return what is at a path."""
        return held(shape, self.request("GET", path, params=params))

    def post(
        self,
        path: str,
        shape: type[M],
        *,
        idempotency_key: str | None,
        headers: Mapping[str, str] | None = None,
        **rest: Any,
    ) -> M:
        """Return what was created: once, even if the request has to be sent several times."""
        key = {"Idempotency-Key": idempotency_key or secrets.token_hex(16)}
        return held(shape, self.request("POST", path, headers={**(headers or {}), **key}, **rest))

    def change(
        self, method: str, path: str, shape: type[M], body: Json, *, if_match: str | None
    ) -> M:
        """Return what is at a path after a change to the state that ``if_match`` names."""
        return held(shape, self.request(method, path, json=body, headers=only_if(if_match)))

    def delete(self, path: str, *, if_match: str | None = None) -> None:
        """Delete what is at a path; only in the state that ``if_match`` names, if given."""
        attempts = 0
        headers = only_if(if_match)

        def send() -> None:
            nonlocal attempts
            attempts += 1
            answer = self.http.delete(path, headers=headers)
            if answer.status_code == 404 and attempts > 1:
                return  # deleted by an earlier attempt, whose answer was lost
            checked(answer)

        self._again(send, is_repeatable("DELETE", httpx.Headers(headers)))

    def pages(self, path: str, shape: type[M], params: Params | None = None) -> Iterator[M]:
        """Yield all items of a list, fetching pages as needed."""
        cursor: str | None = None
        while True:
            answer = self.request("GET", path, params={**(params or {}), "cursor": cursor})
            page = held(Listed[shape], answer)  # type: ignore[valid-type]
            yield from page.items
            cursor = page.next
            if cursor is None:
                return

    @contextmanager
    def stream(
        self, path: str, headers: Mapping[str, str], *, silence_s: float
    ) -> Iterator[httpx.Response]:
        """Yield an answer that is still coming; it fails after ``silence_s`` without data."""
        timeout = httpx.Timeout(**{**self.http.timeout.as_dict(), "read": silence_s})
        with self.http.stream("GET", path, headers=headers, timeout=timeout) as answer:
            yield checked(answer)

    def save(self, path: str, file: Path) -> None:
        """Write what is at a path to a file, which appears complete or not at all."""

        def fetch() -> None:
            with self.http.stream("GET", path) as answer, written_whole(file) as out:
                for chunk in checked(answer).iter_bytes():
                    out.write(chunk)

        self._again(fetch, True)

    def _again(self, send: Callable[[], R], repeatable: bool, patience_s: float | None = None) -> R:
        retrying = Retrying(
            retry=retry_if_exception(lambda error: _is_worth_another(error, repeatable)),
            stop=stop_before_delay(self.patience_s if patience_s is None else patience_s),
            wait=_pause,
            before_sleep=_tell,
            reraise=True,
        )
        try:
            return retrying(send)
        except httpx.TransportError as error:
            raise Unreachable(f"{self.address}: {_words(error)}") from error

    @property
    def address(self) -> str:
        """The service's URL without credentials."""
        return str(self.http.base_url.copy_with(userinfo=b"")).rstrip("/")


def path_of(*parts: str) -> str:
    """Return a path of the API.

    >>> path_of("jobs", "a/b", "cancel")
    '/v1/jobs/a%2Fb/cancel'
    """
    return "/".join(["/v1", *(quote(part, safe="") for part in parts)])


def only_if(if_match: str | None) -> dict[str, str]:
    """Return the header that allows a change in one state only; none if any state will do."""
    return {} if if_match is None else {"If-Match": if_match}


def said(**fields: Any) -> Json:
    """Return the fields that are not None, with instants as text."""
    return in_text({name: value for name, value in fields.items() if value is not None})


def in_text(fields: Mapping[str, Any]) -> Json:
    """Return the fields with instants as text."""
    return {
        name: instant_text(value) if isinstance(value, datetime) else value
        for name, value in fields.items()
    }


def is_repeatable(method: str, headers: httpx.Headers) -> bool:
    """Return whether the service may receive this request twice without harm.

    >>> is_repeatable("POST", httpx.Headers()), is_repeatable("GET", httpx.Headers())
    (False, True)
    """
    # After a first successful attempt, the state that If-Match names no longer exists.
    if method in ("GET", "PUT", "DELETE"):
        return "If-Match" not in headers
    return "Idempotency-Key" in headers


def checked(answer: httpx.Response) -> httpx.Response:
    """Return an answer that is a success or 304; otherwise raise its error."""
    if answer.is_success or answer.status_code == 304:
        return answer
    answer.read()
    raise error_of(answer)


def held(shape: type[M], answer: httpx.Response) -> M:
    """Return the content of an answer, with its ETag if the shape has one."""
    request = answer.request
    found = parsed(shape, answer.content, f"{request.method} {request.url.path}")
    return found.with_etag(answer.headers.get("etag")) if isinstance(found, Stored) else found


def parsed(shape: type[M], text: str | bytes, what: str) -> M:
    """Return a text parsed as ``shape``; ``UnexpectedAnswer`` naming ``what`` if it is not one."""
    try:
        return read(shape, text)
    except ValidationError as error:
        raise UnexpectedAnswer(f"{what}: not the answer that the API specifies: {error}") from error


@contextmanager
def written_whole(file: Path) -> Iterator[IO[bytes]]:
    """Yield a file to write to, which gets its name only when it is complete."""
    part = file.with_name(f".{file.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as out:
            yield out
        os.replace(part, file)
    finally:
        part.unlink(missing_ok=True)


def _is_worth_another(error: BaseException, repeatable: bool) -> bool:
    if isinstance(error, ServiceError):
        return repeatable and error.status in _COME_BACK
    return isinstance(error, _NEVER_SENT) or (repeatable and isinstance(error, _LOST))


def _pause(attempt: RetryCallState) -> float:
    """Return the seconds until the next attempt: what was asked for, plus a random share."""
    error = attempt.outcome.exception() if attempt.outcome else None
    asked_s = error.retry_after_s if isinstance(error, ServiceError) else None
    return (asked_s or 0.0) + _PAUSE(attempt)


def _tell(attempt: RetryCallState) -> None:
    error = attempt.outcome.exception() if attempt.outcome else None
    if error is not None:
        log.warning("%s; trying again in %.1f s", _words(error), attempt.upcoming_sleep)


def _words(error: BaseException) -> str:
    return str(error) or type(error).__name__
