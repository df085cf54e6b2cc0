"""Built-in spacecraft types, as data, and how a body takes missing figures from a type.

docs/spacecraft.md gives the source of each figure. The figures are those of a class of
spacecraft, not of a particular one.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, Literal

from service.wire.satellites import PresetResourcesIn

Json = dict[str, Any]
BuiltIn = Literal["generic_optical", "generic_sar", "paper", "paper_code"]

DEFAULT: Final[BuiltIn] = "generic_optical"

_OPTICAL: Final[Json] = {
    "agility": {
        "slew_rate_deg_s": 3.0,
        "acceleration_deg_s2": 0.5,
        "settle_s": 2.0,
        "slew_model": "moving",
    },
    "sensor": {
        "off_nadir_min_deg": 0.0,
        "off_nadir_max_deg": 45.0,
        "sun_elevation_min_deg": 10.0,
        "sensor_type": "optical",
    },
    "resources": {
        "battery_capacity_wh": 500.0,
        "battery_min_fraction": 0.7,
        "initial_battery_fraction": 1.0,
        "sunpoint_power_w": 450.0,
        "idle_power_w": 130.0,
        "collect_power_w": 250.0,
        "contact_power_w": 80.0,
        "recorder_capacity_mbit": 600_000.0,
        "recorder_max_fraction": 0.9,
        "initial_recorder_fraction": 0.0,
        "collect_rate_mbit_s": 200.0,
        "downlink_rate_mbit_s": [
            [5.0, 150.0], [10.0, 200.0], [20.0, 270.0], [30.0, 338.0],
            [45.0, 450.0], [60.0, 500.0], [90.0, 600.0],
        ],
        "telemetry_rate_mbit_s": 0.032,
        "eclipse_aware": True,
        "sun_pointing": "slew",
        "panel_angle_deg": 180.0,
    },
}  # fmt: skip

_SAR: Final[Json] = {
    "agility": {
        "slew_rate_deg_s": 1.0,
        "acceleration_deg_s2": 0.1,
        "settle_s": 5.0,
        "slew_model": "moving",
    },
    "sensor": {
        "off_nadir_min_deg": 14.0,
        "off_nadir_max_deg": 32.0,
        "sensor_type": "sar",
    },
    "resources": {
        "battery_capacity_wh": 800.0,
        "battery_min_fraction": 0.7,
        "initial_battery_fraction": 1.0,
        "sunpoint_power_w": 450.0,
        "idle_power_w": 100.0,
        "collect_power_w": 2000.0,
        "contact_power_w": 60.0,
        "recorder_capacity_mbit": 500_000.0,
        "recorder_max_fraction": 0.9,
        "initial_recorder_fraction": 0.0,
        "collect_rate_mbit_s": 480.0,
        "downlink_rate_mbit_s": [
            [5.0, 35.0], [10.0, 47.0], [20.0, 63.0], [30.0, 79.0],
            [45.0, 105.0], [60.0, 117.0], [90.0, 140.0],
        ],
        "telemetry_rate_mbit_s": 0.032,
        "eclipse_aware": True,
        "sun_pointing": "slew",
        "panel_angle_deg": 180.0,
    },
}  # fmt: skip

BUILT_IN: Final[Mapping[str, Json]] = MappingProxyType(
    {
        "generic_optical": _OPTICAL,
        "generic_sar": _SAR,
        "paper": {"agility": {}, "sensor": {}, "resources": "paper"},
        "paper_code": {"agility": {}, "sensor": {}, "resources": "paper_code"},
    }
)
"""Agility, sensor and resources by type name. The paper's types leave out what is default."""

_PARTS: Final = ("agility", "sensor", "resources")


def type_named_by(given: Mapping[str, Any]) -> str:
    """Return the type of a satellite's body: the one it names, else its preset's, else the default.

    >>> type_named_by({"resources": {"preset": "paper_code"}}), type_named_by({})
    ('paper_code', 'generic_optical')
    """
    named = given.get("spacecraft")
    if named is not None:
        return str(named)
    resources = given.get("resources")
    preset = resources.get("preset") if isinstance(resources, Mapping) else resources
    return preset if isinstance(preset, str) and preset in BUILT_IN else DEFAULT


def filled(given: Mapping[str, Any], kind: Mapping[str, Any]) -> Json:
    """Return a body with missing settings taken from a type, one by one.

    Resources that are a preset replace those of the type. Over a type that is a preset, a body may
    change what a preset lets change; other figures need all resources, since it has no watt-hours.
    Without an acceleration, slews go from rest to rest unless the body says otherwise.
    """
    agility = {**kind["agility"], **_part(given, "agility")}
    if agility.get("acceleration_deg_s2") is None and "slew_model" not in _part(given, "agility"):
        agility.pop("slew_model", None)
    own, base = given.get("resources"), kind["resources"]
    resources: Any = base if own is None else own
    if isinstance(own, Mapping) and "preset" not in own:
        whole = {"preset": base} if isinstance(base, str) else base
        if "preset" not in whole or own.keys() <= PresetResourcesIn.model_fields.keys():
            resources = {**whole, **own}
    return {
        **given,
        "agility": agility,
        "sensor": {**kind["sensor"], **_part(given, "sensor")},
        "resources": resources,
    }


def _part(given: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    part = given.get(name)
    return part if isinstance(part, Mapping) else {}


def filled_file_satellite(given: Mapping[str, Any], release: object) -> Json:
    """Return a satellite of a scenario file with the figures of its type filled in.

    Files of the first release have no types: figures they leave out are the paper's. The same
    holds for the canonical form, which omits what questions of the first release did not say.
    """
    named = given.get("spacecraft")
    if named is None and release != 2:
        return dict(given)
    name = type_named_by(given)
    if name not in BUILT_IN:
        return dict(given)  # the schema says what is wrong with it
    whole = filled(given, BUILT_IN[name])
    uses_type = any(whole[part] != given.get(part) for part in _PARTS)
    if named is None and uses_type:
        whole["spacecraft"] = name
    return whole
