"""Slots for concurrent requests: limited in all and for each owner, with a fair queue."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from service.problems.kinds import ServiceError

_ASK_AGAIN_S: Final = 5


class Slots:
    """Lets ``most`` requests hold a slot, ``of_owner`` of one owner; others wait or are refused.

    First come, first served, except for requests whose owner holds all its slots already. For one
    event loop.

    Parameters
    ----------
    waiting, waiting_of_owner
        How many may wait for a slot; more are refused at once (503 ``too_busy``).
    wait_s
        How long they wait before they are refused.
    """

    def __init__(
        self,
        most: int,
        of_owner: int,
        *,
        waiting: int = 0,
        waiting_of_owner: int = 0,
        wait_s: float = 0.0,
    ):
        self._most = most
        self._of_owner = of_owner
        self._waiting = waiting
        self._waiting_of_owner = waiting_of_owner
        self._wait_s = wait_s
        self._held: Counter[str] = Counter()
        self._queue: dict[asyncio.Future[None], str] = {}

    @asynccontextmanager
    async def held(self, owner: str) -> AsyncIterator[None]:
        """Hold a slot, after waiting for one if none is free."""
        await self._take(owner)
        try:
            yield
        finally:
            self._give_back(owner)

    async def _take(self, owner: str) -> None:
        if self._has_place(owner):
            self._held[owner] += 1
            return
        waiting = list(self._queue.values())
        if len(waiting) >= self._waiting or waiting.count(owner) >= self._waiting_of_owner:
            raise _too_busy()
        turn = asyncio.get_running_loop().create_future()
        self._queue[turn] = owner
        try:
            await asyncio.wait_for(turn, self._wait_s)
        except TimeoutError:
            raise _too_busy() from None
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._give_back(owner)  # it was given the slot and has gone
            raise
        finally:
            self._queue.pop(turn, None)

    def _has_place(self, owner: str) -> bool:
        return self._held.total() < self._most and self._held[owner] < self._of_owner

    def _give_back(self, owner: str) -> None:
        self._held[owner] -= 1
        if not self._held[owner]:
            del self._held[owner]
        for turn, waiting in list(self._queue.items()):
            if not turn.done() and self._has_place(waiting):
                self._held[waiting] += 1
                turn.set_result(None)


def _too_busy() -> ServiceError:
    return ServiceError(
        "too_busy",
        "Too many requests of this kind are in progress, for this owner or in total.",
        headers={"Retry-After": str(_ASK_AGAIN_S)},
    )
