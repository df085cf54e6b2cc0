"""Targets across all plans: the state of each so far."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Instant, Open, Wire
from service.wire.plans import Outcome
from service.wire.sites import TargetIn

TargetState = Literal["open", "planned", "collected", "delivered", "expired", "cancelled"]


class TargetCollectOut(Wire):
    """The image that determines a target's state."""

    plan_id: str
    action_id: str
    satellite_id: str
    satellite_name: str
    start: Instant
    end: Instant
    outcome: Open[Outcome] | None = Field(description="The last one reported.")


class TargetLifeOut(Wire):
    """A target of a catalogue, and its state."""

    catalog_id: str
    catalog_name: str
    target: TargetIn
    state: Open[TargetState]
    collect: TargetCollectOut | None = Field(
        description="The image that was taken, or else the next one in a published plan."
    )
