"""Battery and recorder while a satellite does nothing but look at the sun."""

from __future__ import annotations

from dataclasses import replace

from planner_core.domain import Horizon, Resources, Satellite, State
from planner_core.orbits.eclipse import always_sunlit, sunlight
from planner_core.orbits.ephemeris import propagate
from planner_core.problem import Sunlight


def started(satellite: Satellite, state: State | None, horizon: Horizon) -> Resources:
    """Return a satellite's resources with what it has at the horizon's start.

    From the state's instant on it idles: panels at the sun, where that is seen, and telemetry into
    the recorder. No turn is counted, since where it pointed is not known.

    Raises
    ------
    PropagationFailed
        SGP4 stops before the horizon begins.
    """
    resources = satellite.resources
    if state is None:
        return resources
    waited_s = (horizon.start - state.at).total_seconds()
    battery, recorder = state.battery_fraction, state.recorder_fraction
    if waited_s > 0.0:
        if battery is not None:
            lit = always_sunlit(waited_s)
            if resources.eclipse_aware:
                lit = sunlight(propagate(satellite, Horizon(start=state.at, end=horizon.start)))
            battery = battery_after(resources, battery, lit, waited_s)
        if recorder is not None:
            recorder = min(1.0, recorder + resources.telemetry_per_s * waited_s)
    return replace(
        resources,
        initial_battery_fraction=(
            resources.initial_battery_fraction if battery is None else battery
        ),
        initial_recorder_fraction=(
            resources.initial_recorder_fraction if recorder is None else recorder
        ),
    )


def battery_after(resources: Resources, battery: float, lit: Sunlight, span_s: float) -> float:
    """Return what a battery holds after a span of idling, as a fraction of capacity.

    Parameters
    ----------
    lit
        When panels are in sunlight, in seconds from the span's start; disjoint and in order.
    """
    idle_per_s, at_s = resources.idle_drain_per_s, 0.0
    charge_per_s = resources.sunpoint_charge_per_s - idle_per_s
    for enter_s, exit_s in zip(lit.enter_s.tolist(), lit.exit_s.tolist(), strict=True):
        battery = max(0.0, battery - idle_per_s * (enter_s - at_s))
        battery = min(1.0, max(0.0, battery + charge_per_s * (exit_s - enter_s)))
        at_s = exit_s
    return max(0.0, battery - idle_per_s * (span_s - at_s))
