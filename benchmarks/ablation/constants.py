"""The constants of ``certified``, found by their form, halved and doubled.

A constant is a number, or a few, under a name in capitals in a module of the engine. One that a
compiled kernel reads is frozen into it and is left out, as are limits of memory and tolerances of
rounding, which are for safety, sizes of arrays, and signs that stand for something.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator, Mapping
from types import ModuleType
from typing import Any, Final

from numba.core.dispatcher import Dispatcher

from benchmarks.ablation.strategies import Change, Patch

_ENGINE: Final = "planner_core.certified"
_CAPITALS: Final = re.compile(r"_?[A-Z][A-Z_]*")
FACTORS: Final = {"half": 0.5, "double": 2.0}
_LEFT_OUT: Final = frozenset({
    "TOLERANCE", "_TOLERANCE", "CHAIN_TOLERANCE", "_ROUNDING", "_CLEAR", "_INTEGER", "_SLACK",
    "_MAX_CELLS", "_MAX_LOG", "_MOST_KEPT", "_NUM_BITS", "_LONGEST_S", "_REPORT_EVERY_S", "_POLL_S",
    "FREE", "ELSEWHERE", "FIXED", "INFINITE", "_STARTS", "_TOLD", "VERSION", "LABELS", "MAX_NODES",
    "_SLOTS", "_SHARES",
})  # fmt: skip
_FAMILIES: Final[Mapping[str, Mapping[str, float]]] = {
    "drivers.agility_only": {"agility-500": 10.0, "spaced-1000": 12.0},
    "drivers.resources": {"paper-200": 10.0, "weights-1000": 15.0},
    "drivers.resource_steps": {"paper-200": 10.0, "weights-1000": 15.0},
    "drivers.resource_fleet": {"fleet-stations-4x2000": 40.0},
    "drivers.fleet": {"fleet-2x500": 10.0, "fleet-4x2000": 6.0},
    "drivers.continuous": {"continuous-1000": 12.0},
    "lns.continuous": {"continuous-1000": 12.0},
    "lns.insertion": {"continuous-1000": 12.0},
    "lns.alternating": {"fleet-stations-4x2000": 30.0},
    "lns.choices": {"paper-200": 10.0, "weights-1000": 15.0},
    "lns.fleet_start": {"fleet-4x2000": 6.0},
    "lns.resource": {"fleet-stations-4x2000": 30.0},
    "lns.stream": {"fleet-2x500": 10.0},
    "lns": {"agility-500": 10.0, "fleet-4x2000": 6.0},
    "mip.contact_sets": {"paper-200": 10.0, "weights-1000": 15.0},
    "mip.program_search": {"fleet-stations-4x2000": 40.0},
    "mip.solution_pool": {"fleet-2x500": 10.0},
    "mip": {"agility-500": 10.0, "agility-1000": 16.0},
    "multipliers.resources": {"paper-200": 10.0, "weights-1000": 15.0},
    "multipliers.energy": {"fleet-stations-4x2000": 30.0},
    "multipliers.elementary": {"spaced-1000": 12.0},
    "multipliers.chains": {"continuous-1000": 12.0},
    "multipliers.ascent": {"agility-500": 10.0, "fleet-4x2000": 6.0, "spaced-1000": 12.0},
    "multipliers.paths": {"agility-500": 10.0, "fleet-4x2000": 6.0},
    "multipliers": {"agility-500": 10.0, "agility-1000": 16.0},
    "proofs.continuous": {"continuous-1000": 12.0},
    "proofs": {"paper-200": 10.0, "weights-1000": 15.0},
    "dp": {"paper-200": 10.0, "weights-1000": 15.0},
}
"""Where the constants of a module act; the longest beginning of its name counts."""


def constants() -> dict[str, Change]:
    """Return half and double of each constant, by module, name and factor."""
    changes: dict[str, Change] = {}
    for module in modules():
        short = module.__name__.removeprefix(f"{_ENGINE}.")
        families = _families_of(short)
        frozen = _read_by_kernels(module)
        for name, value in vars(module).items():
            is_constant = _CAPITALS.fullmatch(name) and _is_number(value) and name not in _LEFT_OUT
            if not is_constant or name in frozen or not _is_own(module, name) or not families:
                continue
            for label, factor in FACTORS.items():
                changed = scaled(value, factor)
                if changed != value:
                    patch = Patch(module=module.__name__, name=name, value=changed)
                    changes[f"{short} {name} {label}"] = Change(patches=(patch,), families=families)
    return changes


def modules() -> Iterator[ModuleType]:
    """Yield the engine's modules."""
    engine = importlib.import_module(_ENGINE)
    for found in pkgutil.walk_packages(engine.__path__, f"{_ENGINE}."):
        yield importlib.import_module(found.name)


def scaled(value: Any, factor: float) -> Any:
    """Return a number, or several, times a factor; whole ones stay whole and 1 at least.

    Of a share above one half it is the rest to 1 that is multiplied: 0.98, 0.99, 0.995.
    """
    if isinstance(value, tuple):
        return tuple(scaled(each, factor) for each in value)
    if isinstance(value, int):
        return max(1, round(value * factor))
    if 0.5 < value < 1.0:
        return 1.0 - (1.0 - value) / factor
    return value * factor


def _is_number(value: Any) -> bool:
    if isinstance(value, tuple):
        return len(value) > 0 and all(map(_is_number, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_own(module: ModuleType, name: str) -> bool:
    """Return whether a module makes a constant itself, and did not import it."""
    source = module.__loader__.get_source(module.__name__)  # type: ignore[union-attr]  # ours have one
    return re.search(rf"^{name}\b[^=\n]*=", source, re.MULTILINE) is not None


def _read_by_kernels(module: ModuleType) -> set[str]:
    kernels = (value for value in vars(module).values() if isinstance(value, Dispatcher))
    return {name for kernel in kernels for name in kernel.py_func.__code__.co_names}


def _families_of(module: str) -> Mapping[str, float]:
    fitting = [start for start in _FAMILIES if module.startswith(start)]
    return _FAMILIES[max(fitting, key=len)] if fitting else {}
