"""What tasks take from a satellite's battery and recorder, and the levels after a step.

The physics of a step is here once, for the readable model and the compiled search loops alike.

Both dynamics of the plan model reduce to the same arithmetic. After task ``i`` the battery and the
recorder are known, each at a time of its own; the next task ``j`` then costs fixed amounts:

==================  ============================  =====================================
column              ``physical``                  ``paper`` (event model)
==================  ============================  =====================================
``charge_from[i]``  sunlit time when the sun is   sunlit time at the start of i
                    reached after i (its end if
                    the sun needs no slew)
``charge_to[j]``    sunlit time when the sun is   sunlit time at the start of the event
                    left for j                    before j (j's own segment is forgone)
``data_from[i]``    end of i                      start of i
``data_to[j]``      start of j                    start of j
``data_peak[j]``    start of j                    start of the event before j
``battery_cost``    draw over the task            the same, booked at its start
``recorder_gain``   fill and telemetry, or        fill, or minus downlink (telemetry is
                    telemetry minus downlink      booked for all elapsed time)
``data_end``        end of the horizon            start of the last event
==================  ============================  =====================================
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.domain import Resources
from planner_core.jit import inlined
from planner_core.mdp.idle_energy import idle_energy
from planner_core.problem import CONTACT, Floats, Problem, SatelliteProblem
from planner_core.problem.sun_turns import SunTurns

STRICT: Final = 1e-9
"""How far inside its limits a planned state stays, so that rounding cannot cross them."""


@bundle
class ResourceColumns(NamedTuple):
    """Battery and recorder of one satellite; shape ``(m,)`` unless a number.

    ``charge_top_s[i]`` is the greatest ``charge_to_s`` up to row ``i``, as slews from the sun may
    put those out of order. ``battery_full`` is the most the battery can hold at a task's start,
    ``battery_floor`` what it must stay above at the task's end (see ``idle_energy``).
    """

    charge_from_s: Floats
    charge_to_s: Floats
    charge_top_s: Floats
    data_from_s: Floats
    data_to_s: Floats
    data_peak_s: Floats
    battery_full: Floats
    battery_floor: Floats
    battery_floor_least: Floats
    battery_cost: Floats
    recorder_gain: Floats
    data_end_s: float
    charge_per_s: float
    idle_per_s: float
    telemetry_per_s: float
    battery_min: float
    recorder_max: float
    battery_start: float
    recorder_start: float
    reserve_start: float


def resource_columns(problem: Problem, satellite: SatelliteProblem) -> ResourceColumns:
    """Return a satellite's battery and recorder, which limit nothing without resources."""
    satellite = with_counted_resources(problem, satellite)
    r = satellite.resources
    start_s, end_s = satellite.start_s, satellite.end_s
    duration_s = end_s - start_s
    contact = satellite.kind == CONTACT
    previous_start_s = satellite.previous_event_s
    telemetry = r.telemetry_per_s * duration_s
    # Telemetry fills the recorder until the setup of a contact is over.
    setup_s = np.zeros(len(satellite))
    setup_s[contact] = problem.downlinks.stations.setup_s[satellite.site[contact]]
    setup_s = np.minimum(setup_s, duration_s)
    physical = problem.dynamics == "physical"
    sunlit = satellite.sunlight.seconds_until
    idle = idle_energy(satellite, problem.horizon_s)
    charge_to_s = idle.sun_until_s if physical else sunlit(previous_start_s)
    return ResourceColumns(
        charge_from_s=idle.sun_from_s if physical else sunlit(start_s),
        charge_to_s=charge_to_s,
        charge_top_s=np.maximum.accumulate(charge_to_s),
        data_from_s=end_s if physical else start_s,
        data_to_s=start_s,
        data_peak_s=start_s + setup_s if physical else previous_start_s,
        battery_full=idle.full,
        battery_floor=r.battery_min_fraction + idle.reserve,
        battery_floor_least=r.battery_min_fraction + idle.least_reserve,
        battery_cost=duration_s
        * (np.where(contact, r.contact_drain_per_s, r.collect_drain_per_s) + r.idle_drain_per_s),
        recorder_gain=np.where(contact, -satellite.volume, duration_s * r.collect_fill_per_s)
        + (telemetry if physical else 0.0),
        data_end_s=problem.horizon_s
        if physical
        else float(satellite.event_s[-1])
        if len(satellite.event_s)
        else 0.0,
        charge_per_s=r.sunpoint_charge_per_s,
        idle_per_s=r.idle_drain_per_s,
        telemetry_per_s=r.telemetry_per_s,
        battery_min=r.battery_min_fraction,
        recorder_max=r.recorder_max_fraction,
        battery_start=r.initial_battery_fraction,
        recorder_start=r.initial_recorder_fraction,
        reserve_start=idle.reserve_start,
    )


def with_counted_resources(problem: Problem, satellite: SatelliteProblem) -> SatelliteProblem:
    """Return the satellite, with limitless resources if the problem is without resources."""
    if problem.use_resources:
        return satellite
    none = np.zeros(len(satellite))
    return replace(
        satellite, resources=Resources.limitless(), turns=SunTurns(none, none), volume=none
    )


@inlined
def take(
    resources: ResourceColumns, last: int, row: int, battery: float, recorder: float
) -> tuple[float, float, bool]:
    """Return battery, recorder and "within limits" after waiting from ``last`` and taking ``row``.

    Eqs. 6 and 7, with the sun-pointing in between (Table 1). Fractions of capacity.
    """
    charge_from_s = resources.charge_from_s[last] if last >= 0 else 0.0
    data_from_s = resources.data_from_s[last] if last >= 0 else 0.0
    charge_s = max(0.0, resources.charge_to_s[row] - charge_from_s)
    waited_s = max(0.0, resources.data_to_s[row] - data_from_s)
    peak = recorder + resources.telemetry_per_s * max(0.0, resources.data_peak_s[row] - data_from_s)
    battery = battery + resources.charge_per_s * charge_s - resources.idle_per_s * waited_s
    battery = min(resources.battery_full[row], battery) - resources.battery_cost[row]
    recorder = recorder + resources.telemetry_per_s * waited_s
    recorder = max(0.0, recorder + resources.recorder_gain[row])
    is_within = (
        battery > resources.battery_floor[row] + STRICT
        and recorder < resources.recorder_max - STRICT
        and peak < resources.recorder_max - STRICT
    )
    return max(0.0, battery), min(1.0, recorder), is_within
