"""What tells two plans apart."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Instant, Open, Wire
from service.wire.pins import PinnedMode

Difference = Literal["scenario", "horizon", "satellites", "use_resources", "dynamics"]


class PlannedOut(Wire):
    """A collect or a contact."""

    satellite_id: str
    satellite_name: str | None = None
    mode: Open[PinnedMode]
    target_id: str | None
    target_name: str | None = Field(None, description="Of a collect whose target has one.")
    station_id: str | None
    station_name: str | None = Field(None, description="Of a contact.")
    start: Instant
    end: Instant


class MovedOut(Wire):
    """The same target, or the same satellite's contact of a station, at another time."""

    before: PlannedOut
    after: PlannedOut


class TotalDiff(Wire):
    """A figure of both plans, which differs; null where there is none."""

    before: float | None
    after: float | None
    delta: float | None = Field(description="After less before; null where one is missing.")


class DiffOut(Wire):
    """From the first job's plan to the second's; nothing of it for the same plan."""

    before: str = Field(description="The first job.")
    after: str = Field(description="The second one.")
    is_empty: bool = Field(description="Whether actions and totals are the same.")
    questions_differ_in: tuple[Open[Difference], ...] = Field(
        description="Where the jobs did not plan the same: `scenario` with anything else that is "
        "listed, or alone where pins, settings or targets differ."
    )
    added: tuple[PlannedOut, ...]
    removed: tuple[PlannedOut, ...]
    moved: tuple[MovedOut, ...]
    totals: dict[str, TotalDiff] = Field(
        description="`reward`, `collects`, `contacts`, `targets` (imaged and counted), "
        "`delivered`, `age_mean_s`, what is downlinked, the lowest battery and the fullest "
        "recorder; only those that differ."
    )
