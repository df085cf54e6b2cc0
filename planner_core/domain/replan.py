"""What a replan has to respect: what is flown already, and what is promised."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final, Literal

from planner_core.domain.checks import require
from planner_core.domain.states import State
from planner_core.errors import InvalidScenario
from planner_core.pins import PinnedAction

Elements = Literal["same", "newest"]
Outcome = Literal["executed", "failed", "skipped", "partial"]

_NEARLY_S: Final = 1.0  # bookings are made in whole seconds
_SAME_PASS_S: Final = 1200.0  # the next access to a site is an orbit away


@dataclass(frozen=True, slots=True, kw_only=True)
class Promise:
    """A target that every plan images, at whatever time.

    Attributes
    ----------
    image_by, deliver_by
        Latest end of the collect, and latest delivery of the image to the ground; None for any.
    """

    target_id: str
    image_by: datetime | None = None
    deliver_by: datetime | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stability:
    """How costly it is to depart from an action of the previous plan.

    Attributes
    ----------
    weight, contact_weight
        What keeping a collect, or a contact, is worth in the search: shares of a typical reward.
    max_changed_share
        Largest share of the actions after the freeze that may be moved or removed; None for any.
        Actions that are lost in any case count too, and may exceed it.
    """

    weight: float = 0.03
    contact_weight: float = 0.05
    max_changed_share: float | None = None

    def __post_init__(self) -> None:
        for name in ("weight", "contact_weight", "max_changed_share"):
            value = getattr(self, name)
            require(value is None or 0.0 <= value <= 1.0, name, "must be between 0 and 1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Flown:
    """An action that began before the horizon, and what became of it.

    Attributes
    ----------
    outcome
        ``failed`` draws its energy, but moves no data except ``mbit``; ``skipped`` does nothing.
    mbit
        Data taken or downlinked. None for as much as planned, or for nothing if it failed.
    """

    satellite_id: str
    target_id: str | None = None
    station_id: str | None = None
    start: datetime
    end: datetime
    outcome: Outcome = "executed"
    mbit: float | None = None

    @property
    def is_imaged(self) -> bool:
        """Whether its target is imaged by it."""
        return self.target_id is not None and self.outcome in ("executed", "partial")


@dataclass(frozen=True, slots=True, kw_only=True)
class Replan:
    """The previous plan, from which planning goes on.

    Attributes
    ----------
    base
        The actions of the previous plan, except failed ones; named by satellite, site and start.
    freeze_until
        Actions that start before it are flown, or as good as flown: they stay, and none is added.
    promises
        Targets that must be imaged.
    elements
        Whether elements are those of the previous plan. With ``newest`` ones, frozen actions keep
        their instants, and each later one becomes the opportunity that starts nearest to it.
    flown
        Actions that began before the horizon, by which states are carried to its start. A
        satellite's last one before its state says where it looked then, if nothing else does.
    before
        Older states, for satellites whose newer ones do not say what is on board: that follows from
        these and from what was flown since, and the newer ones correct how much it is.
    """

    base: tuple[PinnedAction, ...]
    freeze_until: datetime
    promises: tuple[Promise, ...] = ()
    stability: Stability = field(default_factory=Stability)
    elements: Elements = "same"
    flown: tuple[Flown, ...] = ()
    before: tuple[State, ...] = ()

    @property
    def near_s(self) -> float:
        """Seconds by which an opportunity may start before or after its action of the base."""
        return _SAME_PASS_S if self.elements == "newest" else _NEARLY_S

    def check(
        self,
        satellite_ids: Collection[str],
        target_ids: Collection[str],
        station_ids: Collection[str],
    ) -> None:
        """Check that the scenario holds all that is named.

        Raises
        ------
        InvalidScenario
            With a pointer into ``/replan``.
        """
        for i, action in enumerate(self.base):
            at = f"/replan/base/{i}"
            is_one = (action.target_id is None) != (action.station_id is None)
            if not is_one or action.satellite_id is None or action.start is None:
                raise InvalidScenario(
                    "value_out_of_range",
                    "Name the satellite, the start, and either the target or the station.",
                    pointer=at,
                )
            _known(action.satellite_id, satellite_ids, "satellite", f"{at}/satellite_id")
            _known(action.target_id, target_ids, "target", f"{at}/target_id")
            _known(action.station_id, station_ids, "ground_station", f"{at}/station_id")
        for i, flown in enumerate(self.flown):
            at = f"/replan/flown/{i}"
            if (flown.target_id is None) == (flown.station_id is None) or flown.end <= flown.start:
                raise InvalidScenario(
                    "value_out_of_range",
                    "Name either the target or the station, and an end later than the start.",
                    pointer=at,
                )
            _known(flown.satellite_id, satellite_ids, "satellite", f"{at}/satellite_id")
            _known(flown.target_id, target_ids, "target", f"{at}/target_id")
            _known(flown.station_id, station_ids, "ground_station", f"{at}/station_id")
        for i, promise in enumerate(self.promises):
            _known(promise.target_id, target_ids, "target", f"/replan/promises/{i}/target_id")


def _known(name: str | None, names: Collection[str], what: str, pointer: str) -> None:
    if name is not None and name not in names:
        detail = f"The scenario has no {what.replace('_', ' ')} {name!r}."
        raise InvalidScenario(f"unknown_{what}", detail, pointer=pointer)
