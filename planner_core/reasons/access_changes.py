"""The smallest changes of settings that give an opportunity to a target that has none, by trial.

Each limit is lifted alone; if that helps, its value is narrowed down by bisection.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any, Final

import numpy as np

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import Scenario, Sensor, Target
from planner_core.errors import PropagationFailed
from planner_core.pins import Pins
from planner_core.problem import COLLECT

_STEPS_A_DEG: Final = 10  # values are stated to a tenth of a degree
_LATER: Final = timedelta(days=3)

_LIMITS: Final = (
    # Each setting, and the value at which it excludes nothing.
    ("off_nadir_max_deg", 90.0),
    ("off_nadir_min_deg", 0.0),
    ("min_elevation_deg", 0.0),
    ("sun_elevation_min_deg", -90.0),
    ("sun_elevation_max_deg", 90.0),
    ("sun_exclusion_deg", 0.0),
)
_OF_SENSORS: Final = frozenset({"sun_exclusion_deg"})
"""Limits that targets do not have."""

_SWITCHES: Final = (("look_side", "any"), ("orbit_direction", "any"))

OF_TARGETS: Final = frozenset({"collect_s", "release", "due", "sensor_type"})
"""Settings that only the target has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AccessChange:
    """A value of a setting with which the target has an opportunity; computed, not estimated.

    Attributes
    ----------
    setting, value
        A field that is changed in every sensor and target whose own value is stricter, one of the
        target's ``OF_TARGETS``, or ``horizon_end``.
    satellite
        The satellite that could then image it.
    """

    setting: str
    value: float | str | datetime | None
    satellite: int


def access_changes(scenario: Scenario, target: int, budget: Budget) -> tuple[AccessChange, ...]:
    """Return changes each of which alone gives an opportunity to a target that has none.

    The result is empty if no single change does.

    Raises
    ------
    Cancelled
        The budget is spent before the search ends.
    """
    alone = replace(
        scenario,
        targets=(scenario.targets[target],),
        ground_stations=(),
        use_resources=False,
        pins=Pins(),
    )

    def imaged_by(changed: Scenario) -> int | None:
        table = compute_opportunities(changed, budget).opportunities
        collects = np.flatnonzero(table.kind == COLLECT)
        return int(table.satellite[collects[0]]) if len(collects) else None

    return tuple(_found(alone, imaged_by, budget))


def _found(
    alone: Scenario, imaged_by: Callable[[Scenario], int | None], budget: Budget
) -> Iterator[AccessChange]:
    for name, open_value in _LIMITS:
        satellite = imaged_by(_with_limit(alone, name, open_value))
        if satellite is None:
            continue
        value = _narrowed(alone, name, open_value, imaged_by)
        satellite = imaged_by(_with_limit(alone, name, value))
        if satellite is not None:
            yield AccessChange(setting=name, value=value, satellite=satellite)
    for name, open_side in _SWITCHES:
        satellite = imaged_by(_with(alone, name, open_side, lambda _: True))
        if satellite is not None:
            yield AccessChange(setting=name, value=open_side, satellite=satellite)
    yield from _sooner_or_later(alone, imaged_by, budget)
    if alone.targets[0].sensor_type is not None:
        satellite = imaged_by(_with_target(alone, "sensor_type", None))
        if satellite is not None:
            yield AccessChange(setting="sensor_type", value=None, satellite=satellite)
    shorter = _shorter(alone, imaged_by)
    if shorter is not None:
        yield shorter
    later = _later(alone, budget)
    if later is not None:
        yield later


def _with_target(alone: Scenario, name: str, value: object) -> Scenario:
    """Return the scenario with another value of a setting of its only target."""
    change: dict[str, Any] = {name: value}
    return replace(alone, targets=(replace(alone.targets[0], **change),))


