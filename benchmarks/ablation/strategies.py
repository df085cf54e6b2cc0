"""The strategies of ``certified`` and how each is switched off, by name.

Everything that a change of the engine may rename stands in ``STRATEGIES``. Bounds stay valid in
all variants: strategies are only left out, or begun at another time.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, Final

from planner_core.certified.lns.search import WindowSearch
from planner_core.certified.tuning import tune
from planner_core.precedence.network import Network
from planner_core.problem import Floats, Problem

DRIVERS: Final = "planner_core.certified.drivers"
NOTHING: Final = ""
"""The change that changes nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A name in a module, with dots for members of a class, and what takes its place there."""

    module: str
    name: str
    value: Any

    @property
    def place(self) -> tuple[Any, str]:
        """The module or class, and the name in it.

        Raises
        ------
        AttributeError
            Where there is no such name: a patch that misses would measure nothing.
        """
        *owners, last = self.name.split(".")
        owner = reduce(getattr, owners, importlib.import_module(self.module))
        if not hasattr(owner, last):
            raise AttributeError(f"{self.module} has no {self.name}")
        return owner, last

    def apply(self) -> None:
        """Put it there, for the rest of this process."""
        owner, last = self.place
        setattr(owner, last, self.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """What is changed, and on which families of the suite that may show.

    Attributes
    ----------
    families
        Names of families and the CPU seconds of a run.
    patches, tuning
        Names in modules that stand for something else, and other values of the tuning.
    num_draws
        How many missions of each family are planned, each with a seed of its own.
    """

    families: Mapping[str, float]
    patches: tuple[Patch, ...] = ()
    tuning: Mapping[str, Any] = field(default_factory=dict)
    num_draws: int = 2

    def apply(self) -> None:
        """Put all of it in force, for the rest of this process."""
        for patch in self.patches:
            patch.apply()
        tune(**self.tuning)


def _nothing(*_: object, **__: object) -> None:
    """Do nothing, whatever is asked for."""


class _Idle:
    """Takes the turns of another search without doing anything."""

    steps_beside = 6

    def __init__(self, *_: object) -> None:
        pass

    def turn(self) -> None:
        """Do nothing."""


def _without_urgency(
    problem: Problem, seed: int, network: Network, preference: Floats, urgency: Floats
) -> WindowSearch:
    """Return a window search whose moves begin anywhere."""
    del urgency
    return WindowSearch(problem, seed, network, preference)


def _off(module: str, name: str, value: Callable[..., Any] = _nothing) -> tuple[Patch, ...]:
    return (Patch(module=module, name=name, value=value),)


_RESOURCES: Final = {
    "paper-200": 10.0, "paper-500": 15.0, "weights-1000": 15.0, "paper-1000": 12.0,
}  # fmt: skip
_FLEET: Final = {"fleet-4x2000": 12.0, "fleet-2x500": 10.0}
_STATIONS: Final = {"fleet-stations-4x2000": 60.0}
_LARGE_FLEET: Final = {"fleet-24x10000": 60.0}
_SMALL: Final = {"tight-150": 10.0, "tight-weights-300": 10.0, "physical-200": 10.0}

STRATEGIES: Final[Mapping[str, Change]] = {
    "cuts after a fleet": Change(patches=_off(f"{DRIVERS}.fleet", "close_in"), families=_FLEET),
    "exhaust": Change(
        patches=_off(f"{DRIVERS}.resource_steps", "ResourceSearch.exhaust"),
        families=_RESOURCES | _SMALL,
    ),
    "urgency": Change(
        patches=_off(f"{DRIVERS}.fleet", "WindowSearch", _without_urgency),
        families=_LARGE_FLEET,
        num_draws=1,
    ),
    "preference": Change(tuning={"preference": 0.0}, families=_LARGE_FLEET, num_draws=1),
    "turns of windows and choices": Change(
        patches=_off(f"{DRIVERS}.resource_steps", "ResourceSearch.search"), families=_RESOURCES
    ),
    "relaxations of a fleet's contacts": Change(tuning={"most_relaxed": 0}, families=_STATIONS),
    "program search": Change(
        patches=_off(f"{DRIVERS}.resource_fleet", "ProgramSearch", _Idle), families=_STATIONS
    ),
}
"""What is left out, or, where the name says so, done in another way."""
