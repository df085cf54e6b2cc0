"""The frozen problem: all that solvers and the referee ever see.

Here geometry has become numbers. Opportunities form one table of columns, ordered by
(start, end, satellite, kind, id of the site). Each satellite has a view of its own rows, which
holds the data that decide which of them may follow each other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from planner_core.domain import Agility, Dynamics, Objective, Resources
from planner_core.problem.columns import (
    COLLECT,
    Bools,
    Floats,
    Ints,
    Longs,
    Singles,
)
from planner_core.problem.downlink import Downlinks
from planner_core.problem.pinned import Pinned
from planner_core.problem.pointing import Pointing, Vector, sight
from planner_core.problem.sun_turns import SunPath, SunTurns
from planner_core.problem.transitions import Transitions
from planner_core.worth import best_worths, common_unit, worth_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Opportunities:
    """All collects and contacts of a scenario, one row each, in the order given above.

    Instants are seconds from the start of the horizon, rounded inward to the millisecond.
    Angles and distances hold at the middle of the opportunity, in single precision (1e-5 deg, a
    quarter of a metre): apart from image quality they are for display only. Lines of sight are
    unit vectors from the satellite in the inertial (TEME) frame. Shape ``(n,)`` or ``(n, 3)``.

    Attributes
    ----------
    satellite
        Index of the satellite in the scenario.
    kind
        ``COLLECT`` or ``CONTACT``.
    site
        Index of the target (collect) or of the ground station (contact).
    access
        Number of the access it lies in, unique in the scenario.
    start_s, end_s
        Span of the task itself.
    access_start_s, access_end_s
        Span of its access, cut to its target's release and due times.
    los_start, los_end
        Line of sight at ``start_s`` and at ``end_s``.
    los_rate_start, los_rate_end
        Their inertial angular velocities in deg/s, without the component along the line itself.
        Zero unless the satellite's ``slew_model`` asks for them.
    off_nadir_deg, elevation_deg, azimuth_deg, range_m
        At the satellite; at the ground; at the ground from north over east; between both.
    sun_elevation_deg, in_eclipse
        Of the sun at the target or station; whether the satellite is in the Earth's shadow.
    """

    satellite: Ints
    kind: npt.NDArray[np.int8]
    site: Ints
    access: Ints
    start_s: Floats
    end_s: Floats
    access_start_s: Floats
    access_end_s: Floats
    los_start: Floats
    los_end: Floats
    los_rate_start: Singles
    los_rate_end: Singles
    off_nadir_deg: Singles
    elevation_deg: Singles
    azimuth_deg: Singles
    range_m: Singles
    sun_elevation_deg: Singles
    in_eclipse: Bools

    def __len__(self) -> int:
        return len(self.start_s)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sunlight:
    """When one satellite is in sunlight: ``enter_s[i] <= t < exit_s[i]``, ascending."""

    enter_s: Floats
    exit_s: Floats

    def gaps(self, horizon_s: float) -> list[tuple[float, float]]:
        """Return the times in shadow, from 0 to the end of the horizon.

        >>> Sunlight(enter_s=np.array([0.0, 50.0]), exit_s=np.array([10.0, 60.0])).gaps(80.0)
        [(10.0, 50.0), (60.0, 80.0)]
        """
        starts = [0.0, *self.exit_s.tolist()]
        ends = [*self.enter_s.tolist(), horizon_s]
        return [(start, end) for start, end in zip(starts, ends, strict=True) if start < end]

    def seconds_until(self, t_s: Floats) -> Floats:
        """Return the sunlit seconds between 0 and each instant.

        >>> Sunlight(enter_s=np.array([0.0, 50.0]), exit_s=np.array([10.0, 60.0])).seconds_until(
        ...     np.array([5.0, 20.0, 55.0]))
        array([ 5., 10., 15.])
        """
        lengths = self.exit_s - self.enter_s
        before = np.concatenate([[0.0], np.cumsum(lengths)])
        i = np.searchsorted(self.enter_s, t_s, side="right")
        last = np.maximum(i - 1, 0)
        if len(lengths) == 0:
            return np.zeros_like(t_s)
        into = np.clip(t_s - self.enter_s[last], 0.0, lengths[last])
        return np.where(i == 0, 0.0, before[last] + into)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageOnBoard:
    """An image that a recorder holds when the horizon begins.

    Attributes
    ----------
    target
        -1 for data that belongs to no image, which waits in the queue as well.
    amount
        What is left of it, in recorder capacities; 0 if it is on the ground already.
    collected_s
        When its collect ended, before the horizon begins.
    worth
        What the image would earn if it were on the ground at once.
    """

    satellite: int
    target: int
    amount: float
    collected_s: float
    worth: float

    @property
    def is_waiting(self) -> bool:
        """Whether it is an image that is not on the ground yet."""
        return self.target >= 0 and self.amount > 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """Where a satellite looks when its horizon begins.

    Attributes
    ----------
    free_from_s
        When it may begin to turn, at most 0.
    line_of_sight
        Unit vector, inertial; None if the panels point at the sun.
    moving_deg_s
        Its angular velocity, if turns depend on it.
    """

    free_from_s: float
    line_of_sight: tuple[float, float, float] | None = None
    moving_deg_s: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True, eq=False)
class SatelliteProblem:
    """One satellite's part: its rows of the opportunity table, and how it turns between them.

    Attributes
    ----------
    rows
        Rows of the scenario's table that belong to this satellite, ascending. Shape ``(m,)``.
    sunlight
        Only what ``eclipse_aware`` needs; the whole horizon otherwise.
    event_s
        Starts of all opportunities of the satellite in the scenario, including those that pins
        or a search leave out: the events of ``dynamics: paper``. Ascending.
    event
        Index of each row in ``event_s``. Shape ``(m,)``.
    sun
        Where the sun stands. None is enough if pointing at it is free.
    turns
        From each row to the sun and back; zero if pointing at the sun is free.
    volume
        How much each contact takes down, in recorder capacities; 0 for collects. Shape ``(m,)``.
    heading
        No task begins before the satellite can have turned to it from there; None if unknown.
    """

    id: str
    name: str
    agility: Agility
    resources: Resources
    rows: Ints
    kind: npt.NDArray[np.int8]
    site: Ints
    start_s: Floats
    end_s: Floats
    transitions: Transitions
    sunlight: Sunlight
    event_s: Floats
    event: Ints
    sun: SunPath | None
    turns: SunTurns
    volume: Floats
    heading: Heading | None = None

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def previous_event_s(self) -> Floats:
        """Instant of the event before each row; 0 before the first. Shape ``(m,)``."""
        return np.concatenate([[0.0], self.event_s])[self.event]


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """A compiled scenario.

    Attributes
    ----------
    worth
        The most that each opportunity's image alone can earn, 0 for contacts (see
        ``planner_core.worth``).
        With continuous starts all collects of an access are worth the same. Shape ``(n,)``.
    full_worth
        The same for an image that is on the ground at once; None if that is ``worth``.
    objective
        Which share of its full worth an image earns, and when.
    leaves_none_on_board
        For searches for plans: whether all images must come down, whatever one on board earns.
    target_access
        Why a target has no opportunity, or ``ACCESS_FOUND``. Shape ``(num_targets,)``.
    station_antennas
        How many satellites each station serves at a time. Shape ``(num_stations,)``.
    downlinks
        How fast each contact takes data down.
    continuous_starts
        Whether a collect may start anywhere in its access, at a whole millisecond.
    pointing
        For lines of sight at any instant; None without continuous starts.
    pinned
        Opportunities that pins rule out are not in the table; those to be kept are named here.
    origin
        Row of each opportunity in the scenario's table; None if this is that table. Shape ``(n,)``.
    on_board
        Images that each recorder holds at the start; they come down first, in this order. New
        images of their targets earn nothing.
    """

    horizon_s: float
    use_resources: bool
    dynamics: Dynamics
    continuous_starts: bool
    target_ids: tuple[str, ...]
    worth: Floats
    target_access: npt.NDArray[np.int8]
    station_ids: tuple[str, ...]
    station_antennas: Ints
    downlinks: Downlinks
    opportunities: Opportunities
    satellites: tuple[SatelliteProblem, ...]
    full_worth: Floats | None = None
    objective: Objective = field(default_factory=Objective)
    leaves_none_on_board: bool = False
    pointing: Pointing | None = None
    pinned: Pinned = field(default_factory=Pinned)
    origin: Ints | None = None
    on_board: tuple[ImageOnBoard, ...] = ()

    @cached_property
    def kept_rows(self) -> Ints:
        """The rows that every plan must take, ascending."""
        return np.array(sorted(kept.row for kept in self.pinned.kept), dtype=np.int32)

    def kept_local(self, satellite: SatelliteProblem) -> Ints:
        """Return the local rows that a satellite must take, ascending."""
        if len(self.kept_rows) == 0:
            return self.kept_rows
        return np.flatnonzero(np.isin(satellite.rows, self.kept_rows)).astype(np.int32)

    def scenario_row(self, row: int) -> int:
        """Return the row of an opportunity in the scenario's table, which names it to users."""
        return row if self.origin is None else int(self.origin[row])

    @cached_property
    def local_row(self) -> Ints:
        """For each opportunity, its row in its own satellite's view. Shape ``(n,)``."""
        local = np.empty(len(self.opportunities), dtype=np.int32)
        for satellite in self.satellites:
            local[satellite.rows] = np.arange(len(satellite), dtype=np.int32)
        return local

    @cached_property
    def best_worth(self) -> Floats:
        """The most that an image of each target earns. Shape ``(num_targets,)``."""
        rows, _ = self.target_opportunities
        target = self.opportunities.site[rows]
        return best_worths(target, self.worth[rows], len(self.target_ids))

    @cached_property
    def typical_worth(self) -> float:
        """What the best image of a target earns on average; 1 if that is 0 or there is none."""
        _, offsets = self.target_opportunities
        offered = self.best_worth[np.diff(offsets) > 0]
        return float(offered.mean()) or 1.0 if len(offered) else 1.0

    @cached_property
    def has_better_images(self) -> bool:
        """Whether some target has two images of different positive worth."""
        is_worth = (self.opportunities.kind == COLLECT) & (self.worth > 0.0)
        best = self.best_worth[self.opportunities.site[is_worth]]
        return bool(np.any(self.worth[is_worth] < best))

    @cached_property
    def reward_unit(self) -> float:
        """An amount such that any plan earns a multiple of it; 0 if none is known."""
        if not self.counts_delivery or self.objective.is_delivered:
            return common_unit(self.worth)
        if self.objective.half_life_s is not None:
            return 0.0
        shares = (1.0, self.objective.collected_share)
        return common_unit(np.concatenate([share * self.worth_on_ground for share in shares]))

    @property
    def counts_delivery(self) -> bool:
        """Whether what an image earns depends on when it is on the ground."""
        return self.use_resources and self.objective.counts_delivery

    @property
    def worth_on_ground(self) -> Floats:
        """What each image alone earns if it is on the ground at once. Shape ``(n,)``."""
        return self.worth if self.full_worth is None else self.full_worth

    def worth_of(self, rows: npt.NDArray[np.integer]) -> float:
        """Return the most that a valid plan of these opportunities earns.

        It earns that if each of its images is on the ground as early as possible.
        """
        images = rows[self.opportunities.kind[rows] == COLLECT]
        return worth_of(self.opportunities.site[images], self.worth[images])

    @property
    def turns_in_motion(self) -> bool:
        """Whether some satellite turns between moving lines of sight."""
        return any(satellite.agility.tracks for satellite in self.satellites)

    @property
    def turns_to_the_sun(self) -> bool:
        """Whether some satellite charges only between turns to the sun and back."""
        return self.use_resources and any(
            satellite.resources.sun_pointing == "slew" for satellite in self.satellites
        )

    @cached_property
    def offers_choice(self) -> bool:
        """Whether some access offers several opportunities: starts of a collect, or contacts."""
        return len(np.unique(self.opportunities.access)) < len(self.opportunities)

    @cached_property
    def offers_starts(self) -> bool:
        """Whether some access offers several collects."""
        access = self.opportunities.access[self.opportunities.kind == COLLECT]
        return len(np.unique(access)) < len(access)

    @cached_property
    def target_opportunities(self) -> tuple[Ints, Longs]:
        """Collects grouped by target: rows, and offsets of shape ``(num_targets + 1,)``."""
        collects = np.flatnonzero(self.opportunities.kind == COLLECT).astype(np.int32)
        order = np.argsort(self.opportunities.site[collects], kind="stable")
        counts = np.bincount(self.opportunities.site[collects], minlength=len(self.target_ids))
        offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        return collects[order], offsets

    def collects_of(self, target: int) -> Ints:
        """Return the rows of a target's collects, in order."""
        rows, offsets = self.target_opportunities
        return rows[offsets[target] : offsets[target + 1]]


def line_of_sight(problem: Problem, row: int, t_s: float) -> Vector:
    """Return the line of sight of an opportunity's task at an instant.

    Without ``pointing`` it is known only at the opportunity's own start and end.
    """
    table, pointing = problem.opportunities, problem.pointing
    if pointing is None:
        own = table.los_start if t_s <= table.start_s[row] else table.los_end
        x, y, z = own[row].tolist()
        return x, y, z
    is_collect = table.kind[row] == COLLECT
    sites = pointing.targets_m if is_collect else pointing.stations_m
    path = pointing.paths[int(table.satellite[row])]
    return sight(path, sites, int(table.site[row]), float(t_s))
