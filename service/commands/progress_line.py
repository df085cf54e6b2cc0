"""One line of progress of a job; a line now and then if the output is not a terminal."""

from __future__ import annotations

import shutil
import threading
import time
from typing import Final, Self, TextIO

from service.client import Job

_WIDTH: Final = 24
_REDRAW_S: Final = 0.25
_QUIET_S: Final = 30.0


class ProgressLine:
    """Shows state, phase, reward, bound and the seconds since it was opened.

    On a terminal the line is redrawn continually, since the seconds go on without news of the
    job. Elsewhere, a line is written when the phase changes, or half a minute after the
    last one.
    """

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._is_live = stream.isatty()
        self._began_s = time.monotonic()
        self._job: Job | None = None
        self._written: tuple[str, float] = ("", 0.0)
        self._drawing = threading.Lock()
        self._is_over = threading.Event()
        self._clock = threading.Thread(target=self._redraw, daemon=True)

    def __enter__(self) -> Self:
        if self._is_live:
            self._clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        if self._is_live:
            self._clock.join()
            self._stream.write("\n")

    def show(self, job: Job) -> None:
        """Show the job's state."""
        self._job = job
        if self._is_live:
            self._draw(job)
            return
        phase, now_s = _phase(job), time.monotonic()
        if phase != self._written[0] or now_s - self._written[1] >= _QUIET_S:
            self._written = (phase, now_s)
            self._stream.write(self._text(job) + "\n")
            self._stream.flush()

    def _redraw(self) -> None:
        while not self._is_over.wait(_REDRAW_S):
            if self._job is not None:
                self._draw(self._job)

    def _draw(self, job: Job) -> None:
        columns = shutil.get_terminal_size().columns - 1
        with self._drawing:
            self._stream.write("\r" + self._text(job)[:columns].ljust(columns))
            self._stream.flush()

    def _text(self, job: Job) -> str:
        elapsed_s = time.monotonic() - self._began_s
        return f"{progress_text(job)}  {elapsed_s:.0f} s"


def progress_text(job: Job) -> str:
    """Return the state of a job in one line, without the time."""
    progress = job.progress
    if job.state not in ("running", "cancelling") or progress is None:
        return f"{job.state:<10}"
    bar = "#" * round(min(max(progress.fraction, 0.0), 1.0) * _WIDTH)
    parts = [f"{_phase(job):<10} [{bar:<{_WIDTH}}]"]
    if progress.reward is not None:
        parts.append(f"reward {progress.reward:g}")
    if progress.bound is not None:
        parts.append(f"bound {progress.bound:g}")
    return "  ".join(parts)


def _phase(job: Job) -> str:
    is_working = job.state == "running" and job.progress is not None
    return job.progress.phase if is_working and job.progress else job.state
