"""Without resources: prices, window search, cutting planes, and HiGHS for what is left.

Whatever the prices of targets and cuts, they tell of each task what a plan that holds it can
earn at most. Tasks that no better plan can hold are struck out, so that the rest becomes ever
smaller, for the search as well as for the proof.
"""

from __future__ import annotations

import time
from typing import Final

import numpy as np

from planner_core.bounds import default_steps, priced_bound, reward_unit, rounded_bound
from planner_core.certificate import Certificate, Multipliers, is_below, values_through
from planner_core.network import network_of
from planner_core.plan import Plan
from planner_core.problem import Bools, Floats, Ints, Problem
from planner_core.restrict import restricted
from planner_core.solvers.base import Budget, Progress, Solution, Termination
from planner_core.solvers.certified.master import Master
from planner_core.solvers.certified.prover import Prover
from planner_core.solvers.graph import Graph
from planner_core.solvers.lns import improved
from planner_core.solvers.rule import Rule
from planner_core.timeline import replay

TOLERANCE: Final = 1e-6
"""Share of the reward to which a plan is optimal where rewards are not whole."""

_MAX_ROUNDS: Final = 60
_STALLED: Final = 0.04  # of the gap, in _PATIENCE rounds of cuts
_PATIENCE: Final = 4
_WANTED: Final = 1e-3
_REPORT_EVERY_S: Final = 0.25
_MAX_AMOUNTS: Final = 4


