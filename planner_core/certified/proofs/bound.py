"""A proven bound: its value, and the proof by which it can be checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner_core.certified.proofs.certificate import Certificate
from planner_core.certified.proofs.whole_program import RowMultipliers
from planner_core.certified.tolerances import LEAST_BOUND, SAME
from planner_core.problem import Floats, Problem

Proof = Literal["lagrangian", "dp", "linear", "milp", "totals"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bound:
    """A proven upper bound on what a valid plan can earn.

    Attributes
    ----------
    multipliers
        One for each target, if they prove the bound: Lagrangian ones (checked by
        ``lagrangian_value``) or those of dynamic programmes (``resource_bound.resource_value``);
        None for other proofs. Shape ``(num_targets,)``.
    is_elementary
        Whether ``elementary_value`` checks the multipliers.
    contact_multipliers
        One for each contact: with ``multipliers`` they prove a bound with a half-life, or with all
        0 one without, by batteries alone (``latency.latency_value``). Shape ``(num_contacts,)``.
    antenna_multipliers
        With ``multipliers`` they prove a bound by dynamic programmes if satellites want the same
        antennas (``planner_core.precedence.antennas``). Shape ``(num_groups,)``.
    queue_levels
        Levels of energy in a collect, if exact programmes of queues prove a bound with a half-life
        (``queues.queue_value``).
    exact_contacts
        Rows of the contacts whose energy these programmes do not round.
    unit
        Unit in which the dynamic programmes count worth.
    cell_s
        Width of the cells of start times, if multipliers prove a bound with continuous starts.
    row_multipliers
        Multipliers of all rows of the whole program, if they prove the bound
        (``whole_program.whole_program_value``).
    certificate
        Proof of a Lagrangian bound that needs cuts (``is_refuted`` checks it).
    log
        Report of the MILP solver, for a bound that it has proven.
    on_board
        Part of the value for images that were on board at the start
        (``planner_core.problem.on_board``); the proof covers the rest.
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
    cell_s: float | None = None
    row_multipliers: RowMultipliers | None = None
    certificate: Certificate | None = None
    log: str | None = None
    on_board: float = 0.0

    def with_on_board(self, most: float) -> Bound:
        """Return the bound on new images and those on board, which earn at most ``most``."""
        return replace(self, value=self.value + most, on_board=most)

    def without_on_board(self) -> Bound:
        """Return the bound on new images alone."""
        if self.on_board == 0.0:
            return self
        return replace(self, value=self.value - self.on_board, on_board=0.0)


def reward_unit(problem: Problem) -> float:
    """Return an amount of which every plan's reward is a multiple; 0 if there is none."""
    return problem.reward_unit


def rounded_bound(problem: Problem, value: float, reward: float) -> float:
    """Return a bound raised for safety, then rounded down to a multiple of the reward unit.

    Never below ``reward``, which a known plan earns.
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
        An upper bound on every plan's reward.
    unit
        An amount of which every plan's reward is a multiple; 0 if there is none.
    """
    return bound < reward + max(unit, SAME * reward, LEAST_BOUND)


def accessible(problem: Problem) -> Bound:
    """Return the sum of all targets' best worths as a bound: these are its multipliers."""
    multipliers = problem.best_worth
    value = rounded_bound(problem, float(multipliers.sum()), 0.0)
    return Bound(value=value, proof="lagrangian", multipliers=multipliers)
