"""The restricted master problem in HiGHS: a relaxation without resources, with cutting planes."""

from __future__ import annotations

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine
from planner_core.certified.mip.zero_half_cuts import Sets, deepest, zero_half_cuts
from planner_core.certified.program.clique_cuts import clique_cover, violated_cliques
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.proofs.certificate import Cut, Multipliers
from planner_core.certified.tuning import TUNING
from planner_core.draws import draws_of
from planner_core.jit import kernel
from planner_core.precedence.relation import (
    Precedence,
    comes_before,
    transitive_closure,
)
from planner_core.problem import (
    COLLECT,
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
)


class Master(Engine):
    """Which tasks to take, fractionally: exclusion sets, zero-half cuts, and their multipliers.

    It has no columns for paths: sets of tasks of one satellite that exclude each other express the
    same, and few of them matter.

    Parameters
    ----------
    rows
        Row of each opportunity in the problem whose bound is to be proven.
    """

    def __init__(self, problem: Problem, rows: Ints, budget: Budget, seed: int) -> None:
        self._rows = rows
        self._problem = problem
        self._scale = float(problem.worth.max(initial=1e-300))
        self._worth = worth = problem.worth / self._scale
        self._precedences = [
            _exclusion(transitive_closure(s), s.site, s.kind) for s in problem.satellites
        ]
        self._draws = draws_of(seed)
        self._cuts: dict[tuple[int, ...], Cut] = {}
        members, offsets = problem.target_opportunities
        self._sets = Sets(offsets, members)
        self._num_targets = len(offsets) - 1
        for satellite, precedence in zip(problem.satellites, self._precedences, strict=True):
            cover, rows = clique_cover(precedence)
            self._keep_sets(cover, satellite.rows[rows])
        program = Program()
        self._useful = worth > 0.0
        program.add_columns(worth, upper=self._useful.astype(np.float64))
        program.add_rows(Rows.of(self._sets.offsets, self._sets.members, upper=1.0))
        # The sets that each row of the program adds up, and for how long the row has been idle.
        self._row_sets: list[tuple[int, ...]] = [(i,) for i in range(len(self._sets.offsets) - 1)]
        self._idle = [0] * len(self._row_sets)
        super().__init__(program, budget, seed, is_chained=False)

    @property
    def value(self) -> float:
        """Value of the last relaxation."""
        return float(self._highs.getInfo().objective_function_value) * self._scale

    def multipliers(self) -> Multipliers:
        """Return the multipliers of targets and cuts from the last relaxation's dual values."""
        rows = self._rows
        multiplier = self.row_duals * self._scale
        multipliers = multiplier[: self._num_targets].copy()
        site = self._problem.opportunities.site
        cuts, of_cuts = [], []
        for row in np.flatnonzero(multiplier > 1e-9 * self._scale):
            picked = self._row_sets[row]
            if row < self._num_targets:
                continue
            groups = [self._members(i) for i in picked]
            is_on_path = len(groups) == 1 and len(np.unique(site[groups[0]])) == len(groups[0])
            if not is_on_path:
                if picked not in self._cuts:
                    self._cuts[picked] = Cut(sets=tuple(rows[group] for group in groups))
                cuts.append(self._cuts[picked])
                of_cuts.append(float(multiplier[row]))
        return Multipliers(of_targets=multipliers, cuts=tuple(cuts), of_cuts=tuple(of_cuts))

    def allow(self, is_open: Bools) -> None:
        """Allow only these tasks from now on."""
        n = len(self._useful)
        upper = self._useful & is_open
        columns = np.arange(n, dtype=np.int32)
        self._highs.changeColsBounds(n, columns, np.zeros(n), upper.astype(np.float64))

    def cut(self, taken: Floats, *, with_zero_half_cuts: bool) -> int:
        """Add cuts that the fractional plan violates, drop idle ones; return the number added."""
        self._drop_idle()
        num_before = len(self._row_sets)
        picked = self._zero_half_cuts(taken) if with_zero_half_cuts else []
        for satellite, precedence in zip(self._problem.satellites, self._precedences, strict=True):
            offsets, members = violated_cliques(precedence, taken[satellite.rows])
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

    def program(self, is_open: Bools) -> Program:
        """Return the relaxation's program for some of the tasks: exact if transitive."""
        number = np.cumsum(is_open) - 1
        program = Program()
        program.add_columns(self._worth[is_open], upper=self._useful[is_open].astype(np.float64))
        offsets, columns, values, limits = [0], [], [], []
        for picked in self._row_sets:
            cut = Cut(sets=tuple(self._members(i) for i in picked))
            members, weights = cut.weights()
            kept = is_open[members]
            if kept.sum() < 2:
                continue
            offsets.append(offsets[-1] + int(kept.sum()))
            columns.append(number[members[kept]])
            values.append(weights[kept].astype(np.float64))
            limits.append(float(cut.limit))
        if columns:
            program.add_rows(
                Rows.of(
                    np.array(offsets, dtype=np.int64), np.concatenate(columns),
                    np.concatenate(values), upper=np.array(limits),
                )
            )  # fmt: skip
        return program

    def _members(self, i: int) -> Ints:
        return self._sets.members[self._sets.offsets[i] : self._sets.offsets[i + 1]]

    def _keep_sets(self, offsets: np.ndarray, members: Ints) -> None:
        last = self._sets.offsets[-1]
        self._sets = Sets(
            np.concatenate([self._sets.offsets, last + offsets[1:]]),
            np.concatenate([self._sets.members, members]),
        )

    def _zero_half_cuts(self, taken: Floats) -> list[tuple[int, ...]]:
        """Return the deepest zero-half cuts, not too many of them on the same tasks."""
        depth_of: dict[tuple[int, ...], float] = {}
        for _ in range(TUNING.several):
            chosen = zero_half_cuts(self._sets, taken, self._draws)
            cuts, depth = deepest(
                self._sets, chosen, taken, TUNING.max_cuts, TUNING.max_cuts // TUNING.several
            )
            for cut, beyond in zip(cuts, depth, strict=True):
                group = chosen.members[chosen.offsets[cut] : chosen.offsets[cut + 1]]
                depth_of[tuple(np.sort(group).tolist())] = float(beyond)
        return sorted(depth_of, key=lambda group: (-depth_of[group], group))[: TUNING.max_cuts]

    def _drop_idle(self) -> None:
        solution = self._highs.getSolution()
        dual = np.abs(np.array(solution.row_dual))
        for row, picked in enumerate(self._row_sets):
            if len(picked) > 1:
                self._idle[row] = self._idle[row] + 1 if dual[row] < 1e-9 else 0
        drop = [row for row, idle in enumerate(self._idle) if idle >= TUNING.tries]
        if drop:
            self._highs.deleteRows(len(drop), np.array(drop, dtype=np.int32))
            gone = set(drop)
            self._row_sets = [p for row, p in enumerate(self._row_sets) if row not in gone]
            self._idle = [idle for idle in self._idle if idle < TUNING.tries]


def _exclusion(precedence: Precedence, site: Ints, kind: np.ndarray) -> Precedence:
    """Return the precedence without pairs of tasks on one target, which exclude each other too."""
    return precedence._replace(
        bits=_without_equals(precedence, np.where(kind == COLLECT, site, -1))
    )


@kernel
def _without_equals(precedence: Precedence, site: Ints) -> Bytes:
    bits = precedence.bits.copy()
    for a in range(len(site)):
        for b in range(precedence.near_from[a], precedence.far_from[a]):
            if site[a] >= 0 and site[a] == site[b] and comes_before(precedence, a, b):
                bit = precedence.offset[a] + b - precedence.near_from[a]
                bits[bit >> 3] ^= np.uint8(1 << (bit & 7))
    return bits
