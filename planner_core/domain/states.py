"""What is known of a satellite before the horizon begins."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from planner_core.domain.horizon import Horizon
from planner_core.errors import InvalidScenario

OLDEST_STATE: Final = timedelta(days=7)
"""Before the horizon; idling for longer says nothing of where a satellite is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """What telemetry says of a satellite at an instant; until the horizon it idles.

    Attributes
    ----------
    at
        At most the horizon's start.
    battery_fraction, recorder_fraction
        Of capacity. None for what the satellite's ``resources`` say of the horizon's start.
    """

    satellite_id: str
    at: datetime
    battery_fraction: float | None = None
    recorder_fraction: float | None = None


def check_states(states: Sequence[State], satellite_ids: Collection[str], horizon: Horizon) -> None:
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