class FreeSearch:
    """A plan, a bound, and the tasks that a better plan can hold."""

    def __init__(self, problem: Problem, budget: Budget, seed: int, gap: float) -> None:
        self.problem, self.budget, self.seed, self.gap = problem, budget, seed, gap
        self.unit = reward_unit(problem)
        self.plan, self.reward = Plan(), 0.0
        offered, _ = problem.target_opportunities
        targets = np.unique(problem.opportunities.place[offered])
        self.bound = float(problem.target_reward[targets].sum())
        self.steps = [Multipliers(prices=problem.target_reward.astype(np.float64))]
        self.log: str | None = None
        self.wanted = np.zeros(len(problem.opportunities), dtype=np.bool_)
        self._rows = np.arange(len(problem.opportunities), dtype=np.int32)
        self._rest = problem
        self._reported_s = 0.0
        self._network = network_of(problem)
        self.through: Floats = np.full(len(self._rows), self.bound)

    @property
    def better(self) -> float:
        """What a plan must be worth that is better than the one at hand."""
        least = max(TOLERANCE * self.reward, 1e-9)
        return self.reward + max(self.unit, least)

    @property
    def is_done(self) -> bool:
        """Whether plan and bound are close enough, or the budget is spent."""
        return self.is_close or self.budget.is_spent()

    @property
    def is_close(self) -> bool:
        """Whether plan and bound are as close as was asked for."""
        return self.is_optimal or self.bound - self.reward <= self.gap * self.bound

    @property
    def is_optimal(self) -> bool:
        """Whether no plan is better, to the stated tolerance."""
        return self.bound < self.better

    def offer(self, plan: Plan) -> bool:
        """Take a plan if it is better; return whether it is."""
        reward = replay(self.problem, plan).reward
        if reward <= self.reward:
            return False
        self.plan, self.reward = plan, reward
        return True

    def lower(self, value: float) -> None:
        """Note that no plan is worth more."""
        self.bound = min(self.bound, rounded_bound(self.problem, value, self.reward))

    def step(self, step: Multipliers) -> None:
        """Learn from prices: a bound, and of each open task what it can be part of."""
        total, through = values_through(self.problem, self._network, self._rows, step)
        before = self.bound
        self.lower(total)
        by_row = np.empty(len(self._rows))
        by_row[self._network.row] = through
        lower = np.minimum(self.through, by_row)
        if self.bound < before or np.any(is_below(lower, self.better) > self.is_struck):
            self.steps.append(step)
        self.through = lower

    @property
    def is_struck(self) -> np.ndarray:
        """Which of the open tasks no better plan can hold."""
        return is_below(self.through, self.better)

    def shrink(self) -> None:
        """Leave out the tasks that no better plan can hold."""
        keep = ~self.is_struck
        self._rows, self.through = self._rows[keep], self.through[keep]
        self._rest = restricted(self.problem, self._rows)
        self._network = network_of(self._rest)

    def price(self) -> None:
        """Search for prices anew over what is open."""
        _, prices = priced_bound(
            self._rest, self._network, self.reward, default_steps(self._network), self.budget.stop
        )
        self.step(Multipliers(prices=prices))

    def search(self, moves_per_task: float, rows: Ints) -> bool:
        """Search windows among some of the problem's tasks; return whether that helped."""
        own = np.array([a.opportunity for a in self.plan.actions], dtype=np.int32)
        rows = np.union1d(rows, own).astype(np.int32)
        focus = restricted(self.problem, rows)
        start = Plan.of(focus, np.searchsorted(rows, own))
        plan = improved(focus, start, moves_per_task, self.budget, self.seed + int(self.reward))
        return self.offer(Plan.of(self.problem, rows[[a.opportunity for a in plan.actions]]))

    def report(self, message: str) -> None:
        """Tell how far plan and bound are apart."""
        share = self.reward / self.bound if self.bound > 0.0 else 1.0
        self.budget.report(
            Progress(phase="solve", fraction=min(1.0, share), reward=self.reward,
                     bound=self.bound, message=message)
        )  # fmt: skip

    def open_rows(self, amount: float) -> Ints:
        """Return the tasks that a plan worth this much can hold."""
        return self._rows[~is_below(self.through, amount)]

    def _among(self, is_meant: Bools) -> Bools:
        among = np.zeros(len(self.problem.opportunities), dtype=np.bool_)
        among[self._rows[is_meant]] = True
        return among

    def polish(self) -> None:
        """Let HiGHS find the best plan of the tasks that relaxations have taken, in part."""
        own = [a.opportunity for a in self.plan.actions]
        self.wanted[own] = True
        rows = np.flatnonzero(self.wanted).astype(np.int32)
        part = restricted(self.problem, rows)
        prover = Prover(part, [], self.better, self.bound, self.budget, self.seed)
        plan, _ = prover.prove(0.0, lambda _, __: None)
        if plan is not None:
            self.offer(Plan.of(self.problem, rows[[a.opportunity for a in plan.actions]]))

    def cut(self) -> Master:
        """Price with cutting planes until that leads no further; return the relaxation."""
        self.shrink()
        priced = self.bound + self.unit
        master = Master(self._rest, self.budget, self.seed)
        bounds: list[float] = []
        for _ in range(_MAX_ROUNDS):
            taken = master.relaxed()
            if taken is None:
                break
            self.wanted |= self._among(taken > _WANTED) if len(bounds) > 2 else False
            self.step(master.multipliers(self._rows))
            self.report("cutting planes")
            bounds.append(master.value)
            if self.is_done:
                break
            master.close(~self.is_struck)
            gap = max(bounds[-1] - self.reward, 1e-9)
            # Until paths are priced nearly as well as by the subgradient, odd sets lead astray.
            num_added = master.cut(taken, with_odd_sets=bounds[-1] <= priced + 0.2 * gap)
            is_stalled = (
                len(bounds) > _PATIENCE and bounds[-1 - _PATIENCE] - bounds[-1] < _STALLED * gap
            )
            if num_added == 0 or is_stalled:
                break
        return master

    def prove(self, master: Master, amount: float) -> None:
        """Let HiGHS find a plan worth this much, or prove that there is none."""
        is_open = ~is_below(self.through, amount)
        rows = self._rows[is_open]
        number = np.cumsum(is_open) - 1
        part = restricted(self.problem, rows)
        cuts = [c.among(is_open, number) for c in master.rows_in_use()]
        prover = Prover(part, cuts, amount, amount, self.budget, self.seed)

        def watch(reward: float, bound: float) -> None:
            now_s = time.monotonic()
            if now_s - self._reported_s > _REPORT_EVERY_S:
                self._reported_s = now_s
                self.report("HiGHS searches")

        plan, bound = prover.prove(0.0, watch)
        if plan is not None:
            self.offer(Plan.of(self.problem, rows[[a.opportunity for a in plan.actions]]))
        if bound < self.bound:
            # Whatever is worth the amount is among these tasks.
            below = amount - self.unit if self.unit else amount
            self.log = prover.log
            self.lower(max(bound, below, self.reward))

    def solution(self) -> Solution:
        """Return the plan with what is known of it."""
        if self.is_optimal:
            termination = Termination.OPTIMAL
        elif self.is_close:
            termination = Termination.GAP_REACHED
        elif self.budget.is_spent():
            termination = self.budget.termination()
        else:
            termination = Termination.HORIZON_COMPLETE
        above = self.bound + (self.unit or 4e-9 * max(1.0, self.bound))
        certificate = Certificate(amount=above, steps=tuple(self.steps))
        return Solution(
            plan=self.plan,
            termination=termination,
            bound=self.bound,
            bound_proof="milp" if self.log else "lagrangian",
            certificate=None if self.log else certificate,
            log=self.log,
        )


def solve_free(
    problem: Problem, budget: Budget, seed: int, gap: float, moves_per_task: float
) -> Solution:
    """Return the best plan of a problem without resources, and its proof."""
    search = FreeSearch(problem, budget, seed, gap)
    for solver in (Rule(), Graph()):
        search.offer(solver.solve(problem, Budget(), seed).plan)
    if not search.is_done:
        search.price()
        search.report("prices")
    left = moves_per_task
    while left > 0 and not search.is_done:
        search.search(5.0, search.open_rows(search.reward))
        search.report("window search")
        left -= 5.0
    if search.is_done:
        return search.solution()
    search.price()
    master = search.cut()
    if not search.is_done:
        search.polish()
        search.report("polish")
    while not search.is_done:
        amount = search.better
        if search.unit and search.bound - search.reward <= _MAX_AMOUNTS * search.unit:
            amount = search.bound
        before = (search.bound, search.reward)
        search.prove(master, amount)
        search.report("HiGHS")
        if (search.bound, search.reward) == before:
            break
    return search.solution()
