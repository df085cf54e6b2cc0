"""The jobs of the chaos suite: several tenants, some over HTTP, some cancelled."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from functools import partial

from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from service.db.failures import why_unavailable
from service.db.ids import new_id
from tests.service.jobs.chaos.api import Api
from tests.service.jobs.conftest import Jobs

GIANT = "giant"
SMALL = ("small-1", "small-2", "small-3")
_SHORT_S = (0.2, 1.2)
_LEASES_OF_A_LONG_JOB = 2.0
_NEVER_ENDING_S = 3000.0


class Load:
    """Submits jobs through every outage, and knows each one's expected outcome.

    Attributes
    ----------
    promised
        The state that each job must end in, by its id.
    """

    def __init__(self, jobs: Jobs, api: Api, seed: int):
        self.promised: dict[str, str] = {}
        self._jobs = jobs
        self._api = api
        self._random = random.Random(seed)

    def submit(self, number: int) -> None:
        """Submit this number of jobs: half by one tenant first, then the others in turn."""
        half = number // 2
        for _ in range(half):
            self._put(GIANT)
        by_turns: tuple[Callable[[], None], ...] = (
            *(partial(self._put, tenant) for tenant in SMALL),
            self._post,
            self._post_and_cancel,
        )
        for place in range(number - half):
            by_turns[place % len(by_turns)]()

    def _put(self, tenant: str) -> None:
        """Submit a job: a quick one, a short one, or one that still runs when taken over."""
        long_s = _LEASES_OF_A_LONG_JOB * self._jobs.settings.lease_s
        time_s = self._random.choice((self._random.uniform(*_SHORT_S), long_s))
        solver = self._random.choice(("answer", "search"))
        limits = {"time_s": time_s, "memory_mb": 2048}
        job_id = new_id()
        while True:
            try:
                self._jobs.submit(solver, job_id=job_id, tenant=tenant, limits=limits)
                break
            except IntegrityError:
                break  # an earlier attempt was stored, though it seemed to fail
            except SQLAlchemyError as error:
                if why_unavailable(error) is None:
                    raise
                time.sleep(0.2)
        self.promised[job_id] = "succeeded"

    def _post(self) -> None:
        solver = self._random.choice(("rule", "forward_search"))
        limits = {"time_s": self._random.uniform(*_SHORT_S)}
        self.promised[self._post_job(solver, limits)] = "succeeded"

    def _post_and_cancel(self) -> None:
        job_id = self._post_job("forward_search", {"time_s": _NEVER_ENDING_S})
        time.sleep(self._random.uniform(0.0, 0.5))
        self._api.cancel(job_id)
        self.promised[job_id] = "cancelled"

    def _post_job(self, solver: str, limits: dict[str, float]) -> str:
        body = {"scenario_id": self._jobs.scenario_id, "solver": solver, "limits": limits}
        return self._api.post_job(body | {"label": f"job {len(self.promised)}"})
