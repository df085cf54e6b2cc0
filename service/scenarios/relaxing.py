"""A scenario file with changed settings; errors point into the change."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner_core.errors import Fault, InvalidScenario, pointing
from service.problems.faults import pointer_to
from service.scenarios.translate import read_file, scenario_from_file
from service.wire.changes import PART_OF, RelaxIn
from service.wire.instants import instant_text
from service.wire.scenarios import ScenarioFile
from service.wire.sites import TargetIn

_OF_TARGETS = TargetIn.model_fields.keys() - {"id", "name", "lat_deg", "lon_deg", "alt_m"}


def relaxed_file(file: ScenarioFile, relax: RelaxIn) -> ScenarioFile:
    """Return the file with changed settings.

    Raises
    ------
    InvalidScenario, InvalidElements
        If a name is unknown or a value is invalid; with a pointer into ``/relax``.
    """
    relaxing = _Relaxing(file)
    relaxing.set_satellites(relax)
    relaxing.set_targets(relax.targets)
    if relax.horizon_end is not None:
        relaxing.set(("horizon",), "end", instant_text(relax.horizon_end), "/relax/horizon_end")
    return relaxing.checked()


class _Relaxing:
    """A file under change, and the location in the body of each new value."""

    def __init__(self, file: ScenarioFile):
        self._document: dict[str, Any] = file.model_dump(mode="json")
        self._places: dict[str, str] = {}

    def set(self, path: tuple[str | int, ...], name: str, value: object, place: str) -> None:
        part: Any = self._document
        for step in path:
            part = part[step]
        part[name] = value
        self._places["/".join(["", *map(str, path), name])] = place

    def set_satellites(self, relax: RelaxIn) -> None:
        ids = [satellite["id"] for satellite in self._document["satellites"]]
        if relax.satellite_id is not None and relax.satellite_id not in ids:
            raise _unknown("satellite", relax.satellite_id, "/relax/satellite_id")
        for own_id in relax.satellites:
            if own_id not in ids:
                raise _unknown("satellite", own_id, pointer_to("relax", "satellites", own_id))
        for index, own_id in enumerate(ids):
            if relax.satellite_id in (None, own_id):
                self._set_satellite(index, relax.settings, "/relax")
            at = pointer_to("relax", "satellites", own_id)
            self._set_satellite(index, relax.satellites.get(own_id, {}), at)

    def _set_satellite(self, index: int, settings: Mapping[str, object], at: str) -> None:
        satellite = self._document["satellites"][index]
        for name, value in settings.items():
            part = PART_OF.get(name)
            if part is None:
                raise _unknown_setting(name, at)
            if isinstance(satellite[part], str):
                satellite[part] = {"preset": satellite[part]}
            self.set(("satellites", index, part), name, value, at + pointer_to(name))

    def set_targets(self, targets: Mapping[str, Mapping[str, object]]) -> None:
        index = {target["id"]: i for i, target in enumerate(self._document["targets"])}
        for own_id, settings in targets.items():
            at = pointer_to("relax", "targets", own_id)
            if own_id not in index:
                raise _unknown("target", own_id, at)
            for name, value in settings.items():
                if name not in _OF_TARGETS:
                    raise _unknown_setting(name, at)
                self.set(("targets", index[own_id]), name, value, f"{at}/{name}")

    def checked(self) -> ScenarioFile:
        with pointing(self._place):
            file = read_file(self._document)
            scenario_from_file(file)
            return file

    def _place(self, fault: Fault) -> str:
        pointer = fault.pointer or ""
        return pointer if pointer.startswith("/pins") else self._places.get(pointer, "/relax")


def _unknown(what: str, own_id: str, pointer: str) -> InvalidScenario:
    return InvalidScenario(
        f"unknown_{what}", f"The scenario has no {what} {own_id!r}.", pointer=pointer
    )


def _unknown_setting(name: str, at: str) -> InvalidScenario:
    return InvalidScenario(
        "unknown_field", f"There is no setting {name!r}.", pointer=at + pointer_to(name)
    )
