"""``python -m service.jobs``: one worker process, as started by the supervisor."""

from __future__ import annotations

import argparse
import atexit
import logging
import os
import signal
from typing import NoReturn

from service.process.imports import importing

with importing():
    from service.jobs.runner import Work
    from service.jobs.worker import Worker
    from service.process.logs import configure_logging
    from service.process.parent import die_with_parent
    from service.process.tracing import start_tracing
    from service.settings import Settings

log = logging.getLogger(__name__)


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run a worker until SIGTERM, or until the ``--supervisor`` process is gone."""
    parser = argparse.ArgumentParser(prog="python -m service.jobs")
    parser.add_argument("--work", default=Work().function, help="module:function")
    parser.add_argument("--preload", default=Work().preload, help="module")
    parser.add_argument("--supervisor", type=int, default=None, help="process id")
    options = parser.parse_args(arguments)
    run_worker(
        Settings(),
        Work(function=options.work, preload=options.preload),
        supervisor=options.supervisor,
    )


def run_worker(settings: Settings, work: Work, *, supervisor: int | None = None) -> NoReturn:
    """Run one worker in this process's main thread, then exit the process."""
    configure_logging()
    spans = start_tracing(settings, "worker")
    worker = Worker(settings, work)
    signal.signal(signal.SIGTERM, lambda *_: worker.stop())
    signal.signal(signal.SIGINT, lambda *_: worker.stop())
    status = 0
    try:
        if supervisor is None:
            worker.run()
        else:
            die_with_parent(signal.SIGTERM)
            worker.run(lambda: os.getppid() == supervisor)
    except Exception:
        log.exception("the worker failed")
        status = 1
    # A thread of the queue's library may still be trying to write to a database that hangs. The
    # data is not needed, and an ordinary exit would wait for that thread for minutes.
    if spans is not None:
        spans.shutdown()
    # Exit handlers clean up, for example the folder of the fork server's socket.
    atexit._run_exitfuncs()
    os._exit(status)


if __name__ == "__main__":
    main()
