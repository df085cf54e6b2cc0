"""Cases and solutions as in their files; instants are seconds from the horizon's start."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, TypeVar

import yaml


@dataclass(frozen=True, slots=True, kw_only=True)
class Satellite:
    id: str
    tle: tuple[str, str]
    sensor_type: str
    slew_rate_deg_s: float
    acceleration_deg_s2: float
    settle_s: float
    off_nadir_max_deg: float
    battery_capacity_wh: float
    initial_battery_wh: float
    idle_power_w: float
    imaging_power_w: float
    slew_power_w: float
    sunlit_charge_power_w: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    id: str
    lat_deg: float
    lon_deg: float
    alt_m: float
    release_s: float
    due_s: float
    duration_s: float
    sensor_type: str
    weight: float


T = TypeVar("T", Satellite, Task)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One case. The three steps are grids: of actions, of geometry and of the battery."""

    id: str
    start: datetime
    horizon_s: float
    action_step_s: int
    geometry_step_s: int
    resource_step_s: int
    satellites: Mapping[str, Satellite]
    tasks: Mapping[str, Task]

    def instant(self, t_s: float) -> datetime:
        """Return the instant ``t_s`` after the start."""
        return self.start + timedelta(seconds=t_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """One action of a solution."""

    satellite_id: str
    task_id: str
    start_s: float
    end_s: float


def read_case(folder: Path) -> Case:
    """Return the case of a folder with mission.yaml, satellites.yaml and tasks.yaml."""
    mission = _yaml(folder / "mission.yaml")["mission"]
    start = _instant(mission["horizon_start"])

    def after_s(text: str) -> float:
        return (_instant(text) - start).total_seconds()

    return Case(
        id=mission["case_id"],
        start=start,
        horizon_s=after_s(mission["horizon_end"]),
        action_step_s=mission["action_time_step_s"],
        geometry_step_s=mission["geometry_sample_step_s"],
        resource_step_s=mission["resource_sample_step_s"],
        satellites=_by_id(map(_satellite, _yaml(folder / "satellites.yaml")["satellites"])),
        tasks=_by_id(
            Task(
                id=row["task_id"],
                lat_deg=float(row["latitude_deg"]),
                lon_deg=float(row["longitude_deg"]),
                alt_m=float(row["altitude_m"]),
                release_s=after_s(row["release_time"]),
                due_s=after_s(row["due_time"]),
                duration_s=float(row["required_duration_s"]),
                sensor_type=row["required_sensor_type"],
                weight=float(row.get("weight", 1.0)),
            )
            for row in _yaml(folder / "tasks.yaml")["tasks"]
        ),
    )


def _satellite(row: Mapping[str, Any]) -> Satellite:
    attitude, power = row["attitude_model"], row["resource_model"]
    return Satellite(
        id=row["satellite_id"],
        tle=(row["tle_line1"], row["tle_line2"]),
        sensor_type=row["sensor"]["sensor_type"],
        slew_rate_deg_s=float(attitude["max_slew_velocity_deg_per_s"]),
        acceleration_deg_s2=float(attitude["max_slew_acceleration_deg_per_s2"]),
        settle_s=float(attitude["settling_time_s"]),
        off_nadir_max_deg=float(attitude["max_off_nadir_deg"]),
        battery_capacity_wh=float(power["battery_capacity_wh"]),
        initial_battery_wh=float(power["initial_battery_wh"]),
        idle_power_w=float(power["idle_power_w"]),
        imaging_power_w=float(power["imaging_power_w"]),
        slew_power_w=float(power["slew_power_w"]),
        sunlit_charge_power_w=float(power["sunlit_charge_power_w"]),
    )


def _by_id(items: Iterable[T]) -> dict[str, T]:
    found: dict[str, T] = {}
    for item in items:
        if item.id in found:
            raise ValueError(f"{item.id} appears twice")
        found[item.id] = item
    return found


def _yaml(path: Path) -> Any:
    # The C loader takes a tenth of the time; not every build of PyYAML has it.
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return yaml.load(path.read_bytes(), Loader=loader)


def _instant(text: str) -> datetime:
    return datetime.fromisoformat(text).astimezone(UTC)


def read_solution(case: Case, path: Path) -> list[Observation]:
    """Return the actions of a solution file.

    Raises
    ------
    ValueError
        If an action is not an observation.
    """
    observations = []
    for number, row in enumerate(json.loads(path.read_text())["actions"]):
        if row["type"] != "observation":
            raise ValueError(f"actions[{number}].type {row['type']!r} is unsupported")
        start_s, end_s = (
            (_instant(row[name]) - case.start).total_seconds()
            for name in ("start_time", "end_time")
        )
        observations.append(
            Observation(
                satellite_id=row["satellite_id"],
                task_id=row["task_id"],
                start_s=start_s,
                end_s=end_s,
            )
        )
    return observations


def write_solution(case: Case, observations: Iterable[Observation], path: Path) -> None:
    """Write a solution file."""
    actions = [
        {
            "type": "observation",
            "satellite_id": one.satellite_id,
            "task_id": one.task_id,
            "start_time": time_text(case, one.start_s),
            "end_time": time_text(case, one.end_s),
        }
        for one in observations
    ]
    path.write_text(json.dumps({"actions": actions}, indent=1) + "\n")


def time_text(case: Case, t_s: float) -> str:
    """Return an instant as the files write it."""
    return case.instant(t_s).isoformat().replace("+00:00", "Z")
