"""Whose key a request carries: one query for all that ask at the same time."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import Final

from anyio import CapacityLimiter, to_thread

from service.access import key_store
from service.access.callers import Caller
from service.access.tokens import digest_of
from service.db.session import Database

_MOST_KNOWN: Final = 10_000
_THREADS_FOR_STRANGERS: Final = 2


class KeyLookup:
    """Finds callers by their tokens, for one event loop.

    A key takes one thread of the pool that everybody shares, however many requests carry it at
    once: they share an answer that was asked for while they came. Tokens that were not good
    here before have a few threads to themselves, so that guesses hold up no key.
    """

    def __init__(self) -> None:
        self._under_way: dict[str, asyncio.Task[Caller | None]] = {}
        self._known: OrderedDict[str, None] = OrderedDict()
        self._strangers: CapacityLimiter | None = None

    async def find(self, database: Database, token: str) -> Caller | None:
        """Return whose token this is; None where it is wrong, expired or revoked."""
        digest = digest_of(token)
        asking = self._under_way.get(digest)
        if asking is None:
            asking = asyncio.ensure_future(self._ask(database, token, digest))
            self._under_way[digest] = asking
            asking.add_done_callback(lambda _: self._under_way.pop(digest))
        # Who goes away takes the answer from nobody else.
        return await asyncio.shield(asking)

    async def _ask(self, database: Database, token: str, digest: str) -> Caller | None:
        limiter = None if digest in self._known else self._for_strangers()
        caller = await to_thread.run_sync(_find, database, token, limiter=limiter)
        if caller is None:
            self._known.pop(digest, None)
            return None
        self._known[digest] = None
        self._known.move_to_end(digest)
        if len(self._known) > _MOST_KNOWN:
            self._known.popitem(last=False)
        return caller

    def _for_strangers(self) -> CapacityLimiter:
        # It belongs to the loop that runs when it is first needed.
        if self._strangers is None:
            self._strangers = CapacityLimiter(_THREADS_FOR_STRANGERS)
        return self._strangers


def _find(database: Database, token: str) -> Caller | None:
    with database.reading() as session:
        return key_store.find_caller(session, token)
