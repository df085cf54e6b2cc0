"""A progress bar on one line; without a terminal, a line every half minute."""

from __future__ import annotations

import time
from typing import Final, TextIO

_WIDTH: Final = 30
_QUIET_S: Final = 30.0


class ProgressBar:
    """Shows how much of the study is done, and how much time it may still take."""

    def __init__(self, stream: TextIO, total: int, deadline: float):
        self._stream, self._total, self._deadline = stream, total, deadline
        self._every_s = 0.2 if stream.isatty() else _QUIET_S
        self._shown = 0.0

    def show(self, done: int, phase: str, *, always: bool = False) -> None:
        """Draw the bar if it is due."""
        now = time.time()
        if not always and now - self._shown < self._every_s:
            return
        self._shown = now
        share = done / self._total if self._total else 1.0
        bar = "#" * round(share * _WIDTH)
        left_min = max(0.0, self._deadline - now) / 60.0
        text = (
            f"[{bar:<{_WIDTH}}] {done}/{self._total} runs, {phase}, at most {left_min:.0f} min more"
        )
        is_live = self._stream.isatty()
        self._stream.write(f"\r{text:<100}" if is_live else text + "\n")
        self._stream.flush()

    def close(self) -> None:
        """End the line."""
        if self._stream.isatty():
            self._stream.write("\n")
