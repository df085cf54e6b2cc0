"""Forecasts of clear skies."""

from __future__ import annotations

from service.client.collection import Collection
from service.client.uploads import Source, upload
from service.wire.forecasts import ForecastOut as Forecast


class Forecasts(Collection[Forecast]):
    """The stored forecasts, without their values.

    When a forecast is deleted, scenarios keep its values for their targets.
    """

    _name, _shape = "forecasts", Forecast

    def create(
        self,
        name: str,
        file: Source,
        form: str | None = None,
        *,
        default_clear_probability: float | None = None,
        idempotency_key: str | None = None,
    ) -> Forecast:
        """Store a forecast, whole or not at all.

        Parameters
        ----------
        file, form
            A file, or its content and form: ``csv`` or ``netcdf``.
        default_clear_probability
            For targets and instants that the file does not cover; if None, scenarios with such
            are refused.
        """
        return self._transport.post(
            self._path(),
            Forecast,
            params={"name": name, "default_clear_probability": default_clear_probability},
            idempotency_key=idempotency_key,
            **upload(file, form),
        )
