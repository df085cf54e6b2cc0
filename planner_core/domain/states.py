"""What is known of a satellite before the horizon begins."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from datetime import datetime, timedelta
from typing import Final

from planner_core.domain.horizon import Horizon
from planner_core.errors import InvalidScenario

OLDEST_STATE: Final = timedelta(days=7)
"""Before the horizon; idling for longer says nothing of where a satellite is."""

_UNIT: Final = 1e-3  # how far from 1 the length of a unit vector may be


@dataclass(frozen=True, slots=True, kw_only=True)
class Attitude:
    """Where a satellite looks: exactly one of these.

    Attributes
    ----------
    opportunity_id
        Of the scenario: it tracks the target or the station of that one.
    target_id, station_id
        It tracks that place.
    line_of_sight
        A unit vector in the inertial (TEME) frame; the satellite is at rest.
    at_sun
        Its panels are at the sun.
    """

    opportunity_id: str | None = None
    target_id: str | None = None
    station_id: str | None = None
    line_of_sight: tuple[float, float, float] | None = None
    at_sun: bool = False

    def check(
        self, pointer: str, target_ids: Collection[str], station_ids: Collection[str]
    ) -> None:
        """Check the attitude against what the scenario holds.

        Raises
        ------
        InvalidScenario
            With a pointer that begins with ``pointer``.
        """
        given = [f.name for f in fields(self) if getattr(self, f.name) not in (None, False)]
        if len(given) != 1:
            raise InvalidScenario(
                "value_out_of_range",
                "Say where it looks in exactly one way: sun, line_of_sight, target_id, station_id "
                "or opportunity_id.",
                pointer=pointer,
            )
        for name, ids, what in (
            (self.target_id, target_ids, "target"),
            (self.station_id, station_ids, "ground_station"),
        ):
            if name is not None and name not in ids:
                detail = f"The scenario has no {what.replace('_', ' ')} {name!r}."
                raise InvalidScenario(f"unknown_{what}", detail, pointer=f"{pointer}/{given[0]}")
        if self.line_of_sight is not None:
            length = math.hypot(*self.line_of_sight)
            if not abs(length - 1.0) <= _UNIT:
                raise InvalidScenario(
                    "value_out_of_range",
                    f"A line of sight is a unit vector; this one has length {length:g}.",
                    pointer=f"{pointer}/line_of_sight",
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """What telemetry says of a satellite at an instant; until the horizon it idles.

    Attributes
    ----------
    at
        At most the horizon's start.
    battery_fraction, recorder_fraction
        Of capacity. None for what the satellite's ``resources`` say of the horizon's start.
    attitude
        Where it looks. None where that is not known: then the first task needs no turn.
    """

    satellite_id: str
    at: datetime
    battery_fraction: float | None = None
    recorder_fraction: float | None = None
    attitude: Attitude | None = None


def check_states(
    states: Sequence[State],
    satellite_ids: Collection[str],
    target_ids: Collection[str],
    station_ids: Collection[str],
    horizon: Horizon,
) -> None:
    """Check states against what the scenario holds.

    Raises
    ------
    InvalidScenario
        With a pointer that begins with ``/states/`` and the position.
    """
    known: set[str] = set()
    for position, state in enumerate(states):
        pointer = f"/states/{position}"
        if state.satellite_id not in satellite_ids:
            raise InvalidScenario(
                "unknown_satellite",
                f"The scenario has no satellite {state.satellite_id!r}.",
                pointer=f"{pointer}/satellite_id",
            )
        if state.satellite_id in known:
            raise InvalidScenario(
                "duplicate_state",
                f"There is another state of {state.satellite_id!r} before this one.",
                pointer=f"{pointer}/satellite_id",
            )
        known.add(state.satellite_id)
        if not horizon.start - OLDEST_STATE <= state.at <= horizon.start:
            raise InvalidScenario(
                "value_out_of_range",
                "A state must be of the horizon's start, or of the seven days before it.",
                pointer=f"{pointer}/at",
            )
        for field in ("battery_fraction", "recorder_fraction"):
            value = getattr(state, field)
            if value is not None and not 0.0 <= value <= 1.0:
                raise InvalidScenario(
                    "value_out_of_range",
                    f"{field} must be from 0 to 1.",
                    pointer=f"{pointer}/{field}",
                )
        if state.attitude is not None:
            state.attitude.check(f"{pointer}/attitude", target_ids, station_ids)
