"""What exports need of a stored scenario, read from its canonical form target by target.

As objects, a scenario with many targets takes many times the memory of its text.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cached_property
from typing import Any, Final

from planner_core.domain import GroundStation, Horizon, Satellite, Target
from service.scenarios.translate import (
    ground_station_from,
    horizon_from,
    satellite_from,
    target_from,
)
from service.wire.pins import PinsIn, PlacedOutage, StateIn
from service.wire.plan_before import ReplanOfFile
from service.wire.scenarios import FileGroundStation, FileSatellite, FileTarget, HorizonIn
from service.wire.stored import from_store

_TARGETS: Final = "targets"


class StoredQuestion:
    """A scenario file in its canonical form."""

    def __init__(self, content: str):
        self._content = content
        self._decoder = json.JSONDecoder()

    @cached_property
    def horizon(self) -> Horizon:
        """Return the span that is planned."""
        return horizon_from(HorizonIn.model_validate(self._before_targets[0]["horizon"]))

    @cached_property
    def pins(self) -> PinsIn:
        """Return the pins."""
        return from_store(PinsIn, self._part("pins") or {})

    @cached_property
    def outages(self) -> tuple[PlacedOutage, ...]:
        """Return the outages."""
        return tuple(PlacedOutage.model_validate(one) for one in self._part("outages") or ())

    @cached_property
    def states(self) -> tuple[StateIn, ...]:
        """Return the states of satellites before the horizon."""
        return tuple(StateIn.model_validate(one) for one in self._part("states") or ())

    @cached_property
    def replan(self) -> ReplanOfFile | None:
        """Return the plan to go on from."""
        found = self._before_targets[0].get("replan")
        return None if found is None else ReplanOfFile.model_validate(found)

    @cached_property
    def satellites(self) -> tuple[Satellite, ...]:
        """Return the satellites."""
        bodies = (from_store(FileSatellite, one) for one in self._before_targets[0]["satellites"])
        return tuple(satellite_from(body, str(body.id)) for body in bodies)

    @cached_property
    def ground_stations(self) -> tuple[GroundStation, ...]:
        """Return the stations."""
        bodies = (
            from_store(FileGroundStation, one) for one in self._before_targets[0]["ground_stations"]
        )
        return tuple(ground_station_from(body, str(body.id)) for body in bodies)

    def each_target(self) -> Iterator[Target]:
        """Yield the targets, in order."""
        _, at = self._before_targets
        while self._content[at] != "]":
            fields, at = self._decoder.raw_decode(self._content, at)
            body = from_store(FileTarget, fields)
            yield target_from(body, body.catalog_id)
            at += self._content[at] == ","

    def exported(self, name: str | None) -> str:
        """Return the scenario as a file of release 2, in which satellites give all their figures.

        Parameters
        ----------
        name
            The scenario's name, for people; not part of its content.
        """
        members, at = self._before_targets
        satellites = []
        for one in members["satellites"]:
            body = from_store(FileSatellite, one)
            unset = {"oem", "omm", "spacecraft", "tle"} - body.model_fields_set
            satellites.append(body.model_dump(mode="json", exclude=unset))
        head: dict[str, Any] = {} if name is None else {"name": name}
        # A scenario without an objective has the paper's; files of release 2 must say so.
        head |= {"objective": "paper", **members, "release": 2, "satellites": satellites}
        text = json.dumps(head, separators=(",", ":"), allow_nan=False)
        return f'{text[:-1]},"{_TARGETS}":[{self._content[at:]}'

    def _part(self, name: str) -> Any:
        """Return a part that few scenarios have, or None."""
        return self._before_targets[0].get(name) if f'"{name}":' in self._content else None

    @cached_property
    def _before_targets(self) -> tuple[dict[str, Any], int]:
        """Return the members before the targets, and where the list of targets begins.

        Member names are in alphabetical order, and there is no white space.
        """
        members: dict[str, Any] = {}
        at = 1
        while True:
            name, at = self._decoder.raw_decode(self._content, at)
            if name == _TARGETS:
                return members, at + len(":[")
            members[name], at = self._decoder.raw_decode(self._content, at + len(":"))
            at += len(",")
