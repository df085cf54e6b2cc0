"""The attitude that the satellite is commanded to have, ten times a second.

Between tasks it slews within its limits of rate and acceleration: a burst from the rate of the
line of sight that it leaves, a coast, and a burst to the rate of the next one, each about an axis
of its own. If the plan leaves too little time for that, it arrives late, as a real satellite
would. While it tracks, it does not roll about the boresight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from benchmarks.flight.mission import Agility, Floats, Mission, Task
from benchmarks.flight.rotations import (
    BORESIGHT,
    between,
    bursts_s,
    draw,
    facing,
    norm,
    solve,
    track,
)
from benchmarks.flight.world import line_of_sight, orbit, sun_km

STEP_S: Final = 0.1
_LATEST_S: Final = 600.0  # by which every slew that is possible at all has ended
_STRONG_WHEELS_DEG_S2: Final = 0.5  # if the plan has no limit

# Direction of a line of sight and its rate of turn, at an instant in seconds.
Goal = Callable[[float], tuple[Floats, Floats]]


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of the satellite's rate and acceleration, rad/s and rad/s2."""

    rate: float
    acceleration: float


@dataclass(frozen=True, slots=True)
class Reference:
    """Attitude, rate and acceleration at even steps, in TEME.

    Attributes
    ----------
    attitude
        Columns are the body's axes; the boresight is the third. Shape ``(n, 3, 3)``.
    rate, acceleration
        rad/s and rad/s2. Shape ``(n, 3)``.
    too_short
        Names of tasks before which the plan leaves less time than the slew needs.
    visits
        Start and end of each visit to the sun, in seconds.
    """

    attitude: Floats
    rate: Floats
    acceleration: Floats
    too_short: list[str]
    visits: list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Flight:
    """The flight of a reference, at the same steps.

    Attributes
    ----------
    boresight
        TEME. Shape ``(n, 3)``.
    rate_deg_s
        How fast the body turned. Shape ``(n,)``.
    lit
        Visible share of the sun's disc. Shape ``(n,)``.
    torque_share
        Greatest torque commanded of a wheel, relative to its maximum.
    """

    boresight: Floats
    rate_deg_s: Floats
    lit: Floats
    torque_share: float


def limits_of(agility: Agility, acceleration_deg_s2: float | None) -> Limits:
    """Return the limits to fly with: a given acceleration, the plan's own, or strong wheels'."""
    chosen = acceleration_deg_s2 or agility.acceleration_deg_s2 or _STRONG_WHEELS_DEG_S2
    return Limits(math.radians(agility.rate_deg_s), math.radians(chosen))


