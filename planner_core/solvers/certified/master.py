"""The relaxation of a problem without resources, in HiGHS, with its cutting planes."""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.certificate import Cut, Multipliers
from planner_core.comparable import Order, comes_before, order_of, transitive_closure
from planner_core.draws import draws_of
from planner_core.jit import kernel
from planner_core.problem import COLLECT, Bools, Bytes, Floats, Ints, Problem
from planner_core.solvers.base import Budget
from planner_core.solvers.certified.odd_sets import Sets, depths, odd_sets
from planner_core.solvers.milp.antichains import antichain_cover, violated_antichains
from planner_core.solvers.milp.highs import Engine
from planner_core.solvers.milp.program import Program, Rows

_TRIALS: Final = 4  # orders of elimination that are tried for odd sets
_MAX_CUTS: Final = 150  # in a round
_MAX_SHARED: Final = 8  # new cuts that one fractional task may stand in
_MIN_DEPTH: Final = 1e-3
_PATIENCE: Final = 2  # rounds that a cut may lie idle


class Master(Engine):
    """Which tasks to take, fractionally: exclusion sets, odd sets, and their prices.

    Paths are not in it: sets of tasks of one satellite that exclude each other say as much,
    and those that matter are few.
    """

    def __init__(self, problem: Problem, budget: Budget, seed: int) -> None:
        self._problem = problem
        table = problem.opportunities
        self._scale = float(problem.target_reward.max(initial=1e-300))
        worth = np.zeros(len(table))
        is_collect = table.kind == COLLECT
        worth[is_collect] = problem.target_reward[table.place[is_collect]] / self._scale
        self._orders = [
            _exclusion_order(order_of(transitive_closure(problem, s)), s.place, s.kind)
            for s in problem.satellites
        ]
        self._draws = draws_of(seed)
        members, offsets = problem.target_opportunities
        self._sets = Sets(offsets, members)
        self._num_targets = len(offsets) - 1
        for satellite, order in zip(problem.satellites, self._orders, strict=True):
            cover, rows = antichain_cover(order)
            self._keep_sets(cover, satellite.rows[rows])
        program = Program()
        program.add_columns(worth, upper=(worth > 0.0).astype(np.float64))
        program.add_rows(Rows.of(self._sets.offsets, self._sets.members, upper=1.0))
        # For each row of the program the sets that it adds up, and how long it has lain idle.
        self._row_sets = [(i,) for i in range(len(self._sets.offsets) - 1)]
        self._idle = [0] * len(self._row_sets)
        super().__init__(program, budget, seed, is_chained=False)

    @property
    def value(self) -> float:
        """Return what the last relaxation is worth."""
        return self._bound * self._scale

    def multipliers(self, rows: Ints) -> Multipliers:
        """Return the prices that the last relaxation has put on targets and cuts.

        Parameters
        ----------
        rows
            For each opportunity of this problem its row in the problem that is to be proven.
        """
        price = np.abs(np.array(self._highs.getSolution().row_dual)) * self._scale
        prices = price[: self._num_targets].copy()
        place = self._problem.opportunities.place
        cuts, cut_prices = [], []
        for row in np.flatnonzero(price > 1e-9 * self._scale):
            picked = self._row_sets[row]
            if row < self._num_targets:
                continue
            groups = [self._members(i) for i in picked]
            is_on_path = len(groups) == 1 and len(np.unique(place[groups[0]])) == len(groups[0])
            if not is_on_path:
                cuts.append(Cut(sets=tuple(rows[group] for group in groups)))
                cut_prices.append(float(price[row]))
        return Multipliers(prices=prices, cuts=tuple(cuts), cut_prices=tuple(cut_prices))

    def close(self, is_open: Bools) -> None:
        """Allow only these tasks from now on."""
        closed = np.flatnonzero(~is_open).astype(np.int32)
        zeros = np.zeros(len(closed))
        self._highs.changeColsBounds(len(closed), closed, zeros, zeros)

    def cut(self, taken: Floats, *, with_odd_sets: bool) -> int:
        """Add what the fractional plan breaks, drop what has long been idle; return what came."""
        self._drop_idle()
        num_before = len(self._row_sets)
        picked = self._odd_sets(taken) if with_odd_sets else []
        for satellite, order in zip(self._problem.satellites, self._orders, strict=True):
            offsets, members = violated_antichains(order, taken[satellite.rows])
            if len(offsets) > 1:
                first = len(self._sets.offsets) - 1
                self._keep_sets(offsets, satellite.rows[members])
                self.add_rows(Rows.of(offsets, satellite.rows[members], upper=1.0))
                self._row_sets += [(first + i,) for i in range(len(offsets) - 1)]
        for group in picked:
            cut = Cut(sets=tuple(self._members(i) for i in group))
            members, weights = cut.weights()
            offsets = np.array([0, len(members)], dtype=np.int64)
            self.add_rows(
                Rows.of(offsets, members, weights.astype(np.float64), upper=float(cut.limit))
            )
            self._row_sets.append(group)
        self._idle += [0] * (len(self._row_sets) - num_before)
        return len(self._row_sets) - num_before

    def rows_in_use(self) -> list[Cut]:
        """Return the cuts that the relaxation holds."""
        return [
            Cut(sets=tuple(self._members(i) for i in picked))
            for picked in self._row_sets
            if len(picked) > 1
        ]

    def _members(self, i: int) -> Ints:
        return self._sets.members[self._sets.offsets[i] : self._sets.offsets[i + 1]]

    def _keep_sets(self, offsets: np.ndarray, members: Ints) -> None:
        last = self._sets.offsets[-1]
        self._sets = Sets(
            np.concatenate([self._sets.offsets, last + offsets[1:]]),
            np.concatenate([self._sets.members, members]),
        )

    def _odd_sets(self, taken: Floats) -> list[tuple[int, ...]]:
        """Return the deepest cuts, not too many of them about the same tasks."""
        deepest: dict[tuple[int, ...], float] = {}
        for _ in range(_TRIALS):
            chosen = odd_sets(self._sets, taken, self._draws)
            depth = depths(self._sets, chosen, taken)
            for i in np.flatnonzero(depth > _MIN_DEPTH):
                group = chosen.members[chosen.offsets[i] : chosen.offsets[i + 1]]
                deepest[tuple(int(one) for one in np.sort(group))] = float(depth[i])
        is_fractional = (taken > 1e-5) & (taken < 1.0 - 1e-5)
        shared = np.zeros(len(taken), dtype=np.int32)
        picked = []
        for group in sorted(deepest, key=lambda g: (-deepest[g], g)):
            members, _ = Cut(sets=tuple(self._members(i) for i in group)).weights()
            about = members[is_fractional[members]]
            if np.all(shared[about] < _MAX_SHARED):
                shared[about] += 1
                picked.append(group)
                if len(picked) == _MAX_CUTS:
                    break
        return picked

    def _drop_idle(self) -> None:
        solution = self._highs.getSolution()
        dual = np.abs(np.array(solution.row_dual))
        for row, picked in enumerate(self._row_sets):
            if len(picked) > 1:
                self._idle[row] = self._idle[row] + 1 if dual[row] < 1e-9 else 0
        drop = [row for row, idle in enumerate(self._idle) if idle >= _PATIENCE]
        if drop:
            self._highs.deleteRows(len(drop), np.array(drop, dtype=np.int32))
            gone = set(drop)
            self._row_sets = [p for row, p in enumerate(self._row_sets) if row not in gone]
            self._idle = [idle for idle in self._idle if idle < _PATIENCE]


def _exclusion_order(order: Order, place: Ints, kind: np.ndarray) -> Order:
    """Return an order without the pairs of tasks on one target: those exclude each other too."""
    return order._replace(bits=_without_equals(order, np.where(kind == COLLECT, place, -1)))


@kernel
def _without_equals(order: Order, place: Ints) -> Bytes:
    bits = order.bits.copy()
    for a in range(len(place)):
        for b in range(order.near_from[a], order.far_from[a]):
            if place[a] >= 0 and place[a] == place[b] and comes_before(order, a, b):
                bit = order.offset[a] + b - order.near_from[a]
                bits[bit >> 3] ^= np.uint8(1 << (bit & 7))
    return bits
