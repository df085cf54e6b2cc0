"""The worker's side of a solver process: start it, enforce its limits, end it."""

from __future__ import annotations

import logging
import math
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Final

import psutil

from planner_core.budget import Progress
from service.answers.chunks import Chunk
from service.jobs import child
from service.jobs.child import (
    CANCEL,
    Answered,
    Ending,
    OpportunitiesFollow,
    Refused,
    Started,
    Stopped,
)
from service.jobs.grace import Grace
from service.jobs.plan_request import PlanRequest
from service.process.parent import held_mb

log = logging.getLogger(__name__)

POLL_S: Final = 0.05
START_S: Final = 120.0
"""How long a first start may take, including compilation of the kernels."""
CANCEL_GRACE_S: Final = 1.25
"""From the cancel request to the kill, for a search that does not stop by itself."""
_LAST_WORDS_S: Final = 5.0
"""How long a process may take to end after its pipe has closed."""

_UNKNOWN_EXIT: Final = 255
"""Exit status that `multiprocessing` reports if the fork server, which alone knows it, is gone."""

_SINGLE_THREADED: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


class Order(Enum):
    """What the worker wants a run to do; asked at every tick."""

    GO_ON = auto()
    CANCEL = auto()
    ABANDON = auto()


@dataclass(frozen=True, slots=True)
class Abandoned:
    """The run was ended without an answer: another worker will do the job."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The process died together with the fork server; the job is not to blame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one solver process may use. Memory is all it holds, including shared libraries."""

    time_s: float
    memory_mb: int
    num_threads: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """What solver processes do.

    Attributes
    ----------
    function
        ``"module:function"``, called with a ``PlanRequest`` and a ``Budget``.
    preload
        Module that the fork server imports before its first fork.
    """

    function: str = "service.jobs.plan_job:run_plan_job"
    preload: str = "service.jobs.preload"


class Runner:
    """Runs one piece of work at a time, each in a fresh fork of a warm process."""

    def __init__(self, work: Work):
        # Libraries start no threads of their own, since the workers share the machine.
        os.environ |= dict.fromkeys(_SINGLE_THREADED, "1")
        self._work = work
        self._context = get_context("forkserver")
        self._context.set_forkserver_preload([work.preload])

    def warm_up(self, is_wanted: Callable[[], bool] = lambda: True) -> bool:
        """Start the fork server; return whether it got ready before ``is_wanted`` said no."""
        process = self._context.Process(target=_nothing, daemon=True)
        process.start()
        while process.is_alive() and is_wanted():
            process.join(POLL_S)
        is_ready = not process.is_alive()
        _end(process)
        return is_ready

    def run(
        self,
        request: PlanRequest,
        limits: Limits,
        *,
        tick_s: float,
        tick: Callable[[Progress | None], Order],
        on_phase: Callable[[str], None] = lambda _: None,
    ) -> Ending | Abandoned | Lost:
        """Do the work and return how it ended.

        Parameters
        ----------
        tick
            Called every ``tick_s`` with the newest progress, or None if there is nothing new;
            returns how to go on.
        on_phase
            Called with the name of each phase when it begins.
        """
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=child.main,
            args=(theirs, self._work.function, request, limits.time_s, limits.num_threads),
            daemon=True,
        )
        try:
            process.start()
            theirs.close()
            request.opportunity_block.take()  # already sent: only the solver needs it
            return _Run(process, ours, limits, tick_s, tick, on_phase).until_end()
        finally:
            ours.close()
            _end(process)


