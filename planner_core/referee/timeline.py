"""The referee's verdict on a plan: what each satellite does, what it earns, what it breaks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from planner_core.problem import Floats
from planner_core.referee.brought_down import BroughtDown

Mode = Literal["collect", "contact", "sunpoint", "hold"]
ViolationCode = Literal[
    "window",
    "overlap",
    "slew",
    "station",
    "duplicate",
    "battery",
    "recorder",
    "pin",
    "outage",
    "frozen",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """A rule that the plan breaks.

    Attributes
    ----------
    at_s
        When, in seconds from the start of the horizon.
    needed, available
        What the rule demands and what the plan provides: seconds, or fractions of capacity.
    blamed
        Positions in ``plan.actions`` of the actions that break it; those earn nothing.
    inherited
        Whether no plan could avoid it: it holds at the start or frozen actions lead to it, and
        none of the other actions contributes to it.
    """

    code: ViolationCode
    satellite: int
    at_s: float
    needed: float
    available: float
    detail: str
    blamed: tuple[int, ...]
    inherited: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Slew:
    """The turn before an action; ``needed_s`` includes settling."""

    angle_deg: float
    needed_s: float
    available_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedAction:
    """One action of the timeline. ``opportunity`` and ``position`` are None in idle time.

    Attributes
    ----------
    worth
        For a collect: what its image would earn alone.
    delivered_s
        For a collect: when its last bit is on the ground; None for never.
    turn_to_s, turn_back_s
        For sun-pointing: the turn to the sun that ends at its start, and the one from its end.
    """

    mode: Mode
    start_s: float
    end_s: float
    opportunity: int | None
    position: int | None
    slew: Slew | None
    reward: float
    battery_end: float | None
    recorder_end: float | None
    worth: float | None = None
    delivered_s: float | None = None
    turn_to_s: float | None = None
    turn_back_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resourceline:
    """Battery and recorder fractions over time; shape ``(k,)`` each."""

    time_s: Floats
    battery: Floats
    recorder: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class SatelliteTimeline:
    """What one satellite does, and its resources (None if the problem ignores them)."""

    actions: tuple[JudgedAction, ...]
    resources: Resourceline | None


class Collected(NamedTuple):
    """How a target was collected: by which plan action, and whether its image is down.

    It is a tuple because each verdict that a search asks for creates thousands of them.

    Attributes
    ----------
    worth
        What the image earns.
    delivered_s, age_s
        When its last bit is on the ground, and how long after the collect; None for never.
    """

    position: int
    satellite: int
    worth: float
    delivered_s: float | None
    age_s: float | None

    @property
    def is_downlinked(self) -> bool:
        """Whether the image is on the ground by the end of the horizon."""
        return self.delivered_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Timeline:
    """A plan, judged.

    Attributes
    ----------
    reward
        Sum over targets of the best worth among their collects that break nothing, plus what
        images on board at the start earn.
    collected
        By target index.
    downlinked, on_board
        What contacts took down, and what is in the recorder at the end; by satellite, in
        recorder capacities.
    battery_min, recorder_max
        The lowest battery and the highest recorder of any satellite at any instant.
    brought_down
        For each image that a recorder held at the start, in the problem's order.
    """

    satellites: tuple[SatelliteTimeline, ...]
    violations: tuple[Violation, ...]
    reward: float
    collected: Mapping[int, Collected]
    downlinked: tuple[float, ...]
    on_board: tuple[float, ...]
    battery_min: float | None
    recorder_max: float | None
    brought_down: tuple[BroughtDown, ...] = ()

    @property
    def earned_by_new(self) -> float:
        """What the images taken by the plan itself earn."""
        return math.fsum(image.worth for image in self.collected.values())

    @property
    def is_valid(self) -> bool:
        """Whether nothing is broken; imaging a target twice is allowed but earns nothing."""
        return all(v.code == "duplicate" for v in self.violations)

    @property
    def validity(self) -> Literal["valid", "inherited", "violations"]:
        """The overall verdict; inherited violations are not the plan's fault."""
        if self.is_valid:
            return "valid"
        own = (v for v in self.violations if v.code != "duplicate" and not v.inherited)
        return "violations" if any(own) else "inherited"