def _sooner_or_later(
    alone: Scenario, imaged_by: Callable[[Scenario], int | None], budget: Budget
) -> Iterator[AccessChange]:
    """Yield the latest release and the earliest due time with which an access has room."""
    for name in ("release", "due"):
        if getattr(alone.targets[0], name) is None:
            continue
        table = compute_opportunities(_with_target(alone, name, None), budget).opportunities
        if len(table) == 0:
            continue
        starts_s, ends_s = table.start_s, table.end_s
        if alone.collect_alignment == "access":
            # Release and due times cut the access, and the collect is centred in what is left.
            length_s = ends_s - starts_s
            starts_s, ends_s = table.access_end_s - length_s, table.access_start_s + length_s
        whole_s = np.floor(starts_s.max()) if name == "release" else np.ceil(ends_s.min())
        value = alone.horizon.instant(float(whole_s))
        satellite = imaged_by(_with_target(alone, name, value))
        if satellite is not None:
            yield AccessChange(setting=name, value=value, satellite=satellite)


def _with_limit(scenario: Scenario, name: str, value: float) -> Scenario:
    """Return the scenario with a limit relaxed to ``value`` wherever it is stricter."""
    sign = -1.0 if "_max" in name else 1.0
    is_target_free = name in _OF_SENSORS

    def is_narrower(limits: Sensor | Target) -> bool:
        own = None if is_target_free and isinstance(limits, Target) else getattr(limits, name)
        return own is not None and sign * own > sign * value

    return _with(scenario, name, value, is_narrower)


def _with(
    scenario: Scenario, name: str, value: object, where: Callable[[Sensor | Target], bool]
) -> Scenario:
    change: dict[str, Any] = {name: value}
    return replace(
        scenario,
        satellites=tuple(
            replace(s, sensor=replace(s.sensor, **change)) if where(s.sensor) else s
            for s in scenario.satellites
        ),
        targets=tuple(replace(t, **change) if where(t) else t for t in scenario.targets),
    )


def _narrowed(
    alone: Scenario, name: str, open_value: float, imaged_by: Callable[[Scenario], int | None]
) -> float:
    """Return the strictest value that still suffices, by bisection."""
    targets = () if name in _OF_SENSORS else alone.targets
    own = [getattr(x, name) for x in (*(s.sensor for s in alone.satellites), *targets)]
    sign = -1.0 if "_max" in name else 1.0
    tight = max((sign * value for value in own if value is not None), default=sign * open_value)
    low = round(sign * open_value * _STEPS_A_DEG)
    high = round(tight * _STEPS_A_DEG)
    while high - low > 1:
        middle = (low + high) // 2
        enough = imaged_by(_with_limit(alone, name, sign * middle / _STEPS_A_DEG)) is not None
        low, high = (middle, high) if enough else (low, middle)
    return sign * low / _STEPS_A_DEG


def _shorter(alone: Scenario, imaged_by: Callable[[Scenario], int | None]) -> AccessChange | None:
    """Return the longest collect, in tenths of a second, that an access has room for."""
    (target,) = alone.targets

    def with_length(tenths: int) -> Scenario:
        return replace(alone, targets=(replace(target, collect_s=tenths / 10.0),))

    low, high = 1, max(1, round(target.collect_s * 10.0))
    if imaged_by(with_length(low)) is None:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if imaged_by(with_length(middle)) is None else (middle, high)
    satellite = imaged_by(with_length(low))
    assert satellite is not None
    return AccessChange(setting="collect_s", value=low / 10.0, satellite=satellite)


def _later(alone: Scenario, budget: Budget) -> AccessChange | None:
    """Return the end of the horizon with which the target gets its first opportunity."""
    horizon = replace(alone.horizon, end=alone.horizon.end + _LATER)
    try:
        table = compute_opportunities(replace(alone, horizon=horizon), budget).opportunities
    except PropagationFailed:
        return None
    if len(table) == 0:
        return None
    first = int(np.argmin(table.access_end_s))
    # The whole access must be in the horizon, or the collect would be centred in what is left.
    end = horizon.instant(float(np.ceil(table.access_end_s[first]) + 1.0))
    changed = replace(alone, horizon=replace(horizon, end=max(end, alone.horizon.end)))
    again = compute_opportunities(changed, budget).opportunities
    if len(again) == 0:
        return None
    return AccessChange(setting="horizon_end", value=end, satellite=int(again.satellite[0]))
