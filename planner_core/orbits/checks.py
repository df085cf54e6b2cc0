"""Checks that a scenario's orbits are good enough to plan with, and warnings for the reader."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from planner_core.domain import Horizon, OrbitEphemeris, Satellite, Scenario
from planner_core.errors import InvalidScenario
from planner_core.orbits import ephemeris
from planner_core.orbits.earth_orientation import shipped

LEO_PERIOD_S: Final = 128 * 60.0
OLD_ELEMENTS_DAYS: Final = 3.0
REFUSED_ELEMENTS_DAYS: Final = 30.0
_GENERIC: Final = ("generic_optical", "generic_sar")
_MOST_NAMED: Final = 20


def check_propagation(scenario: Scenario) -> None:
    """Refuse the first satellite whose orbit does not cover the horizon.

    Raises
    ------
    PropagationFailed
        SGP4 fails within the horizon.
    InvalidScenario
        ``orbit_outside_span`` if an ephemeris does not cover the horizon without a gap.
    """
    for position, satellite in enumerate(scenario.satellites):
        try:
            ephemeris.check_propagation(satellite, scenario.horizon)
        except InvalidScenario as error:
            error.fault = replace(error.fault, pointer=f"/satellites/{position}")
            raise


def check_element_age(scenario: Scenario) -> None:
    """Refuse element sets too old to plan with, unless the scenario allows them.

    Raises
    ------
    InvalidScenario
        A satellite in low orbit is more than 30 days from its epoch at some time in the
        horizon: its position along the orbit is then uncertain by minutes, not seconds.
    """
    if scenario.allow_old_elements:
        return
    ages_days = [_greatest_age_days(one, scenario.horizon) for one in scenario.satellites]
    old = [
        index
        for index, satellite in enumerate(scenario.satellites)
        if ages_days[index] > REFUSED_ELEMENTS_DAYS and satellite.orbit.period_s < LEO_PERIOD_S
    ]
    if not old:
        return
    named = [f"{scenario.satellites[i].name!r} {ages_days[i]:.0f}" for i in old[:_MOST_NAMED]]
    more = f" and {len(old) - _MOST_NAMED} more" if len(old) > _MOST_NAMED else ""
    raise InvalidScenario(
        "elements_too_old",
        f"{len(old)} of {len(scenario.satellites)} element sets are more than "
        f"{REFUSED_ELEMENTS_DAYS:.0f} days from their epochs within the horizon, in days: "
        f"{', '.join(named)}{more}. Store newer elements, or set allow_old_elements.",
        pointer=f"/satellites/{old[0]}",
    )


def orbit_warnings(scenario: Scenario) -> tuple[str, ...]:
    """Return warnings about element sets, built-in types, the Earth's orientation and starts."""
    ages = (_age_warning(satellite, scenario.horizon) for satellite in scenario.satellites)
    warnings = [warning for warning in ages if warning is not None]
    generic = sorted({s.spacecraft for s in scenario.satellites if s.spacecraft in _GENERIC})
    if generic:
        warnings.append(
            f"Satellites use the figures of the built-in type {' and '.join(generic)}, which are "
            "typical of their class: give your own agility, sensor and resources."
        )
    if not shipped().covers(scenario.horizon):
        warnings.append(
            "The horizon extends beyond the table of the Earth's orientation: its end values are "
            "used there, and access times may be off by up to a second."
        )
    if scenario.continuous_starts and not scenario.has_continuous_starts:
        warnings.append(
            "continuous_starts has no effect: with dynamics 'paper', tasks begin only at the "
            "starts of opportunities."
        )
    return tuple(warnings)


def _age_warning(satellite: Satellite, horizon: Horizon) -> str | None:
    orbit = satellite.orbit
    if isinstance(orbit, OrbitEphemeris):
        return None
    age_days = _greatest_age_days(satellite, horizon)
    if orbit.epoch > horizon.end:
        return (
            f"Satellite {satellite.name!r}: the element set's epoch lies after the horizon's end "
            f"({orbit.epoch:%Y-%m-%d})."
        )
    if orbit.period_s < LEO_PERIOD_S and age_days > OLD_ELEMENTS_DAYS:
        return (
            f"Satellite {satellite.name!r}: the element set is up to {age_days:.1f} days from "
            f"its epoch; expect errors of about a kilometre per day."
        )
    return None


def _greatest_age_days(satellite: Satellite, horizon: Horizon) -> float:
    """Return the longest time from its epoch, before or after, at which an element set is used."""
    if isinstance(satellite.orbit, OrbitEphemeris):
        return 0.0  # it is only used within its own span
    epoch_s = horizon.offset_s(satellite.orbit.epoch)
    return max(epoch_s, horizon.duration_s - epoch_s) / 86400.0
