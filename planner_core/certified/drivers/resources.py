"""With battery and recorder: plans and bounds by exact programmes that close in on each other.

Where energy is short the programme without prices bounds the best plan within an image or two,
and the same programme over choices of tasks finds one. Where targets are few as well, prices
lower the bound. The relaxations of promising sets of contacts tell prices and, for each set, the
few tasks that make a small mixed-integer program. Where agility alone decides, so does the proof
without resources.
"""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.budget import Budget, ignored
from planner_core.certified.drivers.agility_only import Effort
from planner_core.certified.drivers.commitments import best_commitment
from planner_core.certified.drivers.fleet import solve_without_resources
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import TurnSearch
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.mip.contact_sets import FixedContacts, Relaxation
from planner_core.certified.mip.program_search import ProgramSearch
from planner_core.certified.mip.solution_pool import PlanPool
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.resources import PriceSearch
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.problem import (
    CONTACT,
    Bools,
    Floats,
    Problem,
)
from planner_core.solvers.base import Solution
from planner_core.solvers.milp import Milp
from planner_core.solvers.rule import Rule

_MAX_UNITS: Final = 2000
_FIRST_GOAL: Final = 0.95
_FIRST_MOVES: Final = (10, 40)  # of the search for plans, at least and at most, before contacts
_TASKS_A_MOVE: Final = 80  # are fixed: the more tasks, the more it finds by itself
_FURTHER_MOVES: Final = 20  # after each round of that
_IDLE_STEPS: Final = 5  # of the search for plans, before others have their turn
_FIRST_STEPS: Final = 2  # of the search for prices, where sets of contacts gave new ones
_STEPS: Final = 8
_PATIENCE: Final = 3  # rounds without a new set of contacts or a better plan
_FLEET_PATIENCE: Final = 60  # turns of a fleet without a better plan
_TURN: Final = 6  # steps of the search for a fleet's plans
_BESIDE_PRICES: Final = (2, 12)  # such steps, for few opportunities and for many
_SHORT_PATIENCE: Final = 2  # of a small one
_FLEET_ROUNDS: Final = 300  # of the search for a fleet's prices
_ROUNDS_AT_A_TIME: Final = 100
_FLEET_STEPS: Final = 2  # of prices with recorders, from there
_SETS_AT_A_TIME: Final = 2
_AS_GOOD: Final = 0.75  # of a target: sets whose prices count
_OFFERED: Final = (700, 1000)  # tasks in a search with fixed contacts
_LESS_LIKELY: Final = 0.15  # of a target: what a set is worth less at each further attempt
_ROOM: Final = 0.5  # of a target: with less the search for a better plan takes long
_TIGHT: Final = 0.05  # of a target: prices that near to a relaxation are the best
_MOST_ROWS: Final = 3000  # of a relaxation
_LARGE: Final = 3000  # opportunities
_WORTH_A_STEP: Final = 0.005  # of a bound by the battery alone


