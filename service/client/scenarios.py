"""Scenarios: frozen planning problems, and their opportunities."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any

from service.client.collection import Collection
from service.wire.base import Json
from service.wire.scenarios import OpportunityOut as Opportunity
from service.wire.scenarios import ScenarioOut as Scenario
from service.wire.scenarios import ScenarioSummary


class Scenarios(Collection[ScenarioSummary]):
    """The stored scenarios. One that is used by a job cannot be deleted."""

    _name, _shape = "scenarios", ScenarioSummary

    def create(
        self,
        *,
        start: datetime | str,
        end: datetime | str,
        satellite_ids: Sequence[str],
        target_catalog_ids: Sequence[str],
        ground_station_ids: Sequence[str] = (),
        idempotency_key: str | None = None,
        **optional: Any,
    ) -> Scenario:
        """Freeze a scenario. If the same content is stored already, return that scenario.

        Parameters
        ----------
        start, end
            With a UTC offset; an instant without one is refused.
        optional
            ``name``, ``use_resources``, ``dynamics``, ``collect_spacing_s`` and so on.
        """
        body = {
            "horizon": {"start": _text(start), "end": _text(end)},
            "satellite_ids": list(satellite_ids),
            "target_catalog_ids": list(target_catalog_ids),
            "ground_station_ids": list(ground_station_ids),
            **optional,
        }
        return self._transport.post(
            self._path(), Scenario, json=body, idempotency_key=idempotency_key
        )

    def list(
        self,
        *,
        name: str | None = None,
        satellite_id: str | None = None,
        station_id: str | None = None,
    ) -> Iterator[ScenarioSummary]:
        """Yield the scenarios, newest first, without their pins; ``name`` may be part of a name."""
        return self._listed(name=name, satellite_id=satellite_id, station_id=station_id)

    def get(self, scenario_id: str, /) -> Scenario:
        """Return one scenario."""
        return self._transport.get(self._path(scenario_id), Scenario)

    def file(self, scenario_id: str) -> Json:
        """Return the self-contained scenario file, which ``slewline solve`` also takes."""
        path = self._path(scenario_id)
        answer: Json = self._transport.request("GET", path, params={"expand": True}).json()
        return answer

    def opportunities(
        self,
        scenario_id: str,
        *,
        kind: str | None = None,
        target_id: str | None = None,
        satellite_id: str | None = None,
    ) -> Iterator[Opportunity]:
        """Yield the scenario's opportunities, before any planning, in order of start.

        The service computes them at the first call; until they are ready, the client asks again.
        """
        wanted = {"kind": kind, "target_id": target_id, "satellite_id": satellite_id, "limit": 500}
        path = self._path(scenario_id, "opportunities")
        return self._transport.pages(path, Opportunity, wanted)


def _text(instant: datetime | str) -> str:
    return instant if isinstance(instant, str) else instant.isoformat()
