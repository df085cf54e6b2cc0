"""Identifiers: UUIDv7 strings, which sort by creation time."""

from __future__ import annotations

import secrets
import threading
import time

_lock = threading.Lock()
_last = 0


def new_id() -> str:
    """Return a new UUIDv7; within one process, each is greater than the one before.

    48 bits of milliseconds, 12 bits of the millisecond's fraction (RFC 9562, method 3 of
    section 6.2), then 62 random bits.
    """
    stamp = _next_stamp()
    milliseconds, fraction = stamp >> 12, stamp & 0xFFF
    value = (milliseconds & (1 << 48) - 1) << 80 | 0x7 << 76 | fraction << 64
    digits = f"{value | 0b10 << 62 | secrets.randbits(62):032x}"
    return f"{digits[:8]}-{digits[8:12]}-{digits[12:16]}-{digits[16:20]}-{digits[20:]}"


def _next_stamp() -> int:
    global _last  # noqa: PLW0603 - one clock per process
    nanoseconds = time.time_ns()
    stamp = (nanoseconds // 1_000_000) << 12 | (nanoseconds % 1_000_000) * 4096 // 1_000_000
    with _lock:
        # Keep counting up for two ids within 244 ns, or after the clock was set back.
        _last = max(stamp, _last + 1)
        return _last
