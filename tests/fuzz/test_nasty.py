"""No file takes the service's parsers long, or much memory, or makes one raise."""

from __future__ import annotations

import resource
from collections.abc import Callable
from multiprocessing import get_context
from typing import Final

import psutil
import pytest

from tests.fuzz.nasty import NASTIES
from tests.fuzz.odd_values import ODD_FILES
from tests.fuzz.parsers import PARSERS

SIZE: Final = 2_000_000
MEMORY: Final = 250_000_000
"""A good hundred bytes for each of the file: JSON takes about thirty at most."""
DEADLINE_S: Final = 120.0
"""Far beyond the second or two that the slowest take: for what would take hours."""

CONTEXT = get_context("forkserver")
CONTEXT.set_forkserver_preload(["tests.fuzz.parsers"])


@pytest.mark.parametrize("number", range(len(NASTIES)), ids=[file.name for file in NASTIES])
def test_a_nasty_file_is_no_danger(number: int) -> None:
    assert status_of(parse_one, number) == 0


def test_what_takes_too_much_memory_is_noticed() -> None:
    assert status_of(hoard, 2 * MEMORY) == 1


def status_of(work: Callable[[int], None], argument: int) -> int | None:
    """Return the exit status of a process that does some work, below zero where it was killed."""
    process = CONTEXT.Process(target=work, args=(argument,))
    process.start()
    process.join(DEADLINE_S)
    if process.is_alive():
        process.kill()
        process.join()
    return process.exitcode


def parse_one(number: int) -> None:
    """Give one of the nasty files to each parser of its kinds."""
    file = NASTIES[number]
    data = file.make(SIZE)
    limit_memory()
    for name, parse in PARSERS.items():
        if name.partition(" ")[2] in file.kinds:
            parse(data)


def hoard(size: int) -> None:
    limit_memory()
    bytearray(size)


def limit_memory() -> None:
    most = psutil.Process().memory_info().vms + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


@pytest.mark.parametrize("parser", PARSERS)
def test_odd_values_are_refused_or_read_as_what_they_are(parser: str) -> None:
    kind = parser.partition(" ")[2]
    for name, kinds, data in ODD_FILES:
        if kind in kinds:
            try:
                PARSERS[parser](data)
            except Exception as error:
                raise AssertionError(f"{name}: {data[:300]!r}") from error
