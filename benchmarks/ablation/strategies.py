"""The strategies of ``certified`` and how each is switched off, by name.

Most are removed from the engine's own list, by their name there. Bounds stay valid in all variants.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, Final

from planner_core.budget import Budget
from planner_core.certified.driver import ActiveStrategy
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.strategies import every
from planner_core.certified.tuning import TUNING, tune
from planner_core.problem import Problem
from planner_core.problem.plan import Plan

ENGINE: Final = "planner_core.certified"
NOTHING: Final = ""
"""The unchanged solver."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A name in a module, with dots for members of a class, and its replacement."""

    module: str
    name: str
    value: Any

    @property
    def place(self) -> tuple[Any, str]:
        """The module or class, and the name in it.

        Raises
        ------
        AttributeError
            If there is no such name: a patch without effect would measure nothing.
        """
        *owners, last = self.name.split(".")
        owner = reduce(getattr, owners, importlib.import_module(self.module))
        if not hasattr(owner, last):
            raise AttributeError(f"{self.module} has no {self.name}")
        return owner, last

    def apply(self) -> None:
        """Replace the name's value for the rest of this process."""
        owner, last = self.place
        setattr(owner, last, self.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A change, and the families of the suite on which it may have an effect.

    Attributes
    ----------
    families
        Names of families and the CPU seconds of a run.
    patches, tuning
        Names in modules with their replacements, and other values of the tuning.
    num_draws
        How many missions of each family are planned, each with its own seed.
    """

    families: Mapping[str, float]
    patches: tuple[Patch, ...] = ()
    tuning: Mapping[str, Any] = field(default_factory=dict)
    num_draws: int = 2

    def apply(self) -> None:
        """Apply all of it for the rest of this process."""
        for patch in self.patches:
            patch.apply()
        tune(**self.tuning)


class _Idle:
    """Take the turns of another search without doing anything."""

    steps_beside = 6

    def __init__(self, *_: object) -> None:
        pass

    def step(self) -> None:
        """Do nothing."""


def _all_in_turn(turns: Sequence[ActiveStrategy]) -> ActiveStrategy:
    """Return the strategy that has waited longest, whatever the gains."""
    going = [turn for turn in turns if not turn.is_stalled] or turns
    return max(going, key=lambda turn: turn.num_waits)


def _without_noise(search: ResourceWindows, num_moves: float, budget: Budget) -> None:
    """Make the same number of moves, without noise."""
    search.make_moves_on_each(TUNING.rounds * num_moves, budget)


def _unchanged(_best: Incumbent, plan: Plan, _seed: int) -> Plan:
    """Leave a plan as it is."""
    return plan


def _never(_problem: Problem) -> bool:
    """Say no."""
    return False


def _off(module: str, name: str, value: Callable[..., Any]) -> tuple[Patch, ...]:
    return (Patch(module=f"{ENGINE}.{module}", name=name, value=value),)


def _without(name: str) -> tuple[Patch, ...]:
    """Remove a strategy from the list.

    Raises
    ------
    ValueError
        If there is none of this name.
    """
    left = tuple(one for one in every.STRATEGIES if one.name != name)
    if len(left) == len(every.STRATEGIES):
        raise ValueError(f"no strategy is called {name}")
    return (Patch(module=f"{ENGINE}.strategies.every", name="STRATEGIES", value=left),)


_AGILITY: Final = {"agility-500": 10.0, "agility-1000": 12.0, "weights-agility-1000": 12.0}
_SPACED: Final = {"spaced-1000": 12.0}
_FREE: Final = {"continuous-1000": 12.0}
_RESOURCES: Final = {
    "paper-200": 10.0, "paper-500": 15.0, "weights-1000": 15.0, "paper-1000": 12.0,
}  # fmt: skip
_CLOUDS: Final = {"clouds-1000": 12.0}
_DELIVERED: Final = {"delivered-paper-500": 12.0}
_AGE_ON_BOARD: Final = {
    "half-life-12h-share-1000": 10.0, "half-life-12h-share-paper-1000": 10.0,
    "half-life-3h-share-paper-300": 8.0,
}  # fmt: skip
_FEW_OF_AGE: Final = {"half-life-3h-100": 8.0}
_OF_AGE: Final = {**_FEW_OF_AGE, "half-life-12h-1000": 12.0}
_FEW_OF_AGE_SHARED: Final = {"half-life-3h-fleet-4x80": 10.0}
_SOON_OLD_SHARED: Final = {"half-life-1h-fleet-4x1000": 10.0}
_OF_AGE_SHARED: Final = {"half-life-6h-network-4x400": 20.0}
_OWN_CONTACTS: Final = {"weights-1000": 20.0, "clouds-1000": 15.0, "share-paper-500": 15.0}
_SHARED: Final = {"share-fleet-paper-4x500": 12.0, "quality-sun-network-4x300": 15.0}
_FLEET: Final = {"fleet-4x2000": 12.0, "fleet-2x500": 10.0}
_STATIONS: Final = {"fleet-stations-4x2000": 60.0}
_UNEVEN: Final = {
    "quality-sun-network-8x1000": 20.0, "weights-fleet-4x2000": 20.0,
    "weights-share-sun-fleet-4x500": 15.0,
}  # fmt: skip
_DIFFERING: Final = {"spaced-weights-1000": 20.0}
_TRAIN: Final = {"share-sun-train-4x500": 20.0}
_LARGE_FLEET: Final = {"fleet-24x10000": 60.0}
_SMALL: Final = {"tight-150": 10.0, "tight-weights-300": 10.0, "physical-200": 10.0}

STRATEGIES: Final[Mapping[str, Change]] = {
    "the order by gains": Change(
        patches=_off("driver", "_chosen", _all_in_turn),
        families=_SPACED | _FREE | _CLOUDS | {"paper-1000": 12.0},
    ),
    **{
        name: Change(patches=_without(name), families=families)
        for name, families in {
            "windows": _AGILITY,
            "cutting planes": _AGILITY | _SPACED,
            "multipliers of passes": _SPACED,
            "windows beside multipliers of passes": _SPACED,
            "streams of windows": _FLEET,
            "multipliers of a fleet's passes": {"spaced-fleet-2x500": 10.0},
            "a fleet's cutting planes": _FLEET,
            "choices": _RESOURCES | _DELIVERED,
            "windows and choices": _RESOURCES,
            "choices from the best plan": _RESOURCES | _CLOUDS,
            "whole relaxation": _CLOUDS | {"share-sun-250": 15.0},
            "whole relaxation with ages": {"half-life-3h-share-paper-300": 10.0},
            "relaxation over slots": {"continuous-sun-500": 10.0, **_DIFFERING},
            "sampled starts": {"continuous-sun-500": 10.0, "continuous-sun-fleet-3x500": 15.0},
            "a fleet's contacts exchanged": _TRAIN,
            "multipliers": _RESOURCES,
            "programs with contacts fixed": _RESOURCES,
            "programs with the plan's contacts": _OWN_CONTACTS,
            "a fleet's programs with the plan's contacts": _SHARED,
            "plans without the half-life": _AGE_ON_BOARD,
            "images by the contact that brings them down": _FEW_OF_AGE_SHARED,
            "windows by small programs": _FEW_OF_AGE,
            "forward search": _SOON_OLD_SHARED,
            "a fleet's plans without the half-life": _OF_AGE_SHARED,
            "days planned anew": _OF_AGE_SHARED | {"half-life-12h-fleet-4x2000": 40.0},
            "multipliers of contacts": _OF_AGE,
            "queues": _OF_AGE,
            "plans by their contacts": _OF_AGE,
            "windows with continuous starts": _FREE,
            # Their first tables alone take six seconds.
            "multipliers of chains": {"continuous-1000": 30.0},
            "exhaust": _RESOURCES | _SMALL,
        }.items()
    },
    "windows of forward search's plan": Change(
        patches=_off("strategies.half_life", "bettered_with_its_contacts", _unchanged),
        families=_SOON_OLD_SHARED,
    ),
    "a fleet's whole relaxation": Change(
        patches=_off("strategies.relaxed", "charges_for_data_left", _never), families=_TRAIN
    ),
    "preference": Change(tuning={"preference": 0.0}, families=_LARGE_FLEET, num_draws=1),
    "relaxations of a fleet's contacts": Change(
        tuning={"most_relaxed": 0}, families=_STATIONS | {"share-fleet-4x2000": 40.0}
    ),
    "noise in a fleet's windows": Change(
        patches=_off("lns.resource_search", "ResourceWindows.anneal", _without_noise),
        families=_UNEVEN,
    ),
    "program search": Change(
        patches=_off("strategies.resource_fleet", "ProgramSearch", _Idle),
        families=_STATIONS | {"weights-fleet-4x2000": 20.0},
    ),
}
"""What is removed or, if the name says so, done in another way."""
