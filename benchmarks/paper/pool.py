"""Tasks over all cores, until they are done or the time is up."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing.process import BaseProcess
from types import TracebackType

from benchmarks.paper.measure import Outcome, Task, run_task


class Pool:
    """One process per core, each with one task at a time, as on the paper's machine."""

    def __init__(self, workers: int, deadline: float):
        # Fresh processes: a fork would share the state of HiGHS and numba.
        context = multiprocessing.get_context("spawn")
        self._executor = ProcessPoolExecutor(
            workers, mp_context=context, initializer=_end_with_parent
        )
        self._workers, self._deadline = workers, deadline

    def __enter__(self) -> Pool:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._executor.shutdown(wait=error is None, cancel_futures=True)

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Outcome]]:
        """Yield each task with its outcome as it finishes; skip the rest after the deadline."""
        waiting = iter(tasks)
        running: dict[Future[Outcome | None], Task] = {}
        while True:
            # One more than there are workers, so that no worker waits for this process.
            while len(running) <= self._workers and time.time() < self._deadline:
                task = next(waiting, None)
                if task is None:
                    break
                running[self._executor.submit(run_task, task, self._deadline)] = task
            if not running:
                return
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                task, outcome = running.pop(future), future.result()
                if outcome is not None:
                    yield task, outcome


def _end_with_parent() -> None:
    """Make this process end when its parent does, even if the parent is killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_outlive_nobody, args=(parent,), daemon=True).start()


def _outlive_nobody(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