@dataclass(slots=True)
class _Run:
    """One running process."""

    process: BaseProcess
    pipe: Connection[Any, Any]
    limits: Limits
    tick_s: float
    tick: Callable[[Progress | None], Order]
    on_phase: Callable[[str], None]
    _phase: str | None = None
    _progress: Progress | None = None
    _blocks: list[Chunk] = field(default_factory=list)
    _opportunity_block: bytes | None = None
    _has_grace: bool = False
    _grace: Grace | None = None
    _next_tick_s: float = 0.0
    _expire_at_s: float = math.inf
    _started: bool = False
    _cancelled: bool = False
    _kill_at_s: float = field(default_factory=lambda: time.monotonic() + START_S)

    def until_end(self) -> Ending | Abandoned | Lost:
        while True:
            ending = self._listen() or self._check_limits() or self._tick_if_due()
            if ending is not None:
                return ending

    def _listen(self) -> Ending | Lost | None:
        """Wait briefly for messages and read all that are there: one may be the answer."""
        timeout_s = POLL_S
        while wait([self.pipe], timeout_s):
            ending: Ending | Lost | None
            try:
                ending = self._hear(self.pipe.recv())
            except (EOFError, OSError):
                ending = self._crashed()
            if ending is not None:
                return ending
            timeout_s = 0.0
        return None

    def _hear(self, message: object) -> Ending | None:
        if isinstance(message, Answered):
            chunks, opportunities = tuple(self._blocks), self._opportunity_block
            return Answered(replace(message.answer, chunks=chunks, opportunity_block=opportunities))
        if isinstance(message, Refused | Stopped):
            is_late = isinstance(message, Stopped) and not self._cancelled
            return self._out_of_time() if is_late else message
        if isinstance(message, Chunk):
            self._blocks.append(message)
        elif isinstance(message, OpportunitiesFollow):
            self._opportunity_block = self.pipe.recv_bytes()
        elif isinstance(message, Started):
            self._started = True
            self._expire_at_s = time.monotonic() + self.limits.time_s
            self._kill_at_s = math.inf
        elif isinstance(message, Progress):
            self._note(message)
        return None

    def _note(self, progress: Progress) -> None:
        self._progress = progress
        if progress.phase != self._phase:
            self._phase = progress.phase
            self.on_phase(progress.phase)
            if self._has_grace:
                self._grant_grace()

    def _grant_grace(self) -> None:
        """Limit the rest of this phase; the next phase gets a grace of its own."""
        self._has_grace = True
        if self._cancelled and self._phase != "verify":
            self._kill_at_s = min(self._kill_at_s, time.monotonic() + CANCEL_GRACE_S)
            return
        # After the search there is a plan, which is worth the wait.
        self._kill_at_s = math.inf
        with suppress(psutil.NoSuchProcess):  # ended; its last messages are still to be read
            self._grace = Grace(self.process.pid or 0, self._phase or "access")

    def _crashed(self) -> Ending | Lost:
        self.process.join(_LAST_WORDS_S)
        if self._cancelled:
            return Stopped()
        code = self.process.exitcode
        if code == _UNKNOWN_EXIT:
            return Lost()
        how = f"signal {-code}" if code is not None and code < 0 else f"exit status {code}"
        return Refused("solver_crashed", f"The solver's process ended unexpectedly ({how}).")

    def _check_limits(self) -> Ending | None:
        now_mb = held_mb(self.process.pid)  # 0 if it has ended; its messages are still read
        if now_mb > self.limits.memory_mb:
            detail = f"The solver used {now_mb:.0f} MB; its limit is {self.limits.memory_mb} MB."
            return Refused("memory_limit", detail)
        now_s = time.monotonic()
        if now_s >= self._expire_at_s:
            # The budget ends the search.
            self._expire_at_s = math.inf
            self._grant_grace()
        # A process that has ended is not killed: its last messages are still to be read.
        if now_s >= self._kill_at_s or (self._grace is not None and self._grace.is_over()):
            return Stopped() if self._cancelled else self._out_of_time()
        return None

    def _out_of_time(self) -> Refused:
        if not self._started:
            return Refused("solver_crashed", "The solver's process did not start.")
        detail = f"No plan within the limit of {self.limits.time_s:g} s."
        return Refused("time_limit", detail)

    def _tick_if_due(self) -> Abandoned | None:
        now_s = time.monotonic()
        if now_s < self._next_tick_s:
            return None
        self._next_tick_s = now_s + self.tick_s
        progress, self._progress = self._progress, None
        order = self.tick(progress)
        if order is Order.ABANDON:
            return Abandoned()
        if order is Order.CANCEL and not self._cancelled:
            self._cancelled = True
            self._grant_grace()
            self._cancel()
        return None

    def _cancel(self) -> None:
        try:
            self.pipe.send(CANCEL)
        except OSError:
            log.debug("the solver's process ended before it was cancelled")


def _nothing() -> None:
    pass


def _end(process: BaseProcess) -> None:
    """End a process, with half a second to terminate before it is killed, and reap it."""
    if process.pid is None:
        return
    if process.is_alive():
        process.terminate()
        process.join(0.5)
    if process.is_alive():
        process.kill()
    process.join()
    process.close()
