"""Forecasts of clear skies."""

from __future__ import annotations

from collections.abc import Iterator

from service.client.transport import Transport, path_of
from service.client.uploads import Source, upload
from service.wire.forecasts import ForecastOut as Forecast


class Forecasts:
    """The forecasts that are stored."""

    def __init__(self, transport: Transport):
        self._transport = transport

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
            Of targets and instants that the file does not cover; None to refuse scenarios with
            such.
        """
        content, headers = upload(file, form)
        params: dict[str, str | float] = {"name": name}
        if default_clear_probability is not None:
            params["default_clear_probability"] = default_clear_probability
        return self._transport.post(
            path_of("forecasts"),
            Forecast,
            params=params,
            content=content,
            headers=headers,
            idempotency_key=idempotency_key,
        )

    def list(self) -> Iterator[Forecast]:
        """Yield the forecasts, newest first."""
        return self._transport.pages(path_of("forecasts"), Forecast)

    def get(self, forecast_id: str) -> Forecast:
        """Return what is known of one forecast, without its values."""
        return self._transport.get(path_of("forecasts", forecast_id), Forecast)

    def delete(self, forecast_id: str, *, if_match: str | None = None) -> None:
        """Delete a forecast; scenarios keep what it said of their targets."""
        self._transport.delete(path_of("forecasts", forecast_id), if_match=if_match)
