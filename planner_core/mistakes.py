"""Warnings of what is nearly always a mistake in a scenario, although it can be planned."""

from __future__ import annotations

import math

import numpy as np

from planner_core.domain import Satellite, Scenario, Target
from planner_core.geography.land import may_be_land
from planner_core.orbits.frames import EARTH_POLAR_RADIUS_M, EARTH_ROTATION_RAD_S
from planner_core.problem import COLLECT, CONTACT, Opportunities

_RADAR = ("sar", "radar")
_LEAST_TARGETS = 10
_MUCH_AT_SEA = 0.4
_SWAPPED_ON_LAND = 0.8
_MOST_AT_SEA = 0.8
_MU_M3_S2 = 3.986004418e14
# More than osculating radii and geodetic nadirs differ from mean and geocentric ones.
_SPARE_RAD = math.radians(1.0)


def usual_mistakes(scenario: Scenario) -> tuple[str, ...]:
    """Return warnings about a scenario, before anything of it is computed."""
    found = (
        _at_sea(scenario),
        _at_night(scenario),
        _never_ages(scenario),
        _no_station(scenario),
        _too_large(scenario),
        _too_hungry(scenario),
        _too_long(scenario),
    )
    return tuple(warning for warning in found if warning is not None)


def mistakes_of_accesses(scenario: Scenario, table: Opportunities) -> tuple[str, ...]:
    """Return warnings about when satellites see a scenario's targets and stations."""
    if not (scenario.use_resources and scenario.ground_stations):
        return ()
    if not (table.kind == CONTACT).any():
        return ("No satellite has a contact with any ground station: no image can be downlinked.",)
    too_much = _more_than_contacts_take(scenario, table)
    return () if too_much is None else (too_much,)


def _more_than_contacts_take(scenario: Scenario, table: Opportunities) -> str | None:
    """Warn if one image of each target in sight is more than all contacts together take down.

    Images count as small as they can be and contacts at their satellite's highest rate, without
    conflicts. So if there is a warning, it is true whatever is planned.
    """
    capacities = [s.resources.recorder_capacity_mbit for s in scenario.satellites]
    known = np.array([1.0 if one is None else one for one in capacities])
    if len(known) > 1 and None in capacities:
        return None  # there is no common measure
    length_s = table.end_s - table.start_s
    resources = [satellite.resources for satellite in scenario.satellites]
    fill_per_s = known * [r.collect_fill_per_s for r in resources]
    taken_per_s = known * [
        max((rate for _, rate in r.downlink_by_elevation), default=r.downlink_per_s)
        for r in resources
    ]
    least = np.full(len(scenario.targets), np.inf)
    collects = np.flatnonzero(table.kind == COLLECT)
    sizes = (length_s * fill_per_s[table.satellite])[collects]
    np.minimum.at(least, table.site[collects], sizes)
    contacts = np.flatnonzero(table.kind == CONTACT)
    stations = [scenario.ground_stations[site] for site in table.site[contacts].tolist()]
    useful_s = np.maximum(length_s[contacts] - [s.setup_s for s in stations], 0.0)
    gains = np.array([s.downlink_gain for s in stations])
    most = float((useful_s * taken_per_s[table.satellite[contacts]] * gains).sum())
    needed = float(least[np.isfinite(least)].sum())
    if needed <= most:
        return None
    return (
        f"All contacts together can downlink at most {100.0 * most / needed:.0f} % of one image of "
        "each visible target: add ground stations or plan a longer horizon."
    )


def _at_sea(scenario: Scenario) -> str | None:
    """Warn if most targets are at sea, and say if swapping latitude and longitude would help.

    Targets drawn over the whole globe are no mistake: seven of ten are at sea.
    """
    targets = scenario.targets
    if len(targets) < _LEAST_TARGETS:
        return None
    lat_deg, lon_deg = ([getattr(t, name) for t in targets] for name in ("lat_deg", "lon_deg"))
    at_sea = ~may_be_land(lat_deg, lon_deg)
    share = float(at_sea.mean())
    can_swap = np.abs(lon_deg) <= 90.0
    swapped = np.where(can_swap, may_be_land(np.where(can_swap, lon_deg, 0.0), lat_deg), False)
    if share > _MUCH_AT_SEA and float(swapped.mean()) > _SWAPPED_ON_LAND:
        return (
            f"{at_sea.sum()} of {len(targets)} targets are at sea, and {swapped.sum()} would be on "
            "land with latitude and longitude swapped: check the columns of the catalogue."
        )
    if share > _MOST_AT_SEA:
        first = targets[int(np.flatnonzero(at_sea)[0])].title
        return (
            f"{at_sea.sum()} of {len(targets)} targets are at sea, the first of them {first!r}: "
            "check signs and columns if that is not intended."
        )
    return None


