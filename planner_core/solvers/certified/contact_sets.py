"""The best plan with given contacts, by mixed-integer programming over promising tasks.

With its contacts fixed the linear relaxation is nearly tight; with contacts free it is not. Its
prices are nearly the best for all plans, and the tasks that it takes at no or little loss hold
good plans.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import highspy
import numpy as np

from planner_core.plan import Plan
from planner_core.problem import COLLECT, CONTACT, Bools, Floats, Problem
from planner_core.solvers.base import Budget
from planner_core.solvers.programs.antichains import violated_antichains
from planner_core.solvers.programs.highs import CHAIN_TOLERANCE, Engine
from planner_core.solvers.programs.model import plan_program
from planner_core.solvers.programs.program import Rows

_CLEAR: Final = 1e-7  # from the limits, so that the referee accepts the plan
_CENTRAL_ROUNDS: Final = 2
_CORNER_ROUNDS: Final = 5
_EFFORT: Final = 0.2
_MAX_NODES: Final = 200
_INTERIOR: Final[Mapping[str, str | float]] = {
    "solver": "ipm",
    "run_crossover": "off",
    "primal_feasibility_tolerance": 1e-7,
}
_CORNER: Final[Mapping[str, str | float]] = {
    "solver": "choose",
    "run_crossover": "on",
    "primal_feasibility_tolerance": CHAIN_TOLERANCE,
}


class _Point(NamedTuple):
    """An optimum of a relaxation, and what its rows and columns are worth."""

    value: float
    columns: Floats
    row_prices: Floats
    losses: Floats


class _Engine(Engine):
    def require(self, amount: float) -> None:
        """Look only for points worth this much, until there is one."""
        for option in ("objective_bound", "objective_target"):
            self._highs.setOptionValue(option, amount - 1e-6 * max(1.0, amount))

    def central(self) -> _Point | None:
        """Return a point amid all optima, with prices that are amid all that prove them.

        Such prices hold for other contacts as well, better than those of a corner. HiGHS has
        the sign of them right where it minimizes.
        """
        highs = self._highs
        self._optimize(-1.0, highspy.ObjSense.kMinimize, _INTERIOR)
        if not self._run():
            return None
        point = None
        if highs.getModelStatus() == highspy.HighsModelStatus.kOptimal:
            point = self._point(-float(highs.getInfo().objective_function_value))
        self._optimize(-1.0, highspy.ObjSense.kMaximize, _CORNER)
        return point or self.corner()

    def corner(self) -> _Point | None:
        """Return a corner of the relaxation."""
        if self.relaxed() is None:
            return None
        return self._point(float(self._highs.getInfo().objective_function_value))

    def _optimize(
        self, sign: float, sense: highspy.ObjSense, options: Mapping[str, str | float]
    ) -> None:
        worth = sign * np.array(self._highs.getLp().col_cost_)
        self._highs.changeColsCost(len(worth), np.arange(len(worth), dtype=np.int32), worth)
        self._highs.changeObjectiveSense(sense)
        for option, value in options.items():
            self._highs.setOptionValue(option, value)

    def _point(self, value: float) -> _Point:
        solution = self._highs.getSolution()
        return _Point(
            value=value,
            columns=np.array(solution.col_value),
            row_prices=np.abs(np.array(solution.row_dual)),
            losses=np.abs(np.array(solution.col_dual)),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Relaxation:
    """What the relaxation of a program with fixed contacts tells.

    Attributes
    ----------
    value
        With antichain cuts; minus infinity where there is no point.
    prices
        What it says that each target is worth by itself. Shape ``(num_targets,)``.
    losses
        What taking an opportunity would cost; infinite where it may not. Shape ``(n,)``.
    """

    value: float
    prices: Floats
    losses: Floats


class FixedContacts:
    """The program of one set of contacts over some of the tasks; its bound is not a proof."""

    def __init__(
        self, problem: Problem, offered: Bools, contacts: tuple[int, ...], budget: Budget, seed: int
    ) -> None:
        self._problem = problem
        must = problem.kept_rows.tolist()
        contacts = tuple(
            {*contacts, *(row for row in must if problem.opportunities.kind[row] == CONTACT)}
        )
        kept = offered & (problem.opportunities.kind == COLLECT)
        kept[[*contacts, *must]] = True
        self._rows = np.flatnonzero(kept).astype(np.int32)
        self._model = plan_program(problem, "antichain", _CLEAR, self._rows)
        self._fix(np.isin(self._rows, contacts))
        self._engine = _Engine(self._model.program, budget, seed, is_chained=True)

    def relaxation(self) -> Relaxation:
        """Return what the relaxation tells, with prices amid all that prove it."""
        reward = self._problem.target_reward
        prices, losses = np.zeros(len(reward)), np.full(len(self._problem.opportunities), np.inf)
        point = self._cut(_CENTRAL_ROUNDS, self._engine.central)
        if point is not None:
            # The rows of the targets come first in the program.
            worth = point.row_prices[: len(reward)]
            prices = np.clip(worth if self._is_plain else reward - worth, 0.0, reward)
            losses[self._rows] = point.losses[: len(self._rows)]
        value = -np.inf if point is None else point.value
        return Relaxation(value=value, prices=prices, losses=losses)

    def relaxed(self) -> float:
        """Return what the relaxation is worth: a corner, from which the search sets out."""
        point = self._cut(_CORNER_ROUNDS, self._engine.corner)
        return -np.inf if point is None else point.value

    @property
    def _is_plain(self) -> bool:
        """Whether tasks earn what their targets are worth, in a row for each target."""
        return bool(np.any(self._model.program.worth[0] > 0.0))

    def _fix(self, is_fixed: Bools) -> None:
        """Fix the contacts, and let rows alone limit the collects, so that they get all prices."""
        program, m = self._model.program, len(is_fixed)
        lower, upper = np.concatenate(program.lower), np.concatenate(program.upper)
        if self._is_plain:
            upper[:m][upper[:m] > 0.0] = np.inf
        lower[:m][is_fixed] = upper[:m][is_fixed] = 1.0
        program.lower, program.upper = [lower], [upper]

    def _cut(self, rounds: int, solve: Callable[[], _Point | None]) -> _Point | None:
        """Return the optimum of the relaxation with antichain cuts, if there is one."""
        for left in range(rounds, -1, -1):
            point = solve()
            if point is None or left == 0 or not self._add_cuts(point.columns):
                break
        return point

    def _add_cuts(self, taken: Floats) -> bool:
        is_cut = False
        satellites = zip(self._model.problem.satellites, self._model.orders, strict=True)
        for satellite, order in satellites:
            if len(satellite) == 0:
                continue
            own = self._model.taken[satellite.rows]
            offsets, members = violated_antichains(order, taken[own])
            self._engine.add_rows(Rows.of(offsets, own[members], upper=1.0))
            is_cut = is_cut or len(offsets) > 1
        return is_cut

    def plan(self, at_least: float) -> Plan | None:
        """Return a plan worth ``at_least`` if one turns up soon, or else any, or None."""
        self._engine.require(at_least)
        outcome = self._engine.search(None, 0.0, _EFFORT, _unwatched, _MAX_NODES)
        if outcome.columns is None:
            return None
        return Plan.of(self._problem, self._rows[outcome.columns[: len(self._rows)] > 0.5])


def _unwatched(_reward: float, _bound: float) -> None:
    pass
