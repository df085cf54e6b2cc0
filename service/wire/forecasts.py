"""Forecasts of clear skies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.wire.base import Instant, Open, Stored

Ends = Annotated[tuple[float, ...], Field(min_length=2, max_length=2)]


class ForecastOut(Stored):
    """A forecast: the probability of a clear sky by position and time."""

    id: str
    name: str
    kind: Open[Literal["grid", "targets"]] = Field(
        description="`grid`: bilinear in latitude and longitude. `targets`: values by target id. "
        "Both are linear in time."
    )
    sha256: str = Field(description="Hash of its values, whatever the form of the file.")
    first: Instant = Field(description="The first instant that it covers.")
    last: Instant
    num_times: int
    num_values: int
    num_targets: int | None = Field(None, description="Only for values by target.")
    lat_deg: Ends | None = Field(None, description="First and last row of a grid.")
    lon_deg: Ends | None = Field(
        None, description="First and last column of a grid, which may span the globe."
    )
    default_clear_probability: float | None = Field(
        description="For targets and instants that it does not cover; null to refuse those."
    )
    notes: tuple[str, ...] = Field(description="How the file was read, for people.")
    created_at: Instant
