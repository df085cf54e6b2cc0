"""``Idempotency-Key``: a repeated request gets the answer of the first one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Final, TypeVar

from fastapi import Depends, FastAPI, Header, Request, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool

from service.api.conditional import located
from service.api.deps import Call, CallDep
from service.problems.kinds import ServiceError
from service.stores import idempotency_store as store
from service.stores.idempotency_store import KeptAnswer, Keyed

M = TypeVar("M", bound=BaseModel)

# The headers that belong to what was created; the others concern a single exchange.
_KEPT_HEADERS: Final = ("location", "etag", "retry-after")


class AlreadyAnswered(Exception):
    """The request was sent before and got this answer."""

    def __init__(self, answer: KeptAnswer):
        super().__init__(answer.status)
        self.answer = answer


class Once:
    """Lets a request that creates something do so only once for each key.

    A route opens its transaction with ``transaction`` and passes its answer through ``keep``
    before the transaction ends. Refused requests store no answer: their key can be used again.
    """

    def __init__(self, call: Call, keyed: Keyed | None):
        self._call = call
        self._keyed = keyed

    def find(self) -> None:
        """Raise ``AlreadyAnswered`` if the request is a repeated one."""
        with self._call.database.reading() as session:
            self._require_first(session, store.find)

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """Yield a session that may write, after claiming the key for this request."""
        with self._call.database.transaction() as session:
            self._require_first(session, store.claim)
            yield session

    def _require_first(
        self, session: Session, ask: Callable[[Session, Keyed], KeptAnswer | None]
    ) -> None:
        try:
            answer = None if self._keyed is None else ask(session, self._keyed)
        except store.KeyReused:
            detail = "The Idempotency-Key was used for another request; choose a new one."
            raise ServiceError("idempotency_key_reused", detail) from None
        if answer is not None:
            raise AlreadyAnswered(answer)

    def created(
        self, session: Session, kind: str, own_id: str, model: M, shown_once: Collection[str] = ()
    ) -> M:
        """Audit a new item of the called collection, keep the answer and return it with headers."""
        self._call.audit.record(session, "create", kind, own_id)
        location = f"{self._call.request.url.path}/{own_id}"
        return self.keep(session, located(self._call, model, location), shown_once)

    def keep(self, session: Session, model: M, shown_once: Collection[str] = ()) -> M:
        """Return the answer, and store it under the key with the headers set so far.

        Parameters
        ----------
        shown_once
            Fields that are null in the stored answer, and so for whoever repeats the request.
        """
        if self._keyed is not None:
            response, route = self._call.response, self._call.request.scope["route"]
            headers = response.headers
            answer = KeptAnswer(
                status=response.status_code or route.status_code or 200,
                headers={name: headers[name] for name in _KEPT_HEADERS if name in headers},
                body=model.model_copy(update=dict.fromkeys(shown_once)).model_dump_json(),
            )
            store.keep(session, self._keyed, answer)
        return model


async def _once(
    call: CallDep,
    idempotency_key: Annotated[
        str | None,
        Header(
            alias="Idempotency-Key",
            min_length=1,
            max_length=255,
            pattern=r"^[\x21-\x7e]+$",
            description="A key of your choice for this request. If sent again with the same body, "
            "it creates nothing and gets the stored answer, with `Idempotency-Replayed: true`.",
        ),
    ] = None,
) -> Once:
    if idempotency_key is None:
        return Once(call, None)
    keyed = Keyed(
        tenant=call.caller.owner,
        key=idempotency_key,
        request_sha256=_fingerprint(call.request, await call.request.body()),
        keep_s=call.settings.idempotency_hours * 3600.0,
    )
    once = Once(call, keyed)
    # A repeated request is answered before what it names is looked up, which may be gone by now.
    await run_in_threadpool(once.find)
    return once


OnceDep = Annotated[Once, Depends(_once)]


def install_replay(app: FastAPI) -> None:
    """Answer repeated requests with the first answer."""
    app.exception_handler(AlreadyAnswered)(_replay)


def _replay(_request: Request, error: AlreadyAnswered) -> Response:
    answer = error.answer
    headers = answer.headers | {"Idempotency-Replayed": "true"}
    return Response(answer.body, answer.status, headers, media_type="application/json")


def _fingerprint(request: Request, body: bytes) -> str:
    query = sorted(request.query_params.multi_items())
    parts: list[Any] = [request.method, request.url.path, query]
    try:
        # Two spellings of one JSON document are one request.
        parts.append(json.dumps(json.loads(body), sort_keys=True))
    except (ValueError, RecursionError):
        parts.append(hashlib.sha256(body).hexdigest())
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()
