"""The constants of ``certified``: the fields of its tuning, each halved and doubled.

A field that compiled kernels read is a constant in them and is left out.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import fields
from types import ModuleType
from typing import Any, Final

from benchmarks.ablation.strategies import Change
from planner_core import certified
from planner_core.certified.tuning import TUNING, Tuning

FACTORS: Final = {"half": 0.5, "double": 2.0}
_ONE: Final = {"paper-500": 12.0, "weights-1000": 15.0}
_AGILITY: Final = {"agility-1000": 12.0}
_PASSES: Final = {"spaced-1000": 12.0}
_FREE: Final = {"continuous-1000": 30.0}
_FLEET: Final = {"fleet-4x2000": 8.0}
_STATIONS: Final = {"fleet-stations-4x2000": 30.0}
_AGE: Final = {"half-life-12h-1000": 12.0}
_DELIVERED: Final = {"delivered-paper-500": 12.0}
_SUN: Final = {"share-sun-fleet-4x500": 15.0, "sun-fleet-4x2000": 20.0}
_PACKAGES: Final[Mapping[str, Mapping[str, float]]] = {
    "strategies.agility": {**_AGILITY, **_PASSES},
    "strategies.resources": _ONE,
    "strategies.resource_steps": _ONE,
    "strategies.resource_fleet": _STATIONS,
    "strategies.supports": {**_ONE, **_FLEET},
    "strategies.fleet": _FLEET,
    "strategies.continuous": _FREE,
    "strategies.half_life": _AGE,
    "strategies.half_life_steps": _AGE,
    "lns.alternating": {**_ONE, **_STATIONS, **_SUN},
    "lns.choices": _ONE,
    "lns.continuous_search": _FREE,
    "lns.downlinks": _DELIVERED,
    "lns.fleet_start": _FLEET,
    "lns.insertion_with_resources": _FREE,
    "lns.queue_plans": _AGE,
    "lns.resource_search": {**_ONE, **_STATIONS},
    "lns.search": {**_AGILITY, **_FLEET},
    "mip.contact_sets": _ONE,
    "mip.program_search": {**_STATIONS, "weights-fleet-4x2000": 20.0},
    "mip.restricted_master": _AGILITY,
    "mip.solution_pool": {**_FLEET, **_STATIONS},
    "multipliers.ascent": {**_FLEET, **_PASSES},
    "multipliers.chains": _FREE,
    "multipliers.elementary": _PASSES,
    "multipliers.energy": _STATIONS,
    "multipliers.latency": _AGE,
    "multipliers.paths": {**_AGILITY, **_FLEET},
    "multipliers.resources": _ONE,
    "proofs.continuous": _FREE,
    "proofs.lagrangian": _AGILITY,
    "proofs.latency": _AGE,
    "proofs.resource_bound": {**_ONE, **_DELIVERED},
    "proofs.satellite_relaxation": {**_ONE, **_DELIVERED},
    "proofs.shares": _ONE,
}
"""Families on which a module's constants have an effect, and CPU seconds."""


def constants() -> dict[str, Change]:
    """Return half and double of each constant, by name and factor."""
    readers: dict[str, set[str]] = {}
    for module in modules():
        for name in fields_read_by(module):
            readers.setdefault(name, set()).add(module.__name__.split(".", 2)[2])
    changes = {}
    for each in fields(Tuning):
        packages = sorted(readers.get(each.name, set()) & set(_PACKAGES))
        families = {family: s for package in packages for family, s in _PACKAGES[package].items()}
        for label, factor in FACTORS.items():
            value = getattr(TUNING, each.name)
            if families and (changed := scaled(value, factor)) != value:
                changes[f"{each.name} {label}"] = Change(
                    tuning={each.name: changed}, families=families, num_draws=1
                )
    return changes


def modules() -> Iterator[ModuleType]:
    """Yield the engine's modules."""
    for found in pkgutil.walk_packages(certified.__path__, f"{certified.__name__}."):
        yield importlib.import_module(found.name)


def fields_read_by(module: ModuleType) -> set[str]:
    """Return which fields of the tuning a module reads each time it runs.

    A value read once, for its kernels, is kept under a name in capitals.
    """
    # A module of a file has a loader that knows its source.
    source: str = module.__loader__.get_source(module.__name__)  # type: ignore[union-attr]
    running = "\n".join(line for line in source.splitlines() if line[:1].isspace())
    return {each.name for each in fields(Tuning) if f"TUNING.{each.name}" in running}


def scaled(value: Any, factor: float) -> Any:
    """Return one or several numbers times a factor; integers stay integers, at least 1.

    For a share above one half the rest to 1 is multiplied: 0.98, 0.99, 0.995.
    """
    if isinstance(value, tuple):
        return tuple(scaled(each, factor) for each in value)
    if isinstance(value, int):
        return max(1, round(value * factor)) if value else 0
    if 0.5 < value < 1.0:
        return 1.0 - (1.0 - value) / factor
    return value * factor
