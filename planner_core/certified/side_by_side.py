"""Pieces of work side by side, on as many threads as a search may use."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeAlias

Together: TypeAlias = Callable[..., None]
"""Runs pieces of work, and returns once all are done."""


@contextmanager
def side_by_side(num_threads: int) -> Iterator[Together]:
    """Yield a function that runs pieces of work on so many threads; on the caller's if only one.

    >>> with side_by_side(1) as do:
    ...     do(lambda: print("a plan"), lambda: print("a bound"))
    a plan
    a bound
    """
    if num_threads == 1:
        yield _in_turn
        return
    with ThreadPoolExecutor(num_threads) as threads:

        def together(*work: Callable[[], object]) -> None:
            for each in [threads.submit(one) for one in work]:
                each.result()

        yield together


def _in_turn(*work: Callable[[], object]) -> None:
    for one in work:
        one()
