"""Imported by a worker's fork server, and only there: importing it warms the solvers up.

Each job's process is a fork of that server and finds everything loaded.
"""

from __future__ import annotations

import logging

from service.process.imports import importing

with importing():
    from service.jobs import child, plan_job  # noqa: F401 - what a job's process begins with
    from service.jobs.warm import warm_up

    try:
        warm_up()
    except Exception:
        # An exception here would end the fork server without a word; each job will tell its own.
        logging.getLogger(__name__).exception("warm-up failed")
