"""The verdict of a flight on a plan: pointing, contacts, battery and recorder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from benchmarks.flight.mission import Data, Floats, Mission, Power, Task
from benchmarks.flight.reference import STEP_S, Flight, Reference
from benchmarks.flight.world import elevation_deg, line_of_sight, orbit, satellite_km, sun_km

ON_TARGET_DEG: Final = 0.1
_SUN_EVERY: Final = 600  # steps for which the sun's direction is taken as constant

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Pointing:
    """How one task was flown.

    Attributes
    ----------
    late_s
        From the start to the last instant off target; 0 if it never was.
    """

    task: Task
    at_start: bool
    throughout: bool
    late_s: float
    worst_deg: float
    lowest_elevation_deg: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of a satellite's flight.

    Attributes
    ----------
    below_curve
        The most that the flown battery was below the timeline's curve, as a share of capacity.
    recorder_error
        Greatest difference between the recorder, integrated again, and the timeline's curve.
    nearest_sun_deg
        Least angle between boresight and sun.
    incidence
        Mean cosine of the sun's incidence on the panels, for each activity of the satellite.
    charged
        Capacities charged, for each way of counting.
    """

    mission: Mission
    pointing: tuple[Pointing, ...]
    too_short: tuple[str, ...]
    torque_share: float
    rate_share: float
    lowest_battery: float | None
    below_curve: float | None
    recorder_error: float | None
    nearest_sun_deg: float
    incidence: dict[str, float]
    charged: dict[str, float]

    def share(self, mode: str) -> float:
        """Return the share of the tasks of a mode that were on target throughout."""
        found = [each.throughout for each in self.pointing if each.task.mode == mode]
        return float(np.mean(found)) if found else 1.0


def judge(mission: Mission, reference: Reference, flight: Flight) -> Verdict:
    """Return the flight's verdict on the plan."""
    times_s = STEP_S * np.arange(len(flight.lit), dtype=np.float64)
    doing = _doing(mission, reference, times_s)
    from_sun_deg = _from_sun_deg(mission, flight)
    towards_sun = _incidence(mission, from_sun_deg)
    power, curve = mission.power, mission.curve
    battery = below = recorder_error = None
    charged: dict[str, float] = {}
    if power is not None and curve is not None:
        battery = _battery(power, flight.lit * towards_sun, doing)
        below = float(np.max(np.interp(times_s, curve.time_s, curve.battery) - battery))
        charged = _charged(power, flight.lit, towards_sun, doing)
    if mission.data is not None and curve is not None:
        held = _recorder(mission, mission.data, times_s)
        foretold = np.interp(times_s, curve.time_s, curve.recorder)
        recorder_error = float(np.abs(foretold - held).max())
    return Verdict(
        mission=mission,
        pointing=tuple(_pointing(mission, flight, times_s)),
        too_short=tuple(reference.too_short),
        torque_share=flight.torque_share,
        rate_share=float(flight.rate_deg_s.max() / mission.agility.rate_deg_s),
        lowest_battery=None if battery is None else float(battery.min()),
        below_curve=below,
        recorder_error=recorder_error,
        nearest_sun_deg=float(from_sun_deg.min()),
        incidence={what: float(towards_sun[at].mean()) for what, at in doing.items() if at.any()},
        charged=charged,
    )


def _pointing(mission: Mission, flight: Flight, times_s: Floats) -> Iterable[Pointing]:
    where = orbit(mission)
    for task in mission.tasks:
        first, last = np.searchsorted(times_s, [task.start_s, task.end_s + 1e-9])
        off_deg = np.empty(last - first)
        lowest_deg = 90.0
        for row in range(first, last):
            wanted, _ = line_of_sight(where, task.site.ecef_km, times_s[row])
            across = np.linalg.norm(np.cross(flight.boresight[row], wanted))
            off_deg[row - first] = np.degrees(np.arctan2(across, flight.boresight[row] @ wanted))
            lowest_deg = min(
                lowest_deg, elevation_deg(where, task.site.ecef_km, task.site.up, times_s[row])
            )
        is_off = off_deg > ON_TARGET_DEG
        # Up to the step after the last one off target.
        late_s = STEP_S * (float(np.flatnonzero(is_off)[-1]) + 1.0) if is_off.any() else 0.0
        yield Pointing(task, not is_off[0], not is_off.any(), late_s, float(off_deg.max()),
                       lowest_deg)  # fmt: skip


