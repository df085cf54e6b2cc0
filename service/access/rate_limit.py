"""A token bucket for each caller, in the memory of this process."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

MOST_CALLERS: Final = 50_000
"""Beyond this number, the least recently used bucket is forgotten, and full again later."""


class RateLimiter:
    """Lets each caller make ``per_s`` requests a second, and up to ``burst`` at once.

    For use in one thread, the server's event loop.
    """

    def __init__(self, per_s: float, burst: int, clock: Callable[[], float] = time.monotonic):
        self._per_s = per_s
        self._burst = burst
        self._clock = clock
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, caller: str) -> float:
        """Count one request.

        Returns
        -------
        Seconds until the caller may try again; 0 if the request may pass.
        """
        now_s = self._clock()
        # Put back at the end, so that the least recently used one comes first.
        tokens, filled_s = self._buckets.pop(caller, (self._burst, now_s))
        tokens = min(self._burst, tokens + (now_s - filled_s) * self._per_s)
        wait_s = max(0.0, (1.0 - tokens) / self._per_s)
        self._buckets[caller] = tokens if wait_s else tokens - 1.0, now_s
        if len(self._buckets) > MOST_CALLERS:
            self._buckets.popitem(last=False)
        return wait_s
