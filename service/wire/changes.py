"""What-if questions of clients: actions forced or forbidden, and changed settings."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import ConfigDict, Discriminator, Field, JsonValue, Tag, model_validator
from pydantic_core import PydanticCustomError

from service.wire.base import Body, Id, Instant, require_plain
from service.wire.pins import PinnedActionIn
from service.wire.satellites import AgilityIn, ResourcesIn, SensorIn

PART_OF: Final[dict[str, str]] = {
    **dict.fromkeys(AgilityIn.model_fields, "agility"),
    **dict.fromkeys(SensorIn.model_fields, "sensor"),
    **dict.fromkeys(ResourcesIn.model_fields, "resources"),
}
"""The part of a satellite that each setting belongs to."""


def _show_settings(schema: dict[str, Any]) -> None:
    """Show every setting of a satellite as a property, without the default of a new one."""
    for part in (AgilityIn, SensorIn, ResourcesIn):
        for name, setting in part.model_json_schema()["properties"].items():
            schema["properties"][name] = {k: v for k, v in setting.items() if k != "default"}
    schema["additionalProperties"] = False


class RelaxIn(Body):
    """Changed settings, tighter or looser.

    Besides these fields it accepts every setting of `agility`, `sensor` and `resources` by name.
    The `change` of a reason and each of an explanation's `access_changes` can be sent unchanged.
    """

    model_config = ConfigDict(extra="allow", json_schema_extra=_show_settings)
    __pydantic_extra__: dict[str, JsonValue]

    satellite_id: Id | None = Field(
        None, description="Satellite to which settings apply by name; all satellites by default."
    )
    satellites: dict[Id, dict[str, JsonValue]] = Field(
        {}, description="By satellite: settings of its own, which override the others."
    )
    targets: dict[Id, dict[str, JsonValue]] = Field(
        {}, description="By target: its own limits, times, `reward` or `collect_s`."
    )
    horizon_end: Instant | None = Field(None, description="New end of the horizon.")
    drop_actions: list[Id] = Field(
        [], max_length=10_000, description="Ids of actions of the job's plan to leave out."
    )
    opportunity_id: Id | None = Field(
        None, description="Named in a reason's `change`; it changes nothing by itself."
    )

    @model_validator(mode="before")
    @classmethod
    def _holds_plain_values(cls, value: object) -> object:
        return require_plain(value)

    @property
    def settings(self) -> dict[str, JsonValue]:
        """The settings of one satellite or of all."""
        return self.__pydantic_extra__

    @property
    def is_empty(self) -> bool:
        """Whether nothing is changed."""
        told = (self.settings, self.satellites, self.targets, self.horizon_end, self.drop_actions)
        return not any(told)


def _form_of_action(value: object) -> str:
    return "action" if isinstance(value, dict | PinnedActionIn) else "target"


ActionField = Annotated[
    Annotated[Id, Tag("target")] | Annotated[PinnedActionIn, Tag("action")],
    Discriminator(_form_of_action),
]


class ChangeIn(Body):
    """Changes to a question."""

    force: list[ActionField] = Field(
        [],
        max_length=1000,
        description="Ids of targets, or actions as in `pins.keep`, that the plan must hold.",
    )
    forbid: list[ActionField] = Field(
        [],
        max_length=1000,
        description="Ids of targets, or actions as in `pins.skip`, that the plan may not hold.",
    )
    relax: RelaxIn = RelaxIn()

    @model_validator(mode="after")
    def _changes_something(self) -> ChangeIn:
        if not (self.force or self.forbid) and self.relax.is_empty:
            raise PydanticCustomError(
                "nothing_changed", "Give force, forbid or relax: the request changes nothing"
            )
        return self

    @property
    def needs_plan(self) -> bool:
        """Whether it refers to the plan that the job has found."""
        return bool(self.relax.drop_actions) or any(isinstance(a, str) for a in self.force)
