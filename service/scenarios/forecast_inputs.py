"""The forecast in a scenario file, checked and prepared for the planner."""

from __future__ import annotations

import numpy as np

from planner_core.domain import Forecast, SkySeries
from planner_core.errors import InvalidScenario
from service.wire.scenarios import HorizonIn, ScenarioFile, SkySeriesIn


def forecast_from(file: ScenarioFile) -> Forecast | None:
    """Return the forecast of clear skies in a file.

    Raises
    ------
    InvalidScenario
        ``unknown_target``, ``value_out_of_range``; with a pointer into the file.
    """
    if file.forecast is None:
        return None
    index = {target.id: position for position, target in enumerate(file.targets)}
    seen: set[str] = set()
    series = []
    for number, one in enumerate(file.forecast.series):
        pointer = f"/forecast/series/{number}"
        for target_id in one.clear_probability:
            if target_id in seen or target_id not in index:
                raise InvalidScenario(
                    "value_out_of_range" if target_id in seen else "unknown_target",
                    f"Target {target_id!r} "
                    + ("is in two series." if target_id in seen else "is not in the scenario."),
                    pointer=f"{pointer}/clear_probability",
                )
            seen.add(target_id)
        series.append(_series(one, index, file.horizon, pointer))
    default = file.forecast.default_clear_probability
    return Forecast(series=tuple(series), default_clear_probability=default)


def _series(one: SkySeriesIn, index: dict[str, int], horizon: HorizonIn, pointer: str) -> SkySeries:
    number = len(one.times)
    for target_id, values in one.clear_probability.items():
        if len(values) != number:
            raise InvalidScenario(
                "value_out_of_range",
                f"Target {target_id!r} has {len(values)} values for {number} times.",
                pointer=f"{pointer}/clear_probability",
            )
    time_s = np.array([(time - horizon.start).total_seconds() for time in one.times])
    if np.any(np.diff(time_s) <= 0.0):
        raise InvalidScenario(
            "value_out_of_range", "Times must ascend.", pointer=f"{pointer}/times"
        )
    return SkySeries(
        target=np.array([index[target_id] for target_id in one.clear_probability]),
        time_s=time_s,
        clear_probability=np.array(list(one.clear_probability.values()), dtype=np.float64),
    )