def _at_night(scenario: Scenario) -> str | None:
    """Warn if neither sensor nor target nor quality limits sun elevation, and there is no radar.

    The paper's presets deliberately ignore light: they have no recorder capacity in megabits.
    """
    blind = [s for s in scenario.satellites if not _minds_the_sun(s)]
    dark = sum(target.sun_elevation_min_deg is None for target in scenario.targets)
    if not blind or not dark or scenario.quality.sun_elevation_deg:
        return None
    return (
        f"Satellite {blind[0].name!r}{_others(len(blind))} may image {dark} of "
        f"{len(scenario.targets)} targets at night: set sun_elevation_min_deg for the sensor or "
        "the targets, or sensor_type radar for a sensor that needs no light."
    )


def _minds_the_sun(satellite: Satellite) -> bool:
    sensor_type = (satellite.sensor.sensor_type or "").lower()
    return (
        satellite.sensor.sun_elevation_min_deg is not None
        or satellite.resources.recorder_capacity_mbit is None
        or any(word in sensor_type for word in _RADAR)
    )


def _never_ages(scenario: Scenario) -> str | None:
    objective = scenario.objective
    if objective.half_life_s is None or objective.collected_share < 1.0:
        return None
    return (
        "The objective's half_life_s has no effect: with a collected_share of 1, the default "
        "beside it, images earn all of their worth when they are taken."
    )


def _no_station(scenario: Scenario) -> str | None:
    if scenario.use_resources and not scenario.ground_stations:
        return "There is no ground station: no image can be downlinked."
    return None


def _too_large(scenario: Scenario) -> str | None:
    if not scenario.use_resources:
        return None
    large = [t for t in scenario.targets if not any(_fits(t, s) for s in scenario.satellites)]
    if not large:
        return None
    return (
        f"An image of target {large[0].title!r}{_others(len(large))} is larger than the "
        "recorder of every satellite: shorten collect_s or enlarge recorder_capacity_mbit."
    )


def _fits(target: Target, satellite: Satellite) -> bool:
    resources = satellite.resources
    return target.collect_s * resources.collect_fill_per_s <= resources.recorder_max_fraction


def _too_hungry(scenario: Scenario) -> str | None:
    if not scenario.use_resources:
        return None
    hungry = [t for t in scenario.targets if not any(_is_fed(t, s) for s in scenario.satellites)]
    if not hungry:
        return None
    return (
        f"An image of target {hungry[0].title!r}{_others(len(hungry))} needs more energy than the "
        "battery of any satellite may supply: shorten collect_s or enlarge battery_capacity_wh."
    )


def _is_fed(target: Target, satellite: Satellite) -> bool:
    resources = satellite.resources
    return target.collect_s * resources.collect_drain_per_s <= 1.0 - resources.battery_min_fraction


def _too_long(scenario: Scenario) -> str | None:
    longest_s = max(_longest_access_s(one) for one in scenario.satellites)
    long = [target for target in scenario.targets if target.collect_s > longest_s]
    if not long:
        return None
    return (
        f"An image of target {long[0].title!r}{_others(len(long))} takes longer than any satellite "
        f"sees a target (at most {longest_s:.0f} s): shorten collect_s."
    )


def _longest_access_s(satellite: Satellite) -> float:
    """Return a time that no access exceeds: the passage from one edge of the view to the other.

    The satellite is farthest and slowest at its apogee, and a site on the ground moves along with
    it no faster than the Earth rotates.
    """
    rate_rad_s = 2.0 * math.pi / satellite.orbit.period_s
    axis_m = math.cbrt(_MU_M3_S2 / rate_rad_s**2)
    eccentricity = satellite.orbit.eccentricity
    apogee_m = axis_m * (1.0 + eccentricity)
    slowest_rad_s = rate_rad_s * math.sqrt(1.0 - eccentricity**2) * (axis_m / apogee_m) ** 2
    passing_rad_s = slowest_rad_s - EARTH_ROTATION_RAD_S
    if passing_rad_s <= 0.0:
        return math.inf
    off_nadir_rad = math.radians(satellite.sensor.off_nadir_max_deg)
    ratio = apogee_m / EARTH_POLAR_RADIUS_M
    sine = ratio * math.sin(off_nadir_rad)
    reach_rad = math.asin(sine) - off_nadir_rad if sine < 1.0 else math.acos(1.0 / ratio)
    return 2.0 * (reach_rad + _SPARE_RAD) / passing_rad_s


def _others(number: int) -> str:
    return "" if number == 1 else f" and {number - 1} more"
