"""No file takes the service's parsers long or much memory, or makes one raise."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing import get_context
from typing import Final

import pytest

from tests.fuzz.limited import Sizes, hoard, parse_one
from tests.fuzz.nasty import NASTIES
from tests.fuzz.odd_values import ODD_FILES
from tests.fuzz.parsers import PARSERS

SIZES: Final = [
    (200_000, 50_000_000),
    pytest.param((2_000_000, 250_000_000), marks=pytest.mark.full_size),
]
"""At least 125 bytes of memory per byte of the file; JSON takes at most about thirty."""
DEADLINE_S: Final = 120.0
"""Far beyond the second or two of the slowest: it catches files that would take hours."""

CONTEXT = get_context("forkserver")
CONTEXT.set_forkserver_preload([parse_one.__module__])


@pytest.mark.parametrize("sizes", SIZES, ids=lambda sizes: f"{sizes[0] // 1000} kB")
@pytest.mark.parametrize("number", range(len(NASTIES)), ids=[file.name for file in NASTIES])
def test_a_nasty_file_is_no_danger(number: int, sizes: Sizes) -> None:
    assert status_of(parse_one, number, sizes) == 0


@pytest.mark.parametrize("sizes", SIZES, ids=lambda sizes: f"{sizes[0] // 1000} kB")
def test_what_takes_too_much_memory_is_noticed(sizes: Sizes) -> None:
    assert status_of(hoard, 2, sizes) == 1


def status_of(work: Callable[[int, Sizes], None], argument: int, sizes: Sizes) -> int | None:
    """Return the exit status of a process that does some work; negative if it was killed."""
    process = CONTEXT.Process(target=work, args=(argument, sizes))
    process.start()
    process.join(DEADLINE_S)
    if process.is_alive():
        process.kill()
        process.join()
    return process.exitcode


@pytest.mark.parametrize("parser", PARSERS)
def test_odd_values_are_refused_or_read_as_what_they_are(parser: str) -> None:
    kind = parser.partition(" ")[2]
    for name, kinds, data in ODD_FILES:
        if kind in kinds:
            try:
                PARSERS[parser](data)
            except Exception as error:
                raise AssertionError(f"{name}: {data[:300]!r}") from error