class Pilot:
    """Draws the reference from task to task.

    Parameters
    ----------
    limits
        Of rate and acceleration.
    """

    def __init__(self, mission: Mission, limits: Limits) -> None:
        self._mission, self._limits = mission, limits
        self._orbit = orbit(mission)
        num_steps = round(mission.duration_s / STEP_S) + 1
        self._attitude = np.zeros((num_steps, 3, 3))
        self._rate = np.zeros((num_steps, 3))
        self._too_short: list[str] = []
        self._visits: list[tuple[float, float]] = []
        self._now_s = 0.0
        self._pose = facing(self._sunward(0.0, np.array([0.0, 0.6, 0.8])), np.eye(3))
        self._spin = np.zeros(3)

    def reference(self) -> Reference:
        """Return the attitude over the whole flight."""
        for task in self._mission.tasks:
            self._between(task.start_s, task)
            self._track(task)
        self._between(self._mission.duration_s, None)
        # A command holds until the next step: during it the rate must reach the next one.
        acceleration = np.diff(self._rate, axis=0, append=self._rate[-1:]) / STEP_S
        return Reference(self._attitude, self._rate, acceleration, self._too_short, self._visits)

    # From one task to the next ----------------------------------------------------------------

    def _between(self, until_s: float, task: Task | None) -> None:
        """Continue until a task begins, by way of the sun if the plan says so."""
        for from_s, to_s in self._sun_spans(until_s, task):
            self._to_sun(from_s)
            leaves_s = max(self._now_s, to_s)
            self._visits.append((self._now_s, leaves_s))
            self._rest(leaves_s)
        if task is not None:
            self._to_task(task)
        else:
            self._rest(until_s)

    def _sun_spans(self, until_s: float, task: Task | None) -> list[tuple[float, float]]:
        if self._mission.visits is not None:
            return [
                (each.start_s, each.end_s)
                for each in self._mission.visits
                if self._now_s - 1e-3 <= each.start_s and each.end_s <= until_s + 1e-3
            ]
        if self._mission.power is None:
            return []
        arrives_s = self._now_s + self._least_s(self._sun_goal, self._now_s)
        if task is None:
            return [(arrives_s, until_s)] if arrives_s < until_s else []
        # The slew back takes about as long from any sun-pointing attitude, so measure it there.
        pose, spin, now_s = self._pose, self._spin, self._now_s
        direction = self._sunward(arrives_s, self._boresight)
        self._pose, self._spin = facing(direction, pose), np.zeros(3)
        back_s = self._least_back_s(task)
        self._pose, self._spin, self._now_s = pose, spin, now_s
        leaves_s = until_s - back_s - self._mission.agility.settle_s
        return [(arrives_s, leaves_s)] if arrives_s < leaves_s else []

    def _to_sun(self, wanted_s: float) -> None:
        """Slew to the sun, to arrive at an instant or as soon as possible after it."""
        self._turn(self._sun_goal, wanted_s)

    def _to_task(self, task: Task) -> None:
        """Slew to the task's future line of sight, in time for it or as soon as possible."""
        goal = self._goal(task)
        early_s = task.start_s - self._mission.agility.settle_s
        for wanted_s in (early_s, task.start_s):
            for sooner_s in (0.0, 0.5, 1.0, 2.0, 4.0, 8.0):
                at_s = wanted_s - sooner_s
                found = self._cruise(goal, at_s) if at_s > self._now_s else None
                if found is not None:
                    self._follow(found, at_s, goal)
                    return
        self._too_short.append(task.name)
        self._turn(goal, task.start_s)

    def _track(self, task: Task) -> None:
        """Keep the boresight on the site until the task ends."""
        first, last = self._steps(self._now_s, task.end_s)
        site = task.site.ecef_km
        if last > first:
            track(self._orbit, site, self._pose, STEP_S, first, self._attitude[first:last],
                  self._rate[first:last])  # fmt: skip
            self._pose = self._attitude[last - 1].copy()
        direction, spin = line_of_sight(self._orbit, site, max(task.end_s, self._now_s))
        self._pose, self._spin = facing(direction, self._pose), spin
        self._now_s = max(task.end_s, self._now_s)

    def _rest(self, until_s: float) -> None:
        """Hold the attitude; a satellite that is still turning comes to rest first."""
        if until_s <= self._now_s:
            return
        # A slew that comes to rest and stays there.
        brake_s = max(until_s, self._now_s + norm(self._spin) / self._limits.acceleration)
        self._draw(np.zeros(3), np.zeros(3), until_s, brake_s)

    # Turns ------------------------------------------------------------------------------------

    def _turn(self, goal: Goal, wanted_s: float) -> None:
        """Slew, to arrive at an instant or as soon as possible after it."""
        at_s = wanted_s
        found = self._cruise(goal, at_s) if at_s > self._now_s else None
        if found is None:
            at_s = max(wanted_s, self._now_s) + self._later_s(goal, max(wanted_s, self._now_s))
            found = self._cruise(goal, at_s)
        if found is None:
            raise RuntimeError(f"no turn at {self._now_s:.1f} s ends within {_LATEST_S:.0f} s")
        self._follow(found, at_s, goal)

    def _later_s(self, goal: Goal, from_s: float) -> float:
        """Return how much later than an instant a slew can end."""
        step_s, later_s = 0.25, 0.0
        while self._cruise(goal, from_s + later_s) is None and later_s < _LATEST_S:
            later_s += step_s
        for _ in range(8):
            step_s /= 2.0
            if self._cruise(goal, from_s + later_s - step_s) is not None:
                later_s -= step_s
        return later_s

    def _least_s(self, goal: Goal, from_s: float) -> float:
        """Return how long the quickest slew takes from here."""
        return self._later_s(goal, from_s + STEP_S) + STEP_S

    def _least_back_s(self, task: Task) -> float:
        """Return how long before a task the satellite, at rest, has to begin its slew."""
        goal, low_s, high_s = self._goal(task), 0.0, 1.0
        while self._is_possible(goal, task.start_s, high_s) is False and high_s < _LATEST_S:
            low_s, high_s = high_s, 1.5 * high_s
        for _ in range(12):
            middle_s = (low_s + high_s) / 2.0
            if self._is_possible(goal, task.start_s, middle_s):
                high_s = middle_s
            else:
                low_s = middle_s
        return high_s

    def _is_possible(self, goal: Goal, at_s: float, takes_s: float) -> bool:
        self._now_s = at_s - takes_s
        return self._cruise(goal, at_s) is not None

    def _cruise(self, goal: Goal, at_s: float) -> Floats | None:
        """Return the coast rate of a slew that ends at an instant; None if there is none."""
        takes_s = at_s - self._now_s
        if takes_s <= 0.0:
            return None
        direction, spin = goal(at_s)
        # A rate that the lines of sight themselves have does not count against the slew.
        most = max(self._limits.rate, norm(self._spin), norm(spin)) * (1.0 + 1e-9)
        if norm(between(self._boresight, direction)) > most * takes_s:
            return None
        found, cruise = solve(
            self._pose, self._spin, direction, spin, takes_s, self._limits.acceleration
        )
        both_s = bursts_s(self._spin, cruise, spin, self._limits.acceleration)
        is_right = found and sum(both_s) <= takes_s and norm(cruise) <= most
        return cruise if is_right else None

    def _follow(self, cruise: Floats, at_s: float, goal: Goal) -> None:
        """Write a whole slew, and move to its end."""
        direction, spin = goal(at_s)
        self._draw(cruise, spin, at_s, at_s)
        self._pose = facing(direction, self._pose)

    def _draw(self, cruise: Floats, spin: Floats, until_s: float, ends_s: float) -> None:
        """Write a slew that ends at one instant up to another instant, and move there."""
        first, last = self._steps(self._now_s, until_s)
        self._pose = draw(
            self._pose, self._spin, cruise, spin, np.array([self._now_s, ends_s]),
            self._limits.acceleration, STEP_S, first, self._attitude[first:last],
            self._rate[first:last],
        )  # fmt: skip
        self._spin, self._now_s = spin, until_s

    def _steps(self, from_s: float, to_s: float) -> tuple[int, int]:
        """Return the steps in a span, its start included and its end not."""
        first = math.ceil(from_s / STEP_S - 1e-9)
        last = math.ceil(to_s / STEP_S - 1e-9)
        if to_s >= self._mission.duration_s:
            last = len(self._attitude)
        return first, max(first, min(last, len(self._attitude)))

    @property
    def _boresight(self) -> Floats:
        return np.ascontiguousarray(self._pose[:, BORESIGHT])

    # Where to ---------------------------------------------------------------------------------

    def _goal(self, task: Task) -> Goal:
        return lambda time_s: line_of_sight(self._orbit, task.site.ecef_km, time_s)

    def _sun_goal(self, time_s: float) -> tuple[Floats, Floats]:
        return self._sunward(time_s, self._boresight), np.zeros(3)

    def _sunward(self, time_s: float, boresight: Floats) -> Floats:
        """Return the nearest boresight direction with the panels facing the sun.

        The panels stand at a fixed angle to the boresight, and turn freely about it.
        """
        sun = sun_km(self._mission, time_s)
        sun /= norm(sun)
        panel = 180.0 if self._mission.power is None else self._mission.power.panel_angle_deg
        across = boresight - sun * float(sun @ boresight)
        if norm(across) < 1e-9:
            across = np.cross(sun, np.array([0.0, 0.0, 1.0]))
        across /= norm(across)
        angle = math.radians(panel)
        return math.cos(angle) * sun + math.sin(angle) * across
