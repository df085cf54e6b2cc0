"""Forecasts of clear skies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.wire.base import Instant, Open, Stored

Ends = Annotated[tuple[float, ...], Field(min_length=2, max_length=2)]


class ForecastOut(Stored):
    """A forecast: how likely the sky is clear, by place and time."""

    id: str
    name: str
    kind: Open[Literal["grid", "targets"]] = Field(
        description="A grid is bilinear in place; values by target are for the ids of targets. "
        "Both are linear in time."
    )
    sha256: str = Field(description="Of what it says, in whatever form it came.")
    first: Instant = Field(description="The first instant that it tells of.")
    last: Instant
    num_times: int
    num_values: int
    num_targets: int | None = Field(None, description="Of values by target.")
    lat_deg: Ends | None = Field(None, description="First and last row of a grid.")
    lon_deg: Ends | None = Field(
        None, description="First and last column of a grid; it may go round the globe."
    )
    default_clear_probability: float | None = Field(
        description="Of targets and instants that it does not cover; null to refuse those."
    )
    notes: tuple[str, ...] = Field(description="How the file was read, for people.")
    created_at: Instant
