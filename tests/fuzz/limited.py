"""The work of a process that is given one nasty file and little memory.

The fork server of these processes imports this module, so that they import nothing themselves.
"""

from __future__ import annotations

import resource

import psutil

from tests.fuzz.nasty import NASTIES
from tests.fuzz.parsers import PARSERS

Sizes = tuple[int, int]
"""Size of a file, and of the memory that parsing it may take."""


def parse_one(number: int, sizes: Sizes) -> None:
    """Give one of the nasty files to each parser of its media types."""
    file = NASTIES[number]
    data = file.make(sizes[0])
    _limit_memory(sizes)
    for name, parse in PARSERS.items():
        if name.partition(" ")[2] in file.kinds:
            parse(data)


def hoard(times: int, sizes: Sizes) -> None:
    """Allocate this many times the allowed memory."""
    _limit_memory(sizes)
    bytearray(times * sizes[1])


def _limit_memory(sizes: Sizes) -> None:
    most = psutil.Process().memory_info().vms + sizes[1]
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
