"""Proven bounds as documents: written down with a plan, read back, and checked anew."""

from __future__ import annotations

import json
from typing import Any, cast

import numpy as np

from planner_core.bounds import Bound, Proof, lagrangian_value
from planner_core.problem import Problem
from planner_core.resource_bound import resource_value

VERSION = 1


def to_json(bound: Bound) -> str:
    """Return a bound and what proves it as JSON text, exact to the last bit."""
    document: dict[str, Any] = {"version": VERSION, "proof": bound.proof, "value": bound.value}
    if bound.prices is not None:
        document["prices"] = bound.prices.tolist()
    if bound.unit is not None:
        document["unit"] = bound.unit
    return json.dumps(document)


def from_json(text: str) -> Bound:
    """Return the bound of ``to_json``."""
    document = json.loads(text)
    prices = document.get("prices")
    return Bound(
        value=float(document["value"]),
        proof=cast(Proof, document["proof"]),
        prices=None if prices is None else np.array(prices, dtype=np.float64),
        unit=document.get("unit"),
    )


def recomputed(problem: Problem, bound: Bound) -> float | None:
    """Return the bound that the stored prices prove, or None where no prices are the proof.

    Nothing of the search that found the prices is used: they are put into the dual function
    of ``problem``, whose value is a bound whatever the prices are.
    """
    if bound.prices is None:
        return None
    if bound.unit is not None:
        return resource_value(problem, bound.prices, bound.unit)
    value, _ = lagrangian_value(problem, bound.prices)
    return value
