"""A scenario's pins and outages in terms of its problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from planner_core.problem.columns import CONTACT
from planner_core.problem.ruled_out import RuledOutCollects, nothing_ruled_out
from planner_core.problem.slew import TIME_TOLERANCE_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """A row that every plan must take, and the pin (JSON pointer) that says so."""

    row: int
    pointer: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocked:
    """A span in which a satellite or a station may not do tasks of some kinds.

    Attributes
    ----------
    satellite, station
        Index of the satellite, or of the station, that the span concerns.
    pointer
        The pin or the outage that says so (JSON pointer).
    """

    start_s: float
    end_s: float
    kinds: frozenset[int]
    pointer: str
    satellite: int | None = None
    station: int | None = None

    @property
    def is_outage(self) -> bool:
        """Whether it is a reported fact rather than an operator's wish."""
        return self.pointer.startswith("/outages/")

    def concerns(self, satellite: int, kind: int, site: int) -> bool:
        """Return whether such a task may not overlap the span."""
        if kind not in self.kinds:
            return False
        if self.station is not None:
            return kind == CONTACT and site == self.station
        return satellite == self.satellite


@dataclass(frozen=True, slots=True, kw_only=True)
class Pinned:
    """The scenario's pins and outages in terms of the problem.

    Attributes
    ----------
    blocked
        Spans that pins block, and outages.
    skipped
        Rows still in the table that no plan may take, each with the pin that says so.
    forbidden
        Targets that no plan may collect.
    ruled_out
        The collects that were ruled out.
    frozen_until_s
        Tasks that start before it are kept or cannot be taken; None unless the plan follows
        another one.
    """

    kept: tuple[Kept, ...] = ()
    skipped: Mapping[int, str] = field(default_factory=dict)
    blocked: tuple[Blocked, ...] = ()
    forbidden: frozenset[int] = frozenset()
    ruled_out: RuledOutCollects = field(default_factory=nothing_ruled_out)
    frozen_until_s: float | None = None

    @property
    def follows(self) -> bool:
        """Whether the plan follows another one."""
        return self.frozen_until_s is not None

    def is_frozen(self, start_s: float) -> bool:
        """Return whether a task that starts then may neither be added nor dropped."""
        until_s = self.frozen_until_s
        return until_s is not None and start_s < until_s - TIME_TOLERANCE_S
