"""Spacecraft types: figures that satellites of one kind share."""

from __future__ import annotations

from pydantic import Field

from service.wire.base import Body, Instant, Name, Patch, Stored
from service.wire.satellites import AgilityIn, Figures, OwnResourcesField, ResourcesField, SensorIn


class SpacecraftIn(Figures):
    """A type of spacecraft. Settings left out are those of `generic_optical`, or of its preset."""

    name: Name


class SpacecraftPatch(Patch):
    """Changes to a type; fields that are left out or null stay as they are."""

    name: Name | None = None
    agility: AgilityIn | None = Field(None, description="Only the settings given are changed.")
    sensor: SensorIn | None = Field(None, description="Only the settings given are changed.")
    resources: OwnResourcesField | None = Field(
        None, description="Only the figures given are changed; a preset replaces them all."
    )


class WholeSpacecraft(Body):
    """A type with all its figures."""

    name: Name
    agility: AgilityIn
    sensor: SensorIn
    resources: ResourcesField


class SpacecraftOut(Stored):
    """A type of spacecraft."""

    id: str = Field(description="The name, for a built-in type.")
    name: str
    agility: AgilityIn
    sensor: SensorIn
    resources: ResourcesField
    is_built_in: bool = Field(description="Built-in types cannot be changed.")
    created_at: Instant | None = Field(description="Null for a built-in type.")
