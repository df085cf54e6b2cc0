"""Imported only by a worker's fork server: importing it warms up the solvers.

Each job's process is forked from that server, with everything loaded.
"""

from __future__ import annotations

import logging

from service.process.imports import importing

with importing():
    from service.jobs import child, plan_job  # noqa: F401 - what a job's process needs first
    from service.jobs.warm import warm_up

    try:
        warm_up()
    except Exception:
        # An exception here would end the fork server silently; each job will report its own.
        logging.getLogger(__name__).exception("warm-up failed")
