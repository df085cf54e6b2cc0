"""Work too heavy for a request: done once, in the background, one piece at a time."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final, TypeVar, cast

from planner_core.budget import Budget
from service.problems.kinds import ServiceError

T = TypeVar("T")

_WAIT_S: Final = 20.0
_ASK_AGAIN_S: Final = 5
_MOST_WAITING: Final = 32


class Background:
    """One thread that does the work that requests ask for, and keeps the latest answers.

    A request waits for a while and is then told to ask again; the work goes on.

    A subclass sets ``_kept``, the number of answers to keep, and ``_told``, the message to a
    request that must come back.
    """

    _kept: int
    _told: str

    def __init__(self) -> None:
        name = type(self).__name__.lower()
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix=name)
        self._budget = Budget()
        self._lock = threading.Lock()
        self._known: OrderedDict[str, Future[Any]] = OrderedDict()

    def work_out(self, key: str, work: Callable[[Budget], T]) -> T:
        """Return the result of the work for this key; 503 ``still_computing`` if it takes long.

        Parameters
        ----------
        key
            Identifies the result, which must always be the same.
        """
        future = self._future(key, work)
        try:
            return cast(T, future.result(timeout=_WAIT_S))
        except TimeoutError:
            raise self._later() from None

    def close(self) -> None:
        """Stop the work under way."""
        self._budget.cancel()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _future(self, key: str, work: Callable[[Budget], T]) -> Future[Any]:
        with self._lock:
            future = self._known.get(key)
            if future is None or (future.done() and future.exception() is not None):
                if sum(not one.done() for one in self._known.values()) >= _MOST_WAITING:
                    raise self._later()
                future = self._pool.submit(work, self._budget)
                self._known[key] = future
            self._known.move_to_end(key)
            ended = [name for name, one in self._known.items() if one.done() and name != key]
            for name in ended[: max(len(self._known) - self._kept, 0)]:
                del self._known[name]
            return future

    def _later(self) -> ServiceError:
        headers = {"Retry-After": str(_ASK_AGAIN_S)}
        return ServiceError("still_computing", self._told, headers=headers)
