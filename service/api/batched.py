"""Batched queries: requests for the same kind of answer at the same time share one query."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, Generic, TypeVar

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")

_LONGEST_PAUSE_S: Final = 0.1
_PAUSE_EACH_S: Final = 0.02
_MOST_KEYS: Final = 500


class BatchedQueries(Generic[K, T]):
    """Gathers the keys that are asked for while a query runs, and queries them all in the next.

    No answer is older than its question: the query that answers it begins after it was asked.
    A single request does not wait. The more requests have shared a query, the longer the pause
    before the next one: many clients cost no more than ten queries a second.

    For one event loop; the queries run in a thread of their own, one at a time.

    Parameters
    ----------
    ask
        Returns what is found for these keys, which are all different.
    longest_pause_s
        0 if nobody should wait for longer than the previous query takes.
    """

    def __init__(
        self,
        ask: Callable[[Sequence[K]], Mapping[K, T]],
        *,
        longest_pause_s: float = _LONGEST_PAUSE_S,
    ):
        self._ask = ask
        self._longest_pause_s = longest_pause_s
        # The loop's ``run_in_executor`` costs less than Starlette's, which can be cancelled.
        self._thread = ThreadPoolExecutor(1, "batched-queries")
        self._is_asking = asyncio.Lock()
        self._gathering: tuple[list[K], asyncio.Task[Mapping[K, T]]] | None = None
        self._not_before_s = 0.0

    async def get(self, key: K) -> T | None:
        """Return what is found for a key now, or None; raise what the query raises."""
        if self._is_idle:
            # A single request: no task is needed for others to wait for.
            async with self._is_asking:
                loop = asyncio.get_running_loop()
                return (await loop.run_in_executor(self._thread, self._ask, [key])).get(key)
        if self._gathering is None:
            keys: list[K] = []
            self._gathering = keys, asyncio.create_task(self._answer(keys))
        keys, answers = self._gathering
        keys.append(key)
        # A client that disconnects must not cancel the answer of the others.
        return (await asyncio.shield(answers)).get(key)

    @property
    def _is_idle(self) -> bool:
        if self._gathering is not None or self._is_asking.locked():
            return False
        return asyncio.get_running_loop().time() >= self._not_before_s

    async def _answer(self, keys: list[K]) -> Mapping[K, T]:
        async with self._is_asking:
            loop = asyncio.get_running_loop()
            await asyncio.sleep(self._not_before_s - loop.time())
            self._gathering = None
            pause_s = min(self._longest_pause_s, _PAUSE_EACH_S * (len(keys) - 1))
            self._not_before_s = loop.time() + pause_s
            different = list(dict.fromkeys(keys))
            return await loop.run_in_executor(self._thread, self._ask_in_parts, different)

    def _ask_in_parts(self, keys: Sequence[K]) -> Mapping[K, T]:
        # A query has a limited number of parameters. More than one part is rare: so many keys at
        # once mean that the database did not answer for a while.
        answers: dict[K, T] = {}
        for first in range(0, len(keys), _MOST_KEYS):
            answers |= self._ask(keys[first : first + _MOST_KEYS])
        return answers
