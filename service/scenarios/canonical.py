"""The canonical form of a scenario file, whose SHA-256 identifies the scenario.

It has all defaults filled in, instants in UTC with milliseconds, sorted keys and no name. A field
added after the first release is left out if its value means the same as its absence.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Final

from service.scenarios.translate import read_file
from service.wire.scenarios import ScenarioFile

_UNSET_OF_TARGETS: Final = (
    "catalog_id", "name", "release", "due", "sensor_type", "reward_half_life_s",
)  # fmt: skip

_YOUNGER: Final[Mapping[str, object]] = {
    "sun_pointing": "free",
    "panel_angle_deg": 180.0,
    "idle_power_w": 0.0,
}


def canonical(content: Mapping[str, Any]) -> str:
    """Return the canonical form of a scenario file, as one line of JSON.

    Raises
    ------
    InvalidScenario, InvalidElements
        If the file does not fit the schema, or an orbit cannot be read.
    """
    return canonical_of_file(read_file(content))


def sha256_of(canonical_text: str) -> str:
    """Return the SHA-256 of a canonical form, in hexadecimal."""
    return hashlib.sha256(canonical_text.encode()).hexdigest()


def canonical_of_file(file: ScenarioFile) -> str:
    """Return the canonical form of a file returned by `read_file`."""
    document = file.model_dump(mode="json", exclude={"name", "release"})
    for satellite in document["satellites"]:
        _without_unset(satellite, "tle", "omm", "oem")
        if satellite["spacecraft"] not in (None, "paper", "paper_code"):
            continue  # what is left out would be taken from its type
        del satellite["spacecraft"]
        _without_unset(satellite["sensor"], "sensor_type", "sun_exclusion_deg")
        _without_unset(satellite["agility"], "sun_exclusion_deg")
        _without(satellite["agility"], slew_model="rest")
        if isinstance(satellite["resources"], dict):
            _without(satellite["resources"], **_YOUNGER)
    for station in document["ground_stations"]:
        _without(station, setup_s=0.0, downlink_gain=1.0)
    for target in document["targets"]:
        _without_unset(target, *_UNSET_OF_TARGETS)
    _without_unset(document, "forecast")
    _without(document, collect_alignment="access")
    _without_unset(document, "replan")
    if "replan" in document:
        _plain_replan(document["replan"])
    _plain_objective(document)
    for outage in document["outages"]:
        _without_unset(outage, "id", "satellite_id", "station_id", "reason")
    for state in document["states"]:
        _plain_state(state)
    _without(document, outages=[], states=[])
    for part in ("pins", "quality"):
        if not any(document[part].values()):
            del document[part]
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _plain_replan(replan: dict[str, Any]) -> None:
    """Leave out fields of a replan that are unset or younger and at their default."""
    for action in replan["base"]:
        _without_unset(action, *tuple(action))
    for promise in replan["promises"]:
        _without_unset(promise, "deliver_by")
    for flown in replan["flown"]:
        _without_unset(flown, "target_id", "station_id", "mbit")
    for state in replan["before"]:
        _plain_state(state)
    _without(replan, flown=[], before=[], elements="same")


def _plain_state(state: dict[str, Any]) -> None:
    """Leave unset fields out of a state."""
    _without_unset(state, "battery_fraction", "recorder_fraction", "attitude", "on_board")
    for image in state.get("on_board", ()):
        _without_unset(image, "mbit", "recorder_fraction", "worth")
    if "attitude" in state:
        _without_unset(state["attitude"], *tuple(state["attitude"]))


def _plain_objective(document: dict[str, Any]) -> None:
    """Leave defaults out of the objective."""
    objective = document["objective"]
    if not objective["prefer"]:
        del objective["prefer"]
        if not _counts_delivery(objective):
            del document["objective"]
    elif not _counts_delivery(objective):
        objective["half_life_s"] = None


def _counts_delivery(objective: Mapping[str, Any]) -> bool:
    """Whether images earn less than all when taken; only then does a half-life matter."""
    return bool(objective["collected_share"] < 1.0)


def _without_unset(part: dict[str, Any], *names: str) -> None:
    """Leave out fields that are null, so that scenarios older than a field keep their hash."""
    for name in names:
        if part[name] is None:
            del part[name]


def _without(part: dict[str, Any], **plain: object) -> None:
    """Leave out fields at these values, which scenarios older than the fields imply."""
    for name, value in plain.items():
        if part.get(name) == value:
            del part[name]