def _doing(mission: Mission, reference: Reference, times_s: Floats) -> dict[str, Bools]:
    """Return when the satellite had which activity."""
    doing = {
        mode: _within(times_s, ((t.start_s, t.end_s) for t in mission.tasks if t.mode == mode))
        for mode in ("collect", "contact")
    }
    doing["sun"] = _within(times_s, reference.visits)
    doing["turn"] = ~(doing["collect"] | doing["contact"] | doing["sun"])
    return doing


def _within(times_s: Floats, spans_s: Iterable[tuple[float, float]]) -> Bools:
    inside = np.zeros(len(times_s), dtype=np.bool_)
    for from_s, to_s in spans_s:
        first, last = np.searchsorted(times_s, [from_s, to_s])
        inside[first:last] = True
    return inside


def _from_sun_deg(mission: Mission, flight: Flight) -> Floats:
    """Return the angle between boresight and sun."""
    cosines = np.empty(len(flight.lit))
    where = orbit(mission)
    for first in range(0, len(cosines), _SUN_EVERY):
        rows = slice(first, first + _SUN_EVERY)
        sun = sun_km(mission, first * STEP_S) - satellite_km(where, first * STEP_S)[0]
        cosines[rows] = flight.boresight[rows] @ (sun / np.linalg.norm(sun))
    from_sun_deg: Floats = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    return from_sun_deg


def _incidence(mission: Mission, from_sun_deg: Floats) -> Floats:
    """Return the cosine of the sun's incidence on panels that turn freely about the boresight."""
    panel_deg = 180.0 if mission.power is None else mission.power.panel_angle_deg
    incidence: Floats = np.maximum(0.0, np.cos(np.radians(from_sun_deg - panel_deg)))
    return incidence


def _battery(power: Power, sunshine: Floats, doing: dict[str, Bools]) -> Floats:
    """Return the battery as the panels charge it, whatever the satellite does meanwhile."""
    rate = (
        power.sun_per_s * sunshine
        - power.idle_per_s
        - power.collect_per_s * doing["collect"]
        - power.contact_per_s * doing["contact"]
    )
    return _capped(power.initial, rate * STEP_S, 0.0, 1.0)


def _charged(
    power: Power, lit: Floats, towards_sun: Floats, doing: dict[str, Bools]
) -> dict[str, float]:
    """Return the capacities charged, as assumptions are removed one after the other."""
    idle = ~(doing["collect"] | doing["contact"])
    counted = {
        "in all idle time": idle.astype(np.float64),
        "once at the sun": doing["sun"].astype(np.float64),
        "and lit": doing["sun"] * lit,
        "by incidence, idle": idle * lit * towards_sun,
        "by incidence, always": lit * towards_sun,
    }
    return {what: float(power.sun_per_s * STEP_S * each.sum()) for what, each in counted.items()}


def _recorder(mission: Mission, data: Data, times_s: Floats) -> Floats:
    """Return the recorder's level, with the downlink rate at each instant's elevation."""
    where = orbit(mission)
    change = np.full(len(times_s), data.telemetry_per_s * STEP_S)
    for task in mission.tasks:
        if task.station is None:
            change += data.collect_per_s * _overlap_s(times_s, task.start_s, task.end_s)
            continue
        begins_s = task.start_s + task.station.setup_s
        downs_s = _overlap_s(times_s, begins_s, task.end_s)
        for row in np.flatnonzero(downs_s):
            middle_s = np.clip(times_s[row] + STEP_S / 2.0, begins_s, task.end_s)
            height_deg = elevation_deg(where, task.site.ecef_km, task.site.up, float(middle_s))
            rate = np.interp(height_deg, data.downlink_elevation_deg, data.downlink_per_s)
            change[row] -= task.station.gain * rate * downs_s[row]
    return _capped(data.initial, change, 0.0, np.inf)


def _overlap_s(times_s: Floats, from_s: float, to_s: float) -> Floats:
    """Return how much of each step lies within a span."""
    ends_s = np.minimum(times_s + STEP_S, to_s)
    overlap_s: Floats = np.maximum(0.0, ends_s - np.maximum(times_s, from_s))
    return overlap_s


def _capped(initial: float, change: Floats, least: float, most: float) -> Floats:
    """Return a running sum kept within limits. A step's change appears at the next step."""
    held = np.empty(len(change))
    now = initial
    for row, amount in enumerate(change.tolist()):
        held[row] = now
        now = min(most, max(least, now + amount))
    return held