class ResourceSearch:
    """A plan and a bound of a problem with resources."""

    def __init__(self, best: Incumbent, seed: int) -> None:
        self.best, self.problem, self.budget = best, best.problem, best.budget
        self.seed, self._first = seed, best.bound
        self._relaxed: dict[tuple[int, ...], Relaxation] = {}
        # By contacts and number of tasks offered: what no plan was found to be worth.
        self._missed: dict[tuple[tuple[int, ...], int], float] = {}
        self._priced = np.inf  # the bound before it was rounded
        self._one = self.problem.typical_worth

    @property
    def is_shared(self) -> bool:
        """Whether there are several satellites."""
        return sum(len(satellite) > 0 for satellite in self.problem.satellites) > 1

    @property
    def is_fleet(self) -> bool:
        """Whether several satellites share so much that the whole program is too large."""
        return self.is_shared and len(self.problem.opportunities) > _LARGE

    def search(self, turns: TurnSearch, num_steps: int) -> bool:
        """Search for plans from the best, while that leads on; return whether one is better."""
        before, idle_steps = self.best.reward, 0
        for _ in range(num_steps):
            if self.best.is_done or idle_steps == _IDLE_STEPS:
                break
            turns.turn(1)
            is_better = turns.reward > self.best.reward and self.best.offer(turns.plan)
            idle_steps = 0 if is_better else idle_steps + 1
        self.best.report("plans")
        return self.best.reward > before

    def without_resources(self) -> Bools:
        """Let agility alone bound the plans; return the tasks of the best plan then."""
        free = replace(self.problem, use_resources=False)
        # Its plans are not for this problem: they are not reported.
        quiet = self.budget.part(report=ignored)
        solution = solve_without_resources(free, quiet, self.seed, self.best.gap, Effort())
        if solution.proven is not None:
            self.best.lower(solution.proven)
        self.best.report("without resources")
        return self.mask(action.opportunity for action in solution.plan.actions)

    def exhaust(self) -> None:
        """Leave what remains to the whole program, which ends with a proof if time suffices."""
        self.best.report("HiGHS")
        quiet = self.budget.part(report=ignored)
        solution = Milp(gap=self.best.gap).solve(self.problem, quiet, self.seed)
        self.best.offer(solution.plan)
        if solution.proven is not None:
            self.best.lower(solution.proven)
        self.best.report("HiGHS")

    def mask(self, rows: Iterable[int]) -> Bools:
        """Return which opportunities these are."""
        mask = np.zeros(len(self.problem.opportunities), dtype=np.bool_)
        mask[list(rows)] = True
        return mask

    def price(self, prices: PriceSearch, num_steps: int) -> None:
        """Make steps towards better prices."""
        for _ in range(num_steps):
            if self.best.is_done or not prices.step(max(self.best.reward, self.relaxed)):
                return
            self._priced = min(self._priced, prices.value)
            self.best.lower(
                Bound(value=prices.value, proof="dp", prices=prices.prices, unit=prices.unit)
            )
        self.best.report("prices")

    def prices(self) -> Floats:
        """Return prices to begin with."""
        known = self.best.bound.prices
        if known is None or self.best.bound is self._first:
            known = lagrangian_bound(self.problem, self.best.reward).prices
        return np.zeros(len(self.problem.target_ids)) if known is None else known

    def relax_sets(self, prices: PriceSearch, turns: TurnSearch) -> bool:
        """Learn prices from the relaxations of sets of contacts; return whether any is new."""
        table = self.problem.opportunities
        plans = [self.mask(a.opportunity for a in p.actions) for p in (self.best.plan, turns.plan)]
        sets = [
            *(tuple(np.flatnonzero(p & (table.kind == CONTACT)).tolist()) for p in plans),
            *(key for key, _ in prices.contact_sets.most_common()),
        ]
        new = [key for key in dict.fromkeys(sets) if key not in self._relaxed][:_SETS_AT_A_TIME]
        offered = np.ones(len(table), dtype=np.bool_)
        if len(table) > _MOST_ROWS:
            offered = (prices.usage > 0.0) | (turns.usage > 0.0)
        offered |= self.mask(action.opportunity for action in self.best.plan.actions)
        for contacts in new:
            if self.best.is_done:
                return False
            program = FixedContacts(self.problem, offered, contacts, self.budget, self.seed)
            self._relaxed[contacts] = program.relaxation()
        if not new or not np.isfinite(self.relaxed):
            return False
        least = self.relaxed - _AS_GOOD * self._one
        near = [r.prices for r in self._relaxed.values() if r.value >= least]
        prices.restart(np.mean(near, axis=0))
        self.best.report("contacts fixed")
        return True

    def fix_contacts(self, *, is_last: bool) -> bool:
        """Search for a better plan with the most promising contacts; return whether it is.

        Where a relaxation leaves little room above a better plan that takes long. Unless this
        is the last resort it waits for prices, which may show that there is none.
        """
        can_sink = self._priced - self.relaxed > _TIGHT * self._one
        room = _ROOM if can_sink and not is_last else 0.0
        hopeful = [
            (relaxation.value - _LESS_LIKELY * attempt * self._one, contacts, size)
            for contacts, relaxation in self._relaxed.items()
            for attempt, size in enumerate(_OFFERED)
            if relaxation.value >= self.best.better + room * self._one - 1e-6
            and self.best.better < self._missed.get((contacts, size), np.inf)
        ]
        if not hopeful or self.best.is_done:
            return False
        _, contacts, size = max(hopeful)
        offered = self.promising(self._relaxed[contacts], size)
        part = FixedContacts(self.problem, offered, contacts, self.budget, self.seed)
        relaxed = part.relaxed()
        if relaxed < self.best.better - 1e-6:
            self._missed[contacts, size] = self.best.better
            return False
        # The last image is the hardest, and may be none: whoever wants it asks again.
        wanted = rounded_bound(self.problem, relaxed - self._one, self.best.better)
        if wanted >= self._missed.get((contacts, size), np.inf):
            wanted = self.best.better
        self.best.report("contacts fixed")
        plan = part.plan(wanted)
        is_better = plan is not None and self.best.offer(plan)
        if self.best.reward < wanted - 1e-6:
            self._missed[contacts, size] = wanted
        return is_better

    def promising(self, relaxation: Relaxation, size: int) -> Bools:
        """Return the tasks that the relaxation would take at the least loss."""
        losses = relaxation.losses
        cut_off = np.sort(losses[np.isfinite(losses)])[:size][-1]
        own = self.mask(action.opportunity for action in self.best.plan.actions)
        promising: Bools = (losses <= cut_off) | own
        return promising

    @property
    def relaxed(self) -> float:
        """What the best relaxation with fixed contacts is worth: prices hardly get below."""
        return max((r.value for r in self._relaxed.values()), default=-np.inf)


