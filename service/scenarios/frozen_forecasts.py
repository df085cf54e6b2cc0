"""Stored forecasts, frozen into a scenario file.

The series of the targets are frozen, not the grid that they come from: a forecast is linear in
time, so a target's values at the forecast's instants are all of it. That takes less room than the
target itself, whatever the size of the grid, and the hash covers exactly the numbers used for
planning: two forecasts with the same values for a scenario give the same scenario.
"""

from __future__ import annotations

import numpy as np
from sqlalchemy.orm import Session

from planner_core.errors import InvalidScenario
from service.db.rows import ForecastRow
from service.forecasts.fields import from_bytes, instant_of, time_ms_of
from service.stores.finding import find_own
from service.wire.scenarios import FileForecast, ScenarioFile, SkySeriesIn

_DIGITS = 4


def find_forecast(session: Session, forecast_id: str, owner: str | None) -> ForecastRow:
    """Return an owner's forecast with its block; ``unknown_forecast`` if there is none."""
    row = find_own(session, ForecastRow, forecast_id, owner)
    if row is None:
        raise InvalidScenario(
            "unknown_forecast", f"There is no forecast {forecast_id!r}.", pointer="/forecast_id"
        )
    return row


def frozen_forecast(row: ForecastRow, file: ScenarioFile) -> FileForecast:
    """Return a stored forecast's values for a file's targets, over its horizon."""
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
            times=[instant_of(time_ms) for time_ms in one.time_ms.tolist()],
            clear_probability=dict(
                zip(
                    [targets[position].id for position in one.target.tolist()],
                    np.round(one.clear_probability, _DIGITS).tolist(),
                    strict=True,
                )
            ),
        )
        for one in skies
    ]
    return FileForecast(default_clear_probability=row.default_clear_probability, series=series)
