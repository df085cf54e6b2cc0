"""The best plan with given contacts, by mixed-integer programming over promising tasks.

With contacts fixed, the linear relaxation is nearly tight; with contacts free it is not. Its dual
values are nearly the best multipliers for all plans, and the tasks of little or no reduced cost
contain good plans.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import highspy
import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine
from planner_core.certified.program.clique_cuts import violated_cliques
from planner_core.certified.program.linear_program import Rows
from planner_core.certified.program.model import plan_program
from planner_core.certified.tolerances import CHAINED, INSIDE
from planner_core.certified.tuning import TUNING
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    Problem,
)
from planner_core.problem.plan import Plan

_INTERIOR: Final[Mapping[str, str | float]] = {
    "solver": "ipm",
    "run_crossover": "off",
    "primal_feasibility_tolerance": 1e-7,
}
_CORNER: Final[Mapping[str, str | float]] = {
    "solver": "choose",
    "run_crossover": "on",
    "primal_feasibility_tolerance": CHAINED,
}


class _Point(NamedTuple):
    """An optimum of a relaxation, with its row duals and reduced costs.

    Attributes
    ----------
    gains
        What each column would gain per unit more; less than 0 if that would lose.
    """

    value: float
    columns: Floats
    row_duals: Floats
    gains: Floats


class _Engine(Engine):
    def require(self, amount: float) -> None:
        """Look only for points worth at least ``amount``, and stop at the first."""
        for option in ("objective_bound", "objective_target"):
            self._highs.setOptionValue(option, amount - 1e-6 * max(1.0, amount))

    def weigh(self, worth: Floats) -> None:
        """Change the worths of the columns."""
        self._highs.changeColsCost(len(worth), np.arange(len(worth), dtype=np.int32), worth)

    def look_no_further(self) -> None:
        """Complete a fractional start, its whole values fixed, within a single node."""
        self._highs.setOptionValue("mip_max_start_nodes", 1)

    def central(self) -> _Point | None:
        """Return a point amid all optima, with dual values amid all that prove them.

        Such dual values suit other contacts better than those of a corner do. HiGHS gets their sign
        right when it minimizes.
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
        self.weigh(sign * np.array(self._highs.getLp().col_cost_))
        self._highs.changeObjectiveSense(sense)
        for option, value in options.items():
            self._highs.setOptionValue(option, value)

    def _point(self, value: float) -> _Point:
        solution = self._highs.getSolution()
        return _Point(
            value=value,
            columns=np.array(solution.col_value),
            row_duals=self.row_duals,
            gains=np.array(solution.col_dual),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Relaxation:
    """Results of the relaxation of a program with fixed contacts.

    Attributes
    ----------
    value
        With clique cuts; minus infinity if there is no point.
    multipliers
        Of targets, from its row duals. Shape ``(num_targets,)``.
    losses
        Reduced costs of opportunities; infinite if not in the program. Shape ``(n,)``.
    """

    value: float
    multipliers: Floats
    losses: Floats


class FixedContacts:
    """The program of one set of contacts over some of the tasks; its bound is not a proof.

    Parameters
    ----------
    offered
        Collects that may be taken. Shape ``(n,)``.
    fixed
        Tasks that must be taken: all contacts of the plan, and collects if any.
    others
        Further contacts that ``fix`` may name.
    """

    def __init__(
        self,
        problem: Problem,
        offered: Bools,
        fixed: tuple[int, ...],
        budget: Budget,
        seed: int,
        others: tuple[int, ...] = (),
    ) -> None:
        self._problem = problem
        kept = offered & (problem.opportunities.kind == COLLECT)
        kept[[*fixed, *others, *problem.kept_rows.tolist()]] = True
        self._rows = np.flatnonzero(kept).astype(np.int32)
        self._model = plan_program(problem, "antichain", INSIDE, self._rows, on_board="at a cost")
        self._limit(self._is_fixed(fixed))
        self._budget, self._seed = budget, seed
        self._engine = self._new_engine()
        self._cuts: list[Rows] = []
        self._fixed = fixed
        self._point: _Point | None = None  # of the last corner

    def relaxation(self, num_rounds: int = TUNING.tries) -> Relaxation:
        """Return the results of the relaxation, with dual values amid all that prove it.

        Parameters
        ----------
        num_rounds
            Of cutting planes.
        """
        multipliers = np.zeros(len(self._problem.target_ids))
        losses = np.full(len(self._problem.opportunities), np.inf)
        point = self._cut(num_rounds, self._engine.central)
        if point is not None:
            multipliers = self._model.target_multipliers(point.row_duals)
            losses[self._rows] = np.abs(point.gains[: len(self._rows)])
        value = -np.inf if point is None else point.value
        return Relaxation(value=value, multipliers=multipliers, losses=losses)

    def relaxed(self) -> float:
        """Return the worth of a corner of the relaxation, which becomes the start for ``plan``."""
        point = self._point = self._cut(TUNING.several, self._engine.corner)
        return -np.inf if point is None else point.value

    @property
    def gains(self) -> Floats:
        """What the last corner would gain by more of each opportunity; 0 if not in the program.

        Shape ``(n,)``.
        """
        gains = np.zeros(len(self._problem.opportunities))
        if self._point is not None:
            gains[self._rows] = self._point.gains[: len(self._rows)]
        return gains

    def promising(self, size: int) -> Bools:
        """Return the tasks that cost the last corner least, those that it takes in part first.

        Shape ``(n,)``.
        """
        promising = np.zeros(len(self._problem.opportunities), dtype=np.bool_)
        if self._point is not None:
            taken, gains = (
                each[: len(self._rows)] for each in (self._point.columns, self._point.gains)
            )
            promising[self._rows[np.lexsort((-taken, np.abs(gains)))[:size]]] = True
        return promising

    def turn_aside(self, rng: np.random.Generator) -> None:
        """Move to another corner of the relaxation that is worth about as much."""
        worth = np.concatenate(self._model.program.worth)
        self._engine.weigh(worth * (1.0 + TUNING.trifle * rng.random(len(worth))))
        self._point = self._engine.corner()
        self._engine.weigh(worth)

    def fix(self, contacts: tuple[int, ...]) -> None:
        """Fix other contacts from now on, all of them known to the program."""
        self._fixed = contacts
        self._hold(self._engine)

    def _hold(self, engine: _Engine) -> None:
        at = np.flatnonzero(self._is_contact).astype(np.int32)
        engine.hold(at, self._is_fixed(self._fixed)[at].astype(np.float64))

    def _new_engine(self) -> _Engine:
        return _Engine(self._model.program, self._budget, self._seed, is_chained=True)

    @property
    def _is_contact(self) -> Bools:
        is_contact: Bools = self._problem.opportunities.kind[self._rows] == CONTACT
        return is_contact

    def _is_fixed(self, fixed: tuple[int, ...]) -> Bools:
        """Return which of the program's tasks must be taken."""
        must = self._is_contact & np.isin(self._rows, self._problem.kept_rows)
        is_fixed: Bools = np.isin(self._rows, fixed) | must
        return is_fixed

    def _limit(self, is_fixed: Bools) -> None:
        """Fix tasks, and let only rows limit collects, so that rows get all of the dual values."""
        program, m = self._model.program, len(is_fixed)
        lower, upper = np.concatenate(program.lower), np.concatenate(program.upper)
        if self._model.paid is None:
            upper[:m][upper[:m] > 0.0] = np.inf
        upper[:m][self._is_contact] = 0.0
        lower[:m][is_fixed] = upper[:m][is_fixed] = 1.0
        program.lower, program.upper = [lower], [upper]

    def _cut(self, rounds: int, solve: Callable[[], _Point | None]) -> _Point | None:
        """Add clique cuts for a few rounds; return the optimum of the relaxation, if any."""
        for left in range(rounds, -1, -1):
            point = solve()
            if point is None or left == 0 or not self._add_cuts(point.columns):
                break
        return point

    def _add_cuts(self, taken: Floats) -> bool:
        is_cut = False
        satellites = zip(self._model.problem.satellites, self._model.precedences, strict=True)
        for satellite, precedence in satellites:
            if len(satellite) == 0:
                continue
            own = self._model.taken[satellite.rows]
            offsets, members = violated_cliques(precedence, taken[own])
            cuts = Rows.of(offsets, own[members], upper=1.0)
            self._engine.add_rows(cuts)
            self._cuts.append(cuts)
            is_cut = is_cut or len(offsets) > 1
        return is_cut

    def plan(self, at_least: float, *, is_rounded: bool = False) -> Plan | None:
        """Return a plan worth ``at_least`` if one is found soon, else any plan found, or None.

        Parameters
        ----------
        is_rounded
            Whether to look only near the last corner of the relaxation, and not for long.
        """
        engine = self._new_engine()
        self._hold(engine)
        for cuts in self._cuts:
            engine.add_rows(cuts)
        engine.require(at_least)
        if is_rounded:
            engine.look_no_further()
        max_nodes = 0 if is_rounded else TUNING.highs_nodes
        start = None if self._point is None else self._point.columns
        outcome = engine.search(start, 0.0, TUNING.highs_effort, _unwatched, max_nodes)
        if outcome.columns is None:
            return None
        return Plan.of(self._problem, self._rows[outcome.columns[: len(self._rows)] > 0.5])


def _unwatched(_reward: float, _bound: float) -> None:
    pass
