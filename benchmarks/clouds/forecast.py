"""The forecast of the synthetic weather for a mission's targets."""

from __future__ import annotations

from typing import Final

import numpy as np

from benchmarks.clouds.weather import Sites, Weather, position_km
from planner_core.domain import Forecast, Scenario, SkySeries

_HOURS: Final = np.arange(25.0)


def forecast_of(scenario: Scenario, weather: Weather) -> Forecast:
    """Return the forecast for every target, hour by hour."""
    lat_deg = np.array([target.lat_deg for target in scenario.targets])
    at_km = position_km(lat_deg, np.array([target.lon_deg for target in scenario.targets]))
    hourly = [
        weather.clear_probability(Sites(at_km, lat_deg, np.full(len(lat_deg), hour)))
        for hour in _HOURS
    ]
    series = SkySeries(
        target=np.arange(len(lat_deg)),
        time_s=3600.0 * _HOURS,
        clear_probability=np.column_stack(hourly),
    )
    return Forecast(series=(series,))
