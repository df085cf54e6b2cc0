"""Spans in which a satellite or a ground station is unavailable."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime

from planner_core.errors import InvalidScenario
from planner_core.pins import PinnedMode


@dataclass(frozen=True, slots=True, kw_only=True)
class Outage:
    """A fact that planning has to accept: a safe mode, a station that is down.

    Attributes
    ----------
    satellite_id, station_id
        What is out; exactly one of them.
    start, end
        No task of these modes overlaps this span.
    modes
        What a satellite cannot do meanwhile. Ignored for a station, which can have no contacts.
    reason
        For people.
    """

    satellite_id: str | None = None
    station_id: str | None = None
    start: datetime
    end: datetime
    modes: tuple[PinnedMode, ...] = ("collect", "contact")
    reason: str | None = None

    def check(
        self, pointer: str, satellite_ids: Collection[str], station_ids: Collection[str]
    ) -> None:
        """Check the outage against what the scenario holds.

        Raises
        ------
        InvalidScenario
            With a pointer that begins with ``pointer``.
        """
        if (self.satellite_id is None) == (self.station_id is None):
            raise InvalidScenario(
                "value_out_of_range", "Name either the satellite or the station.", pointer=pointer
            )
        for name, ids, field in (
            (self.satellite_id, satellite_ids, "satellite_id"),
            (self.station_id, station_ids, "station_id"),
        ):
            if name is not None and name not in ids:
                what = "satellite" if field == "satellite_id" else "ground station"
                raise InvalidScenario(
                    f"unknown_{what.replace(' ', '_')}",
                    f"The scenario has no {what} {name!r}.",
                    pointer=f"{pointer}/{field}",
                )
        if self.end <= self.start:
            raise InvalidScenario(
                "value_out_of_range", "end must be later than start.", pointer=f"{pointer}/end"
            )
        if not self.modes:
            raise InvalidScenario(
                "value_out_of_range", "Name collect, contact or both.", pointer=f"{pointer}/modes"
            )
