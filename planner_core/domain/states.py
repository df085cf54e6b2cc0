"""What is known of a satellite before the horizon begins."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from datetime import datetime, timedelta
from typing import Final

from planner_core.domain.horizon import Horizon
from planner_core.domain.spacecraft import Satellite
from planner_core.errors import InvalidScenario

OLDEST_STATE: Final = timedelta(days=7)
"""Before the horizon; from an older state, idling does not predict what a satellite has."""

_ROUNDING: Final = 1e-6  # of a recorder
_UNIT: Final = 1e-3  # how far from 1 the length of a unit vector may be


@dataclass(frozen=True, slots=True, kw_only=True)
class Attitude:
    """Where a satellite looks: exactly one of these is set.

    Attributes
    ----------
    opportunity_id
        An opportunity of the scenario, whose target or station it tracks.
    target_id, station_id
        The target or station that it tracks.
    line_of_sight
        A unit vector in the inertial (TEME) frame; the satellite is at rest.
    at_sun
        Whether its panels face the sun.
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
class OnBoard:
    """An image that a recorder holds.

    Attributes
    ----------
    collected_at
        When its collect ended.
    mbit, recorder_fraction
        How much of it is left, in megabits or as a fraction of the recorder: exactly one of the
        two is set. 0 for an image that is on the ground already: its target needs no other.
    worth
        Of the whole image. None for its target's reward.
    """

    target_id: str
    collected_at: datetime
    mbit: float | None = None
    recorder_fraction: float | None = None
    worth: float | None = None

    def amount(self, capacity_mbit: float | None) -> float:
        """Return how much is left, as a fraction of a recorder of this size."""
        if self.mbit is None:
            return self.recorder_fraction or 0.0
        return self.mbit / (capacity_mbit or math.inf)

    def check(
        self, pointer: str, at: datetime, target_ids: Collection[str], capacity_mbit: float | None
    ) -> None:
        """Check the image against what the scenario holds.

        Raises
        ------
        InvalidScenario
            With a pointer that begins with ``pointer``.
        """
        faults: list[tuple[bool, str, str]] = [
            (
                self.collected_at > at,
                "collected_at",
                "An image on board cannot be collected after the state.",
            ),
            (
                (self.mbit is None) == (self.recorder_fraction is None),
                "mbit",
                "Give either mbit or recorder_fraction.",
            ),
            (
                self.mbit is not None and capacity_mbit is None,
                "mbit",
                "The recorder's size in megabits is not known: give recorder_fraction instead.",
            ),
        ]
        for name in ("mbit", "recorder_fraction", "worth"):
            value = getattr(self, name)
            is_fine = value is None or 0.0 <= value < math.inf
            faults.append((not is_fine, name, f"{name} must be 0 or more."))
        if self.target_id not in target_ids:
            detail = f"The scenario has no target {self.target_id!r}."
            raise InvalidScenario("unknown_target", detail, pointer=f"{pointer}/target_id")
        for is_fault, field, detail in faults:
            if is_fault:
                raise InvalidScenario("value_out_of_range", detail, pointer=f"{pointer}/{field}")


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """What telemetry says of a satellite at an instant, from which it idles until the horizon.

    Attributes
    ----------
    at
        No later than the horizon's start.
    battery_fraction, recorder_fraction
        Of capacity. None for the levels that the satellite's ``resources`` give for the start.
    attitude
        Where it looks. None if unknown: then the first task needs no slew.
    on_board
        Images on board, which are downlinked first, in this order, before anything else that the
        recorder holds. None if unknown.
    """

    satellite_id: str
    at: datetime
    battery_fraction: float | None = None
    recorder_fraction: float | None = None
    attitude: Attitude | None = None
    on_board: tuple[OnBoard, ...] | None = None

    def recorder(self, capacity_mbit: float | None) -> float | None:
        """Return the recorder's level, or the sum of its images if only those are known."""
        if self.recorder_fraction is not None or not self.on_board:
            return self.recorder_fraction
        return min(1.0, math.fsum(image.amount(capacity_mbit) for image in self.on_board))


def check_states(
    states: Sequence[State],
    satellites: Sequence[Satellite],
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
    by_id = {satellite.id: satellite for satellite in satellites}
    known: set[str] = set()
    for position, state in enumerate(states):
        pointer = f"/states/{position}"
        if state.satellite_id not in by_id:
            raise InvalidScenario(
                "unknown_satellite",
                f"The scenario has no satellite {state.satellite_id!r}.",
                pointer=f"{pointer}/satellite_id",
            )
        if state.satellite_id in known:
            raise InvalidScenario(
                "duplicate_state",
                f"An earlier entry already gives a state of {state.satellite_id!r}.",
                pointer=f"{pointer}/satellite_id",
            )
        known.add(state.satellite_id)
        if not horizon.start - OLDEST_STATE <= state.at <= horizon.start:
            raise InvalidScenario(
                "value_out_of_range",
                "A state must be at the horizon's start, or in the seven days before it.",
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
        capacity_mbit = by_id[state.satellite_id].resources.recorder_capacity_mbit
        _check_on_board(state, pointer, target_ids, capacity_mbit)


def _check_on_board(
    state: State, pointer: str, target_ids: Collection[str], capacity_mbit: float | None
) -> None:
    images = state.on_board or ()
    for number, image in enumerate(images):
        image.check(f"{pointer}/on_board/{number}", state.at, target_ids, capacity_mbit)
    held = 1.0 if state.recorder_fraction is None else state.recorder_fraction
    listed = math.fsum(image.amount(capacity_mbit) for image in images)
    if listed > held + _ROUNDING:
        raise InvalidScenario(
            "value_out_of_range",
            f"The images add up to {listed:.6g} of the recorder, which holds {held:g}.",
            pointer=f"{pointer}/on_board",
        )
