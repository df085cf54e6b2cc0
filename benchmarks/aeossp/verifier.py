"""The benchmark's rules: whether a solution is valid, and how good it is.

Written from the rules that the benchmark publishes (README and SPEC of aeossp_standard), with its
own geometry: it shares nothing with the planner that it judges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.aeossp.battery import Drawn, draw
from benchmarks.aeossp.case import Case, Observation, time_text
from benchmarks.aeossp.geometry import Sky, angle_deg, turn_s

_ROUNDING = 1e-9
_ANGLE_ROUNDING_DEG = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A broken rule; ``action`` is -1 and ``task_id`` empty if none is concerned."""

    action: int
    satellite_id: str
    task_id: str
    stage: str
    reason: str
    time: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The benchmark's verdict on a solution; its four metrics are zero if it is invalid.

    Attributes
    ----------
    completed
        For each completed task, the action that completed it first.
    drawn
        The battery's history of each satellite.
    """

    is_valid: bool
    completed_share: float
    weighted_share: float
    turnaround_s: float | None
    energy_wh: float
    failures: tuple[Failure, ...]
    completed: dict[str, int]
    drawn: dict[str, Drawn]


def verify(case: Case, observations: Sequence[Observation]) -> Verdict:
    """Return the verdict on a solution."""
    check = _Check(case, observations, Sky.of(case))
    kept = [i for i in range(len(observations)) if check.fits_rules(i) and check.is_visible(i)]
    by_satellite: dict[str, list[int]] = {}
    for i in kept:
        by_satellite.setdefault(observations[i].satellite_id, []).append(i)
    reached: list[int] = []
    turns: dict[str, list[tuple[float, float]]] = {}
    for satellite_id, own in by_satellite.items():
        taken, turns[satellite_id] = check.turns(satellite_id, own)
        reached += taken
    drawn = {}
    for satellite_id in case.satellites:
        images = [observations[i] for i in reached if observations[i].satellite_id == satellite_id]
        drawn[satellite_id] = draw(
            case, check.sky, satellite_id, images, turns.get(satellite_id, [])
        )
        check.note_empty(satellite_id, drawn[satellite_id], reached)
    completed: dict[str, int] = {}
    for i in sorted(reached, key=lambda i: (observations[i].end_s, observations[i].start_s, i)):
        completed.setdefault(observations[i].task_id, i)
    return _judged(case, observations, check.failures, completed, drawn)


def _judged(
    case: Case,
    observations: Sequence[Observation],
    failures: Sequence[Failure],
    completed: dict[str, int],
    drawn: dict[str, Drawn],
) -> Verdict:
    is_valid = not failures
    counted = completed if is_valid else {}
    weight = sum(task.weight for task in case.tasks.values())
    late_s = [observations[i].end_s - case.tasks[task].release_s for task, i in counted.items()]
    return Verdict(
        is_valid=is_valid,
        completed_share=len(counted) / len(case.tasks),
        weighted_share=sum(case.tasks[task].weight for task in counted) / weight,
        turnaround_s=float(np.mean(late_s)) if late_s else None,
        energy_wh=sum(one.used_wh for one in drawn.values()) if is_valid else 0.0,
        failures=tuple(failures),
        completed=completed,
        drawn=drawn,
    )


@dataclass(slots=True)
class _Check:
    case: Case
    observations: Sequence[Observation]
    sky: Sky
    failures: list[Failure] = field(default_factory=list)

    def _fail(self, i: int, stage: str, reason: str, t_s: float) -> bool:
        one = self.observations[i]
        self.failures.append(
            Failure(action=i, satellite_id=one.satellite_id, task_id=one.task_id, stage=stage,
                    reason=reason, time=time_text(self.case, t_s))
        )  # fmt: skip
        return False

    def fits_rules(self, i: int) -> bool:
        """Return whether a task allows an action, ignoring geometry."""
        one, case = self.observations[i], self.case
        satellite, task = case.satellites.get(one.satellite_id), case.tasks.get(one.task_id)
        reason, t_s = "", one.start_s
        off_grid = [t for t in (one.start_s, one.end_s) if t % case.action_step_s != 0.0]
        if satellite is None:
            reason = "unknown satellite_id"
        elif task is None:
            reason = "unknown task_id"
        elif one.end_s <= one.start_s:
            reason = "end_time must be after start_time"
        elif one.start_s < 0.0 or one.end_s > case.horizon_s:
            reason = "action lies outside the mission horizon"
        elif off_grid:
            reason = f"it must align to the {case.action_step_s}s action grid"
            t_s = off_grid[0]
        elif one.start_s < task.release_s or one.end_s > task.due_s:
            reason = "action lies outside the task window"
        elif one.end_s - one.start_s != task.duration_s:
            reason = "action duration must equal required_duration_s"
        elif satellite.sensor_type != task.sensor_type:
            reason = "satellite sensor_type does not match task required_sensor_type"
        return self._fail(i, "structure", reason, t_s) if reason else True

    def is_visible(self, i: int) -> bool:
        """Return whether the target is visible and within the limits at every sample."""
        one = self.observations[i]
        task, satellite = self.case.tasks[one.task_id], self.case.satellites[one.satellite_id]
        step_s = self.case.geometry_step_s
        grid = np.arange(np.floor(one.start_s / step_s) + 1, np.ceil(one.end_s / step_s)) * step_s
        t_s = np.array([one.start_s, *grid, one.end_s])
        at, target = self.sky.satellite(satellite.id, t_s), self.sky.target(task, t_s)
        sight = target - at
        is_hidden = np.einsum("ij,ij->i", sight, target) >= 0.0
        is_beyond = angle_deg(-at, sight) > satellite.off_nadir_max_deg + _ANGLE_ROUNDING_DEG
        for k in np.flatnonzero(is_hidden | is_beyond):
            reason = "required pointing exceeds max_off_nadir_deg"
            if is_hidden[k]:
                reason = "target is not continuously visible"
            return self._fail(i, "geometry", reason, float(t_s[k]))
        return True

    def turns(
        self, satellite_id: str, own: list[int]
    ) -> tuple[list[int], list[tuple[float, float]]]:
        """Return the actions that a satellite reaches in time, and when it slews to them.

        It points at nadir at first. Actions it does not reach are not executed.
        """
        satellite = self.case.satellites[satellite_id]
        taken: list[int] = []
        spans = []
        own = sorted(
            own, key=lambda i: (self.observations[i].start_s, self.observations[i].end_s, i)
        )
        for i in own:
            one = self.observations[i]
            start = np.array([one.start_s])
            at = self.sky.satellite(satellite_id, start)
            sight = self.sky.target(self.case.tasks[one.task_id], start) - at
            before, free_s = -at, one.start_s
            if taken:
                last = self.observations[taken[-1]]
                if last.end_s > one.start_s:
                    reason = "observation actions overlap on the same satellite"
                    self._fail(i, "slew", reason, one.start_s)
                    continue
                end = np.array([last.end_s])
                before = self.sky.target(self.case.tasks[last.task_id], end)
                before = before - self.sky.satellite(satellite_id, end)
                free_s = one.start_s - last.end_s
            angle = float(angle_deg(before, sight)[0])
            needed_s = satellite.settle_s + turn_s(
                angle, satellite.slew_rate_deg_s, satellite.acceleration_deg_s2
            )
            if free_s + _ROUNDING < needed_s:
                reason = (
                    "insufficient slew/settle time before observation "
                    f"(need {needed_s:.3f}s, have {free_s:.3f}s)"
                )
                self._fail(i, "slew", reason, one.start_s)
                continue
            taken.append(i)
            spans.append((one.start_s - needed_s, one.start_s))
        return taken, spans

    def note_empty(self, satellite_id: str, drawn: Drawn, reached: Sequence[int]) -> None:
        """Record when a battery runs empty, and the image taken at that time."""
        if drawn.empty_s is None:
            return
        during = [
            i
            for i in reached
            if self.observations[i].satellite_id == satellite_id
            and self.observations[i].start_s <= drawn.empty_s < self.observations[i].end_s
        ]
        self.failures.append(
            Failure(
                action=during[0] if during else -1,
                satellite_id=satellite_id,
                task_id=self.observations[during[0]].task_id if during else "",
                stage="battery",
                reason="battery depletes below zero",
                time=time_text(self.case, drawn.empty_s),
            )
        )
