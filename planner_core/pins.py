"""What a scenario pins: actions that must be kept, and what is ruled out.

Pins use the operator's names and instants, not the planner's indices
(``planner_core.pinning.pinned_problem`` translates them).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from planner_core.errors import InvalidScenario

PinnedMode = Literal["collect", "contact"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PinnedAction:
    """An action by names: a booked contact, a promised image.

    Attributes
    ----------
    target_id, station_id, satellite_id
        What is imaged or contacted, and by which satellite; exactly one of the first two, unless
        ``opportunity_id`` is given.
    start, end
        When. Among the opportunities that overlap this span, the one that starts nearest to
        ``start`` is meant. They may be left out if there is only one.
    opportunity_id
        The opportunity itself (``o17``), as the scenario lists it.
    """

    satellite_id: str | None = None
    target_id: str | None = None
    station_id: str | None = None
    start: datetime | None = None
    end: datetime | None = None
    opportunity_id: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockedInterval:
    """A span in which a satellite may not image, may not contact stations, or both."""

    satellite_id: str
    start: datetime
    end: datetime
    modes: tuple[PinnedMode, ...] = ("collect", "contact")


@dataclass(frozen=True, slots=True, kw_only=True)
class Pins:
    """All that a scenario pins.

    Attributes
    ----------
    keep, skip
        Actions that every plan must hold, and single actions that none may hold.
    block
        Spans in which a satellite may not act.
    forbid
        Ids of targets that no plan may collect.
    """

    keep: tuple[PinnedAction, ...] = ()
    skip: tuple[PinnedAction, ...] = ()
    block: tuple[BlockedInterval, ...] = ()
    forbid: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.keep or self.skip or self.block or self.forbid)

    def check(
        self,
        satellite_ids: Collection[str],
        target_ids: Collection[str],
        station_ids: Collection[str],
        *,
        has_contacts: bool,
    ) -> None:
        """Check the pins against what the scenario holds.

        Raises
        ------
        InvalidScenario
            A pin is invalid; with a pointer into ``/pins``.
        """
        actions = [(f"/pins/keep/{i}", action) for i, action in enumerate(self.keep)]
        actions += [(f"/pins/skip/{i}", action) for i, action in enumerate(self.skip)]
        for at, action in actions:
            _known(action.satellite_id, satellite_ids, "satellite", f"{at}/satellite_id")
            _known(action.target_id, target_ids, "target", f"{at}/target_id")
            _known(action.station_id, station_ids, "ground_station", f"{at}/station_id")
            num_names = (action.target_id is not None) + (action.station_id is not None)
            _require(
                num_names <= 1 and (num_names == 1 or action.opportunity_id is not None),
                at,
                "Name either the target_id or the station_id, or else the opportunity_id.",
            )
            _require(
                action.end is None or (action.start is not None and action.end >= action.start),
                f"{at}/end",
                "end needs a start, and must not be before it.",
            )
            _require(
                action.station_id is None or has_contacts,
                f"{at}/station_id",
                "Without use_resources, no contacts are planned.",
            )
        for i, blocked in enumerate(self.block):
            at = f"/pins/block/{i}"
            _known(blocked.satellite_id, satellite_ids, "satellite", f"{at}/satellite_id")
            _require(blocked.end > blocked.start, f"{at}/end", "end must be later than start.")
            _require(len(blocked.modes) > 0, f"{at}/modes", "Name collect, contact or both.")
        for i, target_id in enumerate(self.forbid):
            _known(target_id, target_ids, "target", f"/pins/forbid/{i}")


def _require(condition: bool, pointer: str, detail: str) -> None:
    if not condition:
        raise InvalidScenario("value_out_of_range", detail, pointer=pointer)


def _known(name: str | None, names: Collection[str], what: str, pointer: str) -> None:
    if name is not None and name not in names:
        words = what.replace("_", " ")
        raise InvalidScenario(
            f"unknown_{what}", f"The scenario has no {words} {name!r}.", pointer=pointer
        )
