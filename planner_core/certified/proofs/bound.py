"""A proven bound: its value, and what there is to check it with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner_core.certified.proofs.certificate import Certificate
from planner_core.certified.tolerances import LEAST_BOUND, SAME
from planner_core.problem import Floats, Problem

Proof = Literal["lagrangian", "milp", "dp", "totals"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bound:
    """A proven upper bound on what a valid plan can earn.

    Attributes
    ----------
    multipliers
        What proves a Lagrangian bound (``lagrangian_value`` checks them) or one by dynamic
        programmes (``resource_bound.resource_value``), one per target; None for other proofs.
        Shape ``(num_targets,)``.
    is_elementary
        Whether it is ``elementary_value`` that checks the multipliers.
    contact_multipliers
        What proves a bound with a half-life, with ``multipliers`` (``latency.latency_value``), one
        for each contact; all 0 where batteries alone prove one without. Shape ``(num_contacts,)``.
    antenna_multipliers
        What proves a bound by dynamic programmes, with ``multipliers``, where satellites want the
        same antennas (``planner_core.precedence.antennas``). Shape ``(num_groups,)``.
    queue_levels
        Of energy in a collect, where exact programmes of queues prove a bound with a half-life
        (``queues.queue_value``).
    exact_contacts
        Rows of the contacts whose energy those do not round.
    unit
        In what the dynamic programmes count worth.
    certificate
        What proves a Lagrangian bound that took cuts (``is_refuted`` checks it).
    log
        What the MILP solver reported, for a bound that it has proven.
    on_board
        What of the value is for images that were on board at the start
        (``planner_core.problem.on_board``); the proof is of the rest.
    """

    value: float
    proof: Proof
    multipliers: Floats | None = None
    contact_multipliers: Floats | None = None
    antenna_multipliers: Floats | None = None
    queue_levels: int | None = None
    exact_contacts: tuple[int, ...] = ()
    is_elementary: bool = False
    unit: float | None = None
    certificate: Certificate | None = None
    log: str | None = None
    on_board: float = 0.0

    def with_on_board(self, most: float) -> Bound:
        """Return the bound of new images and of those on board, which earn ``most`` at most."""
        return replace(self, value=self.value + most, on_board=most)

    def without_on_board(self) -> Bound:
        """Return the bound of new images alone."""
        if self.on_board == 0.0:
            return self
        return replace(self, value=self.value - self.on_board, on_board=0.0)


def reward_unit(problem: Problem) -> float:
    """Return an amount of which what any plan earns is a multiple; 0 where there is none."""
    return problem.reward_unit


def rounded_bound(problem: Problem, value: float, reward: float) -> float:
    """Return a bound rounded up for safety, then down to what whole rewards can add up to.

    Never below ``reward``, which some plan has earned.
    """
    safe = value * (1.0 + 1e-12) + 1e-9
    unit = reward_unit(problem)
    if unit > 0.0:
        safe = float(np.floor((safe + SAME) / unit) * unit)
    return max(safe, reward)


def is_optimal(reward: float, bound: float, unit: float) -> bool:
    """Return whether no plan earns more than ``reward``, to the stated tolerance.

    Parameters
    ----------
    bound
        What no plan exceeds.
    unit
        An amount of which what any plan earns is a multiple; 0 where there is none.
    """
    return bound < reward + max(unit, SAME * reward, LEAST_BOUND)


def accessible(problem: Problem) -> Bound:
    """Return the bound that every accessible target is imaged: multipliers of its best worth."""
    multipliers = problem.best_worth
    value = rounded_bound(problem, float(multipliers.sum()), 0.0)
    return Bound(value=value, proof="lagrangian", multipliers=multipliers)
