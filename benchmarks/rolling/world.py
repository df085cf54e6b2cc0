"""The flown world: requests and failures that are the same for all policies, and satellites.

Batteries and recorders are integrated here and not by the referee, so that a fault common to plans
and their replay would show: an image without room is skipped on board, and counted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Final, Literal

import numpy as np

from benchmarks.missions import START
from planner_core.domain import Resources, Target
from service.catalogs.wrs2 import load_wrs2_land

FIRST_REQUESTS: Final = 600
REQUESTS_A_DAY: Final = 250
URGENT_SHARE: Final = 0.08
URGENT_REWARD: Final = 5.0
URGENT_TIME: Final = timedelta(hours=12)
USUAL_TIME: Final = timedelta(hours=72)
IMAGE_FAILS: Final = 0.03
PASS_LOST: Final = 0.10
SAFE_EVERY_DAYS: Final = 4.0
SAFE: Final = timedelta(hours=6)

_EDGE: Final = 1e-9  # of a battery or a recorder: tolerance for sums
_IMAGE, _PASS, _SAFE, _REQUESTS = range(4)


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A target that somebody requests at an instant."""

    target: Target
    asked_at: datetime

    @property
    def is_urgent(self) -> bool:
        """Whether it is worth more, and due soon."""
        return self.target.reward > 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Luck:
    """Failures, by seed: the same for every plan."""

    seed: int
    days: int

    def requests(self, num_first: int, num_a_day: int) -> tuple[Request, ...]:
        """Return all requests in the order in which they arrive."""
        scenes = load_wrs2_land()
        rng = np.random.default_rng([self.seed, _REQUESTS])
        number = num_first + num_a_day * self.days
        picked = rng.choice(len(scenes), number, replace=False)
        later_days = np.sort(rng.uniform(0.0, self.days, number - num_first))
        days = np.concatenate([np.zeros(num_first), later_days])
        found = []
        for scene, day, is_urgent in zip(
            picked.tolist(), days.tolist(), rng.random(number) < URGENT_SHARE, strict=True
        ):
            at = START + timedelta(seconds=round(86400.0 * day))
            target = Target(
                id=scenes[scene].id,
                lat_deg=scenes[scene].lat_deg,
                lon_deg=scenes[scene].lon_deg,
                reward=URGENT_REWARD if is_urgent else 1.0,
                release=at,
                due=at + (URGENT_TIME if is_urgent else USUAL_TIME),
            )
            found.append(Request(target=target, asked_at=at))
        return tuple(found)

    def image_fails(self, satellite: int, target_id: str, start: datetime) -> bool:
        """Return whether an image fails; those of one access fail together."""
        orbit = int((start - START).total_seconds() // 2700)
        return self._draw(_IMAGE, satellite, int(target_id.encode().hex(), 16), orbit) < IMAGE_FAILS

    def pass_is_lost(self, satellite: int, station_id: str, at: datetime) -> bool:
        """Return whether the pass over a station at some instant is lost."""
        orbit = int((at - START).total_seconds() // 2700)
        return self._draw(_PASS, satellite, int(station_id.encode().hex(), 16), orbit) < PASS_LOST

    def safe_modes(self, satellite: int) -> tuple[tuple[datetime, datetime], ...]:
        """Return when a satellite is in safe mode."""
        rng = np.random.default_rng([self.seed, _SAFE, satellite])
        found: list[tuple[datetime, datetime]] = []
        day = 0.0
        while True:
            day += float(rng.exponential(SAFE_EVERY_DAYS))
            if day >= self.days:
                return tuple(found)
            start = START + timedelta(seconds=round(86400.0 * day))
            found.append((start, start + SAFE))
            day += SAFE.total_seconds() / 86400.0

    def _draw(self, kind: int, *of: int) -> float:
        return float(np.random.default_rng([self.seed, kind, *of]).random())


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """An action that a satellite is commanded to do."""

    start: datetime
    end: datetime
    mode: Literal["collect", "contact"]
    site_id: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """The outcome of an image: taken, failed, or skipped on board."""

    target_id: str
    at: datetime
    outcome: Literal["taken", "failed", "skipped"]


@dataclass(kw_only=True)
class Flown:
    """A satellite in flight and what it has done so far.

    Attributes
    ----------
    on_board
        What the recorder holds, first in, first out: target (None for telemetry), share of it.
    down
        When each image was downlinked.
    """

    number: int
    resources: Resources
    luck: Luck
    time: datetime = START
    commands: tuple[Command, ...] = ()
    on_board: deque[tuple[str | None, float]] = field(default_factory=deque)
    reports: list[Report] = field(default_factory=list)
    down: dict[str, datetime] = field(default_factory=dict)
    num_skipped_contacts: int = 0

    def __post_init__(self) -> None:
        self.battery = self.resources.initial_battery_fraction
        if self.resources.initial_recorder_fraction > 0.0:
            self.on_board.append((None, self.resources.initial_recorder_fraction))
        self._safe = self.luck.safe_modes(self.number)

    @property
    def recorder(self) -> float:
        """How full the recorder is."""
        return sum(share for _, share in self.on_board)

    def safe_until(self, at: datetime) -> datetime | None:
        """Return when the safe mode at an instant ends; None if there is none."""
        return next((end for start, end in self._safe if start <= at < end), None)

    def free_from(self, at: datetime) -> datetime:
        """Return the first instant, from one on, at which no command runs."""
        for command in self.commands:
            if command.start < at < command.end:
                at = command.end
        return at

    def fly(self, until: datetime) -> None:
        """Continue as commanded, up to an instant at which no command runs."""
        left = []
        for command in self.commands:
            if command.end > until:
                left.append(command)
                continue
            self._idle(command.start)
            self._do(command)
        self._idle(until)
        self.commands = tuple(left)

    def _idle(self, until: datetime) -> None:
        span_s = (until - self.time).total_seconds()
        if span_s <= 0.0:
            return
        charge = self.resources.sunpoint_charge_per_s - self.resources.idle_drain_per_s
        self.battery = min(1.0, self.battery + charge * span_s)
        self._write(None, self.resources.telemetry_per_s * span_s)
        self.time = until

    def _do(self, command: Command) -> None:
        r = self.resources
        span_s = (command.end - command.start).total_seconds()
        is_image = command.mode == "collect"
        drain = r.collect_drain_per_s if is_image else r.contact_drain_per_s
        battery = self.battery - (drain + r.idle_drain_per_s) * span_s
        is_safe = any(s < command.end and e > command.start for s, e in self._safe)
        telemetry = r.telemetry_per_s * span_s
        written = r.collect_fill_per_s * span_s if is_image else 0.0
        has_room = self.recorder + telemetry + written < r.recorder_max_fraction + _EDGE
        if is_safe or battery < r.battery_min_fraction - _EDGE or (is_image and not has_room):
            if is_image:
                self._report(command, "skipped")
            else:
                self.num_skipped_contacts += 1
            self._idle(command.end)
            return
        self.battery = battery
        if not is_image:
            is_lost = self.luck.pass_is_lost(self.number, command.site_id, command.start)
            self._write(None, telemetry)
            if not is_lost:
                self._take_down(r.downlink_per_s * span_s, command.end)
            self.time = command.end
            return
        self.time = command.end
        if self.luck.image_fails(self.number, command.site_id, command.start):
            self._write(None, telemetry)
            self._report(command, "failed")
        else:
            self._write(command.site_id, telemetry + written)
            self._report(command, "taken")

    def _report(self, command: Command, outcome: Literal["taken", "failed", "skipped"]) -> None:
        self.reports.append(Report(target_id=command.site_id, at=command.end, outcome=outcome))

    def _write(self, target_id: str | None, share: float) -> None:
        if share > 0.0:
            self.on_board.append((target_id, min(share, max(0.0, 1.0 - self.recorder))))

    def _take_down(self, share: float, at: datetime) -> None:
        while self.on_board and share > 0.0:
            target_id, own = self.on_board.popleft()
            if own > share + _EDGE:
                self.on_board.appendleft((target_id, own - share))
                return
            share -= own
            if target_id is not None:
                self.down[target_id] = at


def worth_down(requests: Iterable[Request], fleet: Iterable[Flown]) -> float:
    """Return the worth of what is downlinked, each target once."""
    reward = {request.target.id: request.target.reward for request in requests}
    down = {target_id for flown in fleet for target_id in flown.down}
    return sum(reward[target_id] for target_id in down)
