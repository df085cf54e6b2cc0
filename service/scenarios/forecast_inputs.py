"""Clear skies of a scenario file, and from what is stored into it.

What is frozen are the series of the targets, not the grid that they come from: a forecast is
linear in time, so a target's values at the forecast's instants say all of it. That is less than
the target itself takes, whatever the size of the grid, and the hash is of the very numbers that
are planned with: two forecasts that say the same of a question make the same question.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
from sqlalchemy.orm import Session

from planner_core.domain import Forecast, SkySeries
from planner_core.errors import InvalidScenario
from service.db.rows import ForecastRow
from service.forecasts.fields import from_bytes, time_ms_of
from service.stores import forecast_store
from service.wire.scenarios import FileForecast, HorizonIn, ScenarioFile, SkySeriesIn

_DIGITS = 4
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def find_forecast(session: Session, forecast_id: str, owner: str | None) -> ForecastRow:
    """Return a forecast of an owner's, its block too; ``unknown_forecast`` where there is none."""
    row = forecast_store.find(session, forecast_id, owner)
    if row is None:
        raise InvalidScenario(
            "unknown_forecast", f"There is no forecast {forecast_id!r}.", pointer="/forecast_id"
        )
    return row


def frozen_forecast(row: ForecastRow, file: ScenarioFile) -> FileForecast:
    """Return what a stored forecast says of a file's targets, over its horizon."""
    targets = file.targets
    skies = from_bytes(row.block).over(
        [target.id for target in targets],
        np.array([target.lat_deg for target in targets]),
        np.array([target.lon_deg for target in targets]),
        time_ms_of(file.horizon.start),
        time_ms_of(file.horizon.end),
    )
    series = [
        SkySeriesIn(
            times=[_EPOCH + timedelta(milliseconds=time) for time in one.time_ms.tolist()],
            clear_probability={
                targets[position].id: values
                for position, values in zip(
                    one.target.tolist(),
                    np.round(one.clear_probability, _DIGITS).tolist(),
                    strict=True,
                )
            },
        )
        for one in skies
    ]
    return FileForecast(default_clear_probability=row.default_clear_probability, series=series)


def forecast_from(file: ScenarioFile) -> Forecast | None:
    """Return the clear skies of a file.

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
