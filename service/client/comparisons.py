"""Comparisons: several solvers on one frozen scenario, and one table of what they found."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from service.client.following import polled
from service.client.jobs import question
from service.client.transport import Transport, parsed, path_of
from service.wire.jobs import ComparisonOut as Comparison
from service.wire.scenarios import ScenarioOut as Scenario


class Comparisons:
    """The comparisons of the service."""

    def __init__(self, transport: Transport):
        self._transport = transport

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
            Each with ``solver`` and, where wanted, ``params`` and ``seed``.
        """
        body = question(scenario, time_s, memory_mb, priority, label)
        body["runs"] = [dict(run) for run in runs]
        return self._transport.post(
            path_of("comparisons"), Comparison, json=body, idempotency_key=idempotency_key
        )

    def list(self) -> Iterator[Comparison]:
        """Yield the comparisons, newest first."""
        return self._transport.pages(path_of("comparisons"), Comparison)

    def get(self, comparison_id: str) -> Comparison:
        """Return the table as it stands."""
        return self._transport.get(path_of("comparisons", comparison_id), Comparison)

    def delete(self, comparison_id: str) -> None:
        """Delete a comparison; its jobs stay."""
        self._transport.delete(path_of("comparisons", comparison_id))

    def wait(self, comparison_id: str, timeout_s: float | None = None) -> Comparison:
        """Return the table once every job has ended, well or not.

        Raises
        ------
        WaitTimedOut
            Where one has not after ``timeout_s``.
        """
        path = path_of("comparisons", comparison_id)
        read = partial(parsed, Comparison, what="a comparison")
        tables = polled(self._transport, path, read, timeout_s=timeout_s, can_hold=False)
        return deque(tables, maxlen=1).pop()
