"""The difference between two plans."""

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
    target_name: str | None = Field(None, description="For a collect whose target has a name.")
    station_id: str | None
    station_name: str | None = Field(None, description="Only for a contact.")
    start: Instant
    end: Instant


class MovedOut(Wire):
    """An action at another time: the same target, or the same satellite and station."""

    before: PlannedOut
    after: PlannedOut


class TotalDiff(Wire):
    """A figure that differs between the plans; null if a plan has none."""

    before: float | None
    after: float | None
    delta: float | None = Field(description="`after` minus `before`; null if one is missing.")


class DiffOut(Wire):
    """Changes from the first job's plan to the second's; empty if the plans are the same."""

    before: str = Field(description="The first job.")
    after: str = Field(description="The second job.")
    is_empty: bool = Field(description="Whether actions and totals are the same.")
    questions_differ_in: tuple[Open[Difference], ...] = Field(
        description="How the jobs' questions differ: `scenario` together with every other entry, "
        "or alone if pins, settings or targets differ."
    )
    added: tuple[PlannedOut, ...]
    removed: tuple[PlannedOut, ...]
    moved: tuple[MovedOut, ...]
    totals: dict[str, TotalDiff] = Field(
        description="`reward`, `collects`, `contacts`, `targets` (imaged and counted), "
        "`delivered`, `age_mean_s`, the data downlinked, the lowest battery level and the highest "
        "recorder level; only those that differ."
    )
