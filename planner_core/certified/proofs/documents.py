"""Proven bounds as documents: stored with a plan, read back, and checked again."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any, Final, cast

import numpy as np

from planner_core.certified.dp.elementary import elementary_value
from planner_core.certified.proofs.bound import (
    Bound,
    Proof,
    reward_unit,
    rounded_bound,
)
from planner_core.certified.proofs.certificate import (
    Certificate,
    Cut,
    Multipliers,
    Refutation,
    is_refuted,
)
from planner_core.certified.proofs.continuous import continuous_value
from planner_core.certified.proofs.lagrangian import lagrangian_value
from planner_core.certified.proofs.latency import latency_value
from planner_core.certified.proofs.queues import queue_value
from planner_core.certified.proofs.resource_bound import resource_value
from planner_core.certified.proofs.totals import totals_bound
from planner_core.certified.proofs.whole_program import RowMultipliers, relaxed_value
from planner_core.certified.tolerances import WRITTEN
from planner_core.problem import Floats, Problem
from planner_core.problem.on_board import most_on_board

VERSION: Final = 1


def to_json(bound: Bound) -> str:
    """Return a bound and what proves it as JSON text, exact to the last bit."""
    document: dict[str, Any] = {"version": VERSION, "proof": bound.proof, "value": bound.value}
    if bound.multipliers is not None:
        document["prices"] = bound.multipliers.tolist()
    if bound.contact_multipliers is not None:
        document["contact_prices"] = bound.contact_multipliers.tolist()
    if bound.antenna_multipliers is not None:
        document["antenna_prices"] = bound.antenna_multipliers.tolist()
    if bound.queue_levels is not None:
        document["queue_levels"] = bound.queue_levels
        document["exact_contacts"] = list(bound.exact_contacts)
    if bound.is_elementary:
        document["elementary"] = True
    if bound.unit is not None:
        document["unit"] = bound.unit
    if bound.cell_s is not None:
        document["cell_s"] = bound.cell_s
    if bound.row_multipliers is not None:
        document["row_prices"] = _row_multipliers_to_json(bound.row_multipliers)
    if bound.certificate is not None:
        document["amount"] = bound.certificate.amount
        document["refutation"] = _refutation_to_json(bound.certificate.refutation)
    if bound.log is not None:
        document["log"] = bound.log
    if bound.on_board > 0.0:
        document["on_board"] = bound.on_board
    return json.dumps(document)


def from_json(text: str) -> Bound:
    """Return the bound of ``to_json``."""
    document = json.loads(text)

    def multipliers(key: str) -> Floats | None:
        values = document.get(key)
        return None if values is None else np.array(values, dtype=np.float64)

    return Bound(
        value=float(document["value"]),
        proof=cast(Proof, document["proof"]),
        multipliers=multipliers("prices"),
        contact_multipliers=multipliers("contact_prices"),
        antenna_multipliers=multipliers("antenna_prices"),
        queue_levels=document.get("queue_levels"),
        exact_contacts=tuple(document.get("exact_contacts", ())),
        is_elementary=bool(document.get("elementary", False)),
        unit=document.get("unit"),
        cell_s=document.get("cell_s"),
        row_multipliers=_row_multipliers_from_json(document["row_prices"])
        if "row_prices" in document
        else None,
        certificate=Certificate(
            amount=float(document["amount"]),
            refutation=_refutation_from_json(document["refutation"]),
        )
        if "refutation" in document
        else None,
        log=document.get("log"),
        on_board=float(document.get("on_board", 0.0)),
    )


def is_proven(problem: Problem, bound: Bound) -> bool | None:
    """Return whether the stored proof proves the bound; None if it is only a log of HiGHS.

    Nothing of the search that found it is used: multipliers are put into the dual function of
    ``problem``, whose value is a bound whatever they are.
    """
    room = WRITTEN * max(1.0, abs(bound.value))
    if bound.on_board < most_on_board(problem) - room:
        return False
    bound = bound.without_on_board()
    # What agility alone allows may be a multiple of a larger unit than what plans earn.
    alone = replace(problem, use_resources=False)
    if bound.certificate is not None:
        is_enough = bound.certificate.amount <= bound.value + (reward_unit(alone) or room)
        # It removes tasks at the opportunities' starts only; other starts remain possible.
        is_meant = not problem.continuous_starts
        return is_meant and is_enough and is_refuted(problem, bound.certificate)
    value = _value(problem, bound)
    if value is None:
        return None
    meant = alone if bound.proof == "lagrangian" else problem
    return rounded_bound(meant, value, 0.0) <= bound.value + room


def _value(problem: Problem, bound: Bound) -> float | None:
    """Return what multipliers or totals prove, infinite if nothing; None if there are none."""
    if bound.proof == "totals":
        totals = totals_bound(problem)
        return np.inf if totals is None else totals.value
    if bound.row_multipliers is not None:
        return relaxed_value(problem, bound.row_multipliers)
    if bound.multipliers is None:
        return None
    if problem.continuous_starts:
        return continuous_value(problem, bound.multipliers, bound.cell_s)
    if bound.queue_levels is not None:
        value, _ = queue_value(
            problem,
            bound.multipliers,
            bound.queue_levels,
            contact_multipliers=bound.contact_multipliers,
            exact_contacts=bound.exact_contacts,
            level=bound.value,
        )
    elif bound.contact_multipliers is not None:
        value = latency_value(
            problem, bound.multipliers, bound.contact_multipliers, bound.antenna_multipliers
        )
    elif bound.unit is not None:
        value = resource_value(
            problem, bound.multipliers, bound.unit, bound.antenna_multipliers, level=bound.value
        )
    elif bound.is_elementary:
        value, _ = elementary_value(problem, bound.multipliers)
    else:
        value, _ = lagrangian_value(problem, bound.multipliers)
    return value


def _row_multipliers_to_json(multipliers: RowMultipliers) -> dict[str, Any]:
    return {
        "rows": multipliers.rows.tolist(),
        "prices": multipliers.of_rows.tolist(),
        "cliques": [clique.tolist() for clique in multipliers.cliques],
        "clique_prices": list(multipliers.of_cliques),
        "of_slots": multipliers.is_of_slots,
    }


def _row_multipliers_from_json(document: dict[str, Any]) -> RowMultipliers:
    return RowMultipliers(
        rows=np.array(document["rows"], dtype=np.int32),
        of_rows=np.array(document["prices"], dtype=np.float64),
        cliques=tuple(np.array(clique, dtype=np.int32) for clique in document["cliques"]),
        of_cliques=tuple(document["clique_prices"]),
        is_of_slots=bool(document.get("of_slots", False)),
    )


def _refutation_to_json(refutation: Refutation) -> dict[str, Any]:
    document: dict[str, Any] = {
        "steps": [
            {
                "prices": step.of_targets.tolist(),
                "cuts": [[group.tolist() for group in cut.sets] for cut in step.cuts],
                "cut_prices": list(step.of_cuts),
            }
            for step in refutation.steps
        ]
    }
    if refutation.branch is not None:
        row, taken, left = refutation.branch
        document["branch"] = [row, _refutation_to_json(taken), _refutation_to_json(left)]
    return document


def _refutation_from_json(document: dict[str, Any]) -> Refutation:
    branch = None
    if "branch" in document:
        row, taken, left = document["branch"]
        branch = (int(row), _refutation_from_json(taken), _refutation_from_json(left))
    return Refutation(
        steps=tuple(
            Multipliers(
                of_targets=np.array(step["prices"], dtype=np.float64),
                cuts=tuple(
                    Cut(sets=tuple(np.array(group, dtype=np.int32) for group in cut))
                    for cut in step["cuts"]
                ),
                of_cuts=tuple(step["cut_prices"]),
            )
            for step in document["steps"]
        ),
        branch=branch,
    )
