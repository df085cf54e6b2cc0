"""What is nearly always a mistake in a question that can be planned all the same."""

from __future__ import annotations

from planner_core.domain import Satellite, Scenario, Target
from planner_core.problem import CONTACT, Opportunities

_RADAR = ("sar", "radar")


def usual_mistakes(scenario: Scenario) -> tuple[str, ...]:
    """Return sentences about a question, before anything of it is worked out."""
    found = (_at_night(scenario), _no_station(scenario), _too_large(scenario))
    return tuple(warning for warning in found if warning is not None)


def mistakes_of_accesses(scenario: Scenario, table: Opportunities) -> tuple[str, ...]:
    """Return sentences about what satellites see of a question's targets and stations."""
    if not (scenario.use_resources and scenario.ground_stations) or (table.kind == CONTACT).any():
        return ()
    return ("No satellite has a contact with any ground station: no image comes down.",)


def _at_night(scenario: Scenario) -> str | None:
    """Warn where neither sensor nor target nor quality minds the sun, and the sensor is no radar.

    The paper's presets know no light, on purpose.
    """
    blind = [s for s in scenario.satellites if not _minds_the_sun(s)]
    dark = sum(target.sun_elevation_min_deg is None for target in scenario.targets)
    if not blind or not dark or scenario.quality.sun_elevation_deg:
        return None
    return (
        f"Satellite {blind[0].name!r}{_others(len(blind))} may image {dark} of "
        f"{len(scenario.targets)} targets at night: give sun_elevation_min_deg to the sensor or to "
        "the targets, or sensor_type radar to a sensor that needs no light."
    )


def _minds_the_sun(satellite: Satellite) -> bool:
    sensor_type = (satellite.sensor.sensor_type or "").lower()
    return (
        satellite.sensor.sun_elevation_min_deg is not None
        or satellite.resources.recorder_capacity_mbit is None
        or any(word in sensor_type for word in _RADAR)
    )


def _no_station(scenario: Scenario) -> str | None:
    if scenario.use_resources and not scenario.ground_stations:
        return "There is no ground station: no image comes down."
    return None


def _too_large(scenario: Scenario) -> str | None:
    if not scenario.use_resources:
        return None
    large = [t for t in scenario.targets if not any(_fits(t, s) for s in scenario.satellites)]
    if not large:
        return None
    return (
        f"An image of target {large[0].id!r}{_others(len(large))} is larger than the recorder of "
        "every satellite: shorten collect_s or enlarge recorder_capacity_mbit."
    )


def _fits(target: Target, satellite: Satellite) -> bool:
    resources = satellite.resources
    return target.collect_s * resources.collect_fill_per_s <= resources.recorder_max_fraction


def _others(number: int) -> str:
    return "" if number == 1 else f" and {number - 1} more"
