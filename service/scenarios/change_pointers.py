"""Faults of a changed scenario, located in the change that caused them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

from planner_core.errors import Fault, PlannerError
from planner_core.pins import PinnedAction, Pins
from planner_core.reasons.what_if import is_any_image
from service.wire.changes import ChangeIn
from service.wire.pins import PinnedActionIn

_PIN = re.compile(r"/pins/(keep|skip)/(\d+)")


Places = Mapping[str, Sequence[str | None]]
"""Where each pin of the changed scenario comes from; None for a pin of the old scenario."""


def places_of(
    pins: Pins, forbid: Sequence[PinnedAction], force: Sequence[PinnedAction], num_dropped: int
) -> Places:
    """Return the places of ``reasons.what_if``'s pins: new ones follow the old ones."""
    skipped = [f"/forbid/{i}" for i, one in enumerate(forbid) if not is_any_image(one)]
    dropped = [f"/relax/drop_actions/{i}" for i in range(num_dropped)]
    return {
        "keep": (*[None] * len(pins.keep), *(f"/force/{i}" for i in range(len(force)))),
        "skip": (*[None] * len(pins.skip), *skipped, *dropped),
    }


def places_of_body(force: Sequence[PinnedAction], forbid: Sequence[PinnedAction]) -> Places:
    """Return the places of all pins in the body itself."""
    return {
        "keep": [f"/force/{i}" for i in range(len(force))],
        "skip": [f"/forbid/{i}" for i in range(len(forbid))],
    }


@contextmanager
def pointing_into(change: ChangeIn, places: Places) -> Iterator[None]:
    """Make faults of pins point into the change."""

    def place(pin: re.Match[str]) -> str | None:
        return places[pin[1]][int(pin[2])]

    try:
        yield
    except PlannerError as error:
        fault = error.fault
        pin = _PIN.match(fault.pointer or "")
        detail = _PIN.sub(lambda found: place(found) or found[0], fault.detail)
        pointer = fault.pointer
        if pin is not None:
            pointer = place(pin)
            if pointer is None:
                detail = f"{pin[0]} of the job's scenario: {detail}"
            elif _is_object(change, pointer):
                pointer += (fault.pointer or "")[pin.end() :]
        error.fault = replace(fault, pointer=pointer, detail=detail)
        raise


def place_in_relax(fault: Fault) -> str:
    """Return where in ``relax`` a fault of a relaxed file comes from."""
    of_horizon = (fault.pointer or "").startswith("/horizon")
    return "/relax/horizon_end" if of_horizon else "/relax"


def _is_object(change: ChangeIn, pointer: str) -> bool:
    """Return whether the action there is an object, rather than only an id."""
    _, name, number = pointer.split("/")[:3]
    actions = {"force": change.force, "forbid": change.forbid}.get(name)
    return actions is not None and isinstance(actions[int(number)], PinnedActionIn)
