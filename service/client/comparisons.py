"""Comparisons: several solvers on one frozen scenario, with one table of their results."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from service.client.collection import Collection
from service.client.following import polled
from service.client.jobs import question
from service.client.transport import parsed
from service.wire.jobs import ComparisonOut as Comparison
from service.wire.scenarios import ScenarioOut as Scenario


class Comparisons(Collection[Comparison]):
    """The comparisons of the service. Deleting one keeps its jobs."""

    _name, _shape = "comparisons", Comparison

    def submit(
        self,
        scenario: str | Scenario | Mapping[str, Any],
        runs: Sequence[Mapping[str, Any]],
        *,
        time_s: float | None = None,
        memory_mb: int | None = None,
        priority: int | None = None,
        label: str | None = None,
        idempotency_key: str | None = None,
    ) -> Comparison:
        """Queue a job for each run, all or none.

        Parameters
        ----------
        scenario
            As for a job.
        runs
            Each with ``solver`` and optionally ``params`` and ``seed``.
        """
        body = question(scenario, time_s, memory_mb, priority, label)
        body["runs"] = [dict(run) for run in runs]
        return self._create(body, idempotency_key)

    def wait(self, comparison_id: str, timeout_s: float | None = None) -> Comparison:
        """Return the table when every job has ended, successfully or not.

        Raises
        ------
        WaitTimedOut
            If a job has not ended after ``timeout_s``.
        """
        read = partial(parsed, Comparison, what="a comparison")
        path = self._path(comparison_id)
        tables = polled(self._transport, path, read, timeout_s=timeout_s, can_hold=False)
        return deque(tables, maxlen=1).pop()
