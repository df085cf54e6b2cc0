"""Synthetic weather that forecasts know in part: clear skies, their probability, and samples.

The sky over x is clear at t if Z(x, t) is above a threshold, which depends on a climatology by
latitude and on a regional anomaly. Z is rho F + sqrt(1 - rho^2) E: F is what a forecast knows, and
E its error. All three are Gaussian fields of exponential covariance.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_EARTH_KM: Final = 6371.0
_FEATURES: Final = 2000
_CLOUD_LAT_DEG: Final = (0.0, 25.0, 60.0)
_CLOUD_FRACTION: Final = (0.62, 0.38, 0.68)
"""Over land, by latitude."""
_ANOMALY_KM: Final = 1500.0
_ANOMALY: Final = 0.4
_SCALES: Final = ((0.6, 800.0, 18.0), (0.4, 200.0, 9.0))
"""Of the forecast: share of the variance, kilometres, hours."""
_ERROR_KM: Final = 300.0
_ERROR_H: Final = 6.0
_SKILL: Final = (0.85, 0.65)
"""Correlation of forecast and weather: now, and after a day."""
_NORMAL: Final = NormalDist()


def position_km(lat_deg: Floats, lon_deg: Floats) -> Floats:
    """Return positions on a sphere. Shape ``(n, 3)``."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    unit = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
    return _EARTH_KM * np.column_stack(unit)


class _Field:
    """A Gaussian field whose covariance falls as exp(-distance), by random Fourier features.

    The spectrum of that covariance is a multivariate Cauchy distribution, in any dimension.
    """

    def __init__(self, draw: np.random.Generator, dimensions: int):
        heavy = np.abs(draw.standard_normal((_FEATURES, 1)))
        self._frequency = draw.standard_normal((_FEATURES, dimensions)) / heavy
        self._phase = draw.uniform(0.0, 2.0 * np.pi, _FEATURES)

    def at(self, points: Floats) -> Floats:
        """Return the values at points, given in correlation lengths. Shape ``(n,)``."""
        waves = np.cos(points @ self._frequency.T + self._phase)
        values: Floats = np.sqrt(2.0 / _FEATURES) * waves.sum(axis=1)
        return values


@dataclass(frozen=True, slots=True)
class Sites:
    """Positions, latitudes and hours from the start. ``n`` each."""

    at_km: Floats
    lat_deg: Floats
    at_h: Floats


class Weather:
    """One draw of the regional anomalies and of the part that a forecast knows."""

    def __init__(self, seed: int):
        draw = np.random.default_rng(seed)
        self._anomaly = _Field(draw, 3)
        self._known = [_Field(draw, 4) for _ in _SCALES]

    def clear_probability(self, sites: Sites) -> Floats:
        """Return the forecast made at the start."""
        skill = _skill(sites.at_h)
        edge = skill * self._forecast(sites) - self._threshold(sites)
        return np.array([_NORMAL.cdf(z) for z in (edge / np.sqrt(1.0 - skill**2)).tolist()])

    def samples(
        self, sites: Sites, number: int, draw: np.random.Generator
    ) -> npt.NDArray[np.bool_]:
        """Return whether each of some sites is clear, in drawn skies. Shape ``(number, n)``."""
        skill = _skill(sites.at_h)
        scaled = np.column_stack([sites.at_km / _ERROR_KM, sites.at_h / _ERROR_H])
        away = np.linalg.norm(scaled[:, np.newaxis] - scaled[np.newaxis], axis=2)
        root = np.linalg.cholesky(np.exp(-away) + 1e-9 * np.eye(len(away)))
        error = draw.standard_normal((number, len(away))) @ root.T
        mean = skill * self._forecast(sites) - self._threshold(sites)
        clear: npt.NDArray[np.bool_] = mean + np.sqrt(1.0 - skill**2) * error > 0.0
        return clear

    def _forecast(self, sites: Sites) -> Floats:
        parts = [
            np.sqrt(share)
            * field.at(np.column_stack([sites.at_km / scale_km, sites.at_h / scale_h]))
            for field, (share, scale_km, scale_h) in zip(self._known, _SCALES, strict=True)
        ]
        total: Floats = np.sum(parts, axis=0)
        return total

    def _threshold(self, sites: Sites) -> Floats:
        fraction = np.interp(np.abs(sites.lat_deg), _CLOUD_LAT_DEG, _CLOUD_FRACTION)
        usual = np.array([_NORMAL.inv_cdf(share) for share in fraction.tolist()])
        return usual + _ANOMALY * self._anomaly.at(sites.at_km / _ANOMALY_KM)


def _skill(at_h: Floats) -> Floats:
    return np.interp(at_h, (0.0, 24.0), _SKILL)
