"""The solver's process: what happens between fork and exit.

It talks to its worker over one pipe: ``CANCEL`` comes in; progress, the chunks of an answer and
finally one ending go out. If the worker's end closes, the process exits at once.
"""

from __future__ import annotations

import importlib
import logging
import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any, Final, cast

from planner_core.budget import Budget, Progress
from planner_core.errors import Cancelled, PlannerError
from service.jobs.plan_request import PlanAnswer, PlanRequest
from service.process.parent import die_with_parent

log = logging.getLogger(__name__)

REPORT_EVERY_S: Final = 0.1

CANCEL: Final = "cancel"
"""The only command that the worker sends."""

WorkFunction = Callable[[PlanRequest, Budget], PlanAnswer]


@dataclass(frozen=True, slots=True)
class Started:
    """The first message: the kernels are loaded and the clock runs."""


@dataclass(frozen=True, slots=True)
class OpportunitiesFollow:
    """The next message is the answer's opportunity block, as raw bytes."""


@dataclass(frozen=True, slots=True)
class Answered:
    """The work is done, or was cut short but still has a plan."""

    answer: PlanAnswer


@dataclass(frozen=True, slots=True)
class Refused:
    """The work cannot be done."""

    code: str
    detail: str


@dataclass(frozen=True, slots=True)
class Stopped:
    """The work was told to stop before there was any plan."""


Ending = Answered | Refused | Stopped


def main(
    connection: Connection[Any, Any],
    work: str,
    request: PlanRequest,
    time_s: float,
    num_threads: int,
) -> None:
    """Do one piece of work and send how it ended.

    Parameters
    ----------
    work
        The work function as ``"module:function"``.
    time_s, num_threads
        The budget.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent(signal.SIGKILL)
    outbox = _Outbox(connection)
    budget = Budget(time_s, outbox.report, num_threads)
    outbox.send(Started())
    threading.Thread(target=_obey, args=(connection, budget), daemon=True).start()
    ending = _do(load(work), request, budget)
    if isinstance(ending, Answered):
        # In pieces, so that neither side also holds the whole answer as one message.
        answer = ending.answer
        for chunk in answer.chunks:
            outbox.send(chunk)
        if answer.opportunity_block is not None:
            outbox.send_opportunities(answer.opportunity_block)
        ending = Answered(replace(answer, chunks=(), opportunity_block=None))
    outbox.send(ending)


def load(name: str) -> WorkFunction:
    """Return the function called ``"module:function"``."""
    module, _, function = name.partition(":")
    return cast(WorkFunction, getattr(importlib.import_module(module), function))


def _do(work: WorkFunction, request: PlanRequest, budget: Budget) -> Ending:
    try:
        return Answered(work(request, budget))
    except Cancelled:
        return Stopped()
    except PlannerError as error:
        return Refused(error.code, error.detail)
    except MemoryError:
        return Refused("memory_limit", "The solver ran out of memory.")
    except Exception:
        log.exception("job failed", extra={"job_id": request.job_id, "run": request.run})
        return Refused("internal_error", "The planner failed. The log has the details.")


class _Outbox:
    """The sending side: at most one report per ``REPORT_EVERY_S`` and phase, from any thread."""

    def __init__(self, connection: Connection[Any, Any]):
        self._connection = connection
        self._lock = threading.Lock()
        self._phase: str | None = None
        self._next_s = 0.0

    def send(self, message: object) -> None:
        with self._lock:
            self._connection.send(message)

    def send_opportunities(self, block: bytes) -> None:
        with self._lock:
            self._connection.send(OpportunitiesFollow())
            self._connection.send_bytes(block)

    def report(self, progress: Progress) -> None:
        now_s = time.monotonic()
        if progress.phase == self._phase and now_s < self._next_s:
            return
        self._phase, self._next_s = progress.phase, now_s + REPORT_EVERY_S
        self.send(progress)


def _obey(connection: Connection[Any, Any], budget: Budget) -> None:
    while True:
        try:
            command = connection.recv()
        except (EOFError, OSError):
            # Nobody waits for an answer. An orderly exit would wait for threads and kernels.
            os._exit(1)
        if command == CANCEL:
            budget.cancel()