def solve_with_resources(problem: Problem, budget: Budget, seed: int, gap: float) -> Solution:
    """Return the best plan of a problem with resources, and its proof."""
    best = Incumbent(problem, budget, gap)
    search = ResourceSearch(best, seed)
    search.best.offer(Rule().solve(problem, Budget(), seed).plan)
    if len(problem.opportunities) == 0:
        return search.best.solution()
    search.best.lower(quick_bound(problem, search.best.reward))
    unit = search.best.unit
    if unit == 0.0 or search.best.bound.value / unit > _MAX_UNITS:
        unit = max(search.best.bound.value / _MAX_UNITS, 1e-12)
    if search.is_shared and not search.best.is_done:
        _close_in_fleet(search, unit)
    if search.is_fleet:
        return search.best.solution()
    choices = ChoiceSearch(problem, unit, seed, budget.stop)
    choices.start(search.mask([]), _FIRST_GOAL)
    search.best.offer(choices.plan)
    search.best.report("plans")
    if search.best.bound.proof == "lagrangian" and not search.best.is_done:
        preferred = search.without_resources()
        choices.start(preferred, 1.0)
        search.best.offer(choices.plan)
    committed = best_commitment(best, unit, _FIRST_GOAL, seed)
    turns = (
        TurnSearch(committed.problem, committed.plan, unit, budget, seed)
        if committed
        else TurnSearch(problem, best.plan, unit, budget, seed)
    )
    search.search(turns, int(np.clip(len(problem.opportunities) // _TASKS_A_MOVE, *_FIRST_MOVES)))
    _close_in(search, turns)
    if not search.best.is_done:
        search.exhaust()
    return search.best.solution()


def _close_in_fleet(search: ResourceSearch, unit: float) -> None:
    """Search for plans and prices side by side, and for plans again until that gets nowhere.

    What is left of a small fleet HiGHS soon settles.
    """
    committed = best_commitment(search.best, unit, _FIRST_GOAL, search.seed)
    if committed:
        turns = TurnSearch(committed.problem, committed.plan, unit, search.budget, search.seed)
    else:
        turns = TurnSearch(search.problem, search.best.plan, unit, search.budget, search.seed)
    pool = PlanPool(search.problem, search.budget, search.seed)
    with ThreadPoolExecutor(search.budget.num_threads) as threads:
        pricing = _FleetPricing(search)
        while not (pricing.is_settled or search.best.is_done):
            _take_turns(search, turns, pool, threads, pricing)
        programs = None
        if search.is_fleet and pricing.prices is not None:
            programs = ProgramSearch(
                search.problem, pool, pricing.prices, pricing.usage, search.budget, search.seed
            )
        idle_turns = 0
        while idle_turns < (_FLEET_PATIENCE if programs else _SHORT_PATIENCE):
            if search.best.is_done:
                return
            is_better = _take_turns(search, turns, pool, threads, programs)
            idle_turns = 0 if is_better else idle_turns + 1


def _take_turns(
    search: ResourceSearch,
    turns: TurnSearch,
    pool: PlanPool,
    threads: ThreadPoolExecutor,
    other: _FleetPricing | ProgramSearch | None,
) -> bool:
    """Let the search for plans and another go on side by side; return whether a plan is better.

    That search learns from no other: it would lead nowhere new from their plans.
    """
    num_steps = _TURN if other is None else other.steps_beside
    work = [threads.submit(turns.turn, num_steps)]
    if other is not None:
        work.append(threads.submit(_go_on, other, pool))
    for turn in work:
        turn.result()
    pool.learn(turns.ended, turns.plan)
    is_better = [search.best.offer(plan) for plan in (turns.plan, pool.plan)]
    search.best.report("plans")
    return any(is_better)


def _go_on(other: _FleetPricing | ProgramSearch, pool: PlanPool) -> None:
    other.turn()
    pool.merge()


class _FleetPricing:
    """Prices by energy alone, and what they prove with recorders.

    Of what recorders take from the bound the exact programmes find nearly all at these prices;
    to search with them takes fifty times as long, and brings next to nothing.

    Attributes
    ----------
    prices
        The search that has seen what they prove, once it has come to that.
    usage
        How many relaxed plans took each opportunity. Shape ``(n,)``.
    steps_beside
        How many steps of the search for plans take about as long as a turn.
    """

    def __init__(self, search: ResourceSearch) -> None:
        self._search = search
        self.steps_beside = _BESIDE_PRICES[search.is_fleet]
        self._paths = EnergyPaths(search.problem)
        self._energy = ascent_on_energy(
            search.problem, self._paths, search.prices(), _FLEET_ROUNDS, search.seed
        )
        self._num_steps = 0
        self.prices: PriceSearch | None = None

    @property
    def usage(self) -> Floats:
        return self._paths.usage

    @property
    def is_settled(self) -> bool:
        return self._num_steps >= _FLEET_STEPS

    def turn(self) -> None:
        """Ask by energy alone some more, or prove something."""
        search, energy = self._search, self._energy
        if not energy.is_settled:
            # What takes opportunities counts from here on: answers come near the best plans.
            self._paths.usage[:] = 0.0
            energy.improve(_ROUNDS_AT_A_TIME, search.budget.stop)
            return
        if self.prices is None:
            self.prices = PriceSearch(
                search.problem,
                min(search.best.bound.value, energy.value),
                energy.multipliers,
                search.budget.stop,
            )
            self.prices.learn(search.best.plan)
        search.price(self.prices, 1)
        self._num_steps += 1


def _close_in(search: ResourceSearch, turns: TurnSearch) -> None:
    """Search for multipliers and plans in turn, until neither gets anywhere."""
    best = search.best
    if best.is_done:
        return
    prices = _first_prices(search)
    is_large = len(search.problem.opportunities) > _LARGE
    idle_rounds = 0
    while idle_rounds < _PATIENCE and not best.is_done:
        is_new = search.relax_sets(prices, turns)
        # Where steps take long, a search for the last image is tried before them.
        is_better = is_large and not is_new and search.fix_contacts(is_last=True)
        if not is_better:
            search.price(prices, _FIRST_STEPS if is_new else _STEPS)
            is_better = search.fix_contacts(is_last=False)
        if not is_new and not is_better:
            is_better = search.fix_contacts(is_last=True)
            is_better |= search.search(turns, _FURTHER_MOVES)
        if is_better and turns.problem is search.problem:
            turns.adopt(best.plan)
        idle_rounds = 0 if is_new or is_better else idle_rounds + 1


def _first_prices(search: ResourceSearch) -> PriceSearch:
    """Return a search for multipliers that begins where battery alone leads.

    To ask the battery alone takes a fiftieth of the time; where that does not lead below what is
    known by much, the exact programme is not asked at its multipliers either.
    """
    best, known = search.best, search.prices()
    paths = EnergyPaths(search.problem)
    energy = ascent_on_energy(search.problem, paths, known, _ROUNDS_AT_A_TIME, search.seed)
    energy.ask()
    before = energy.value
    energy.improve(_ROUNDS_AT_A_TIME, search.budget.stop)
    value = min(best.bound.value, energy.value)
    prices = PriceSearch(search.problem, value, energy.multipliers, search.budget.stop)
    prices.learn(best.plan)
    if energy.value < before - _WORTH_A_STEP * before:
        search.price(prices, 1)
    return prices
