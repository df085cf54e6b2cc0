"""With battery and recorder, several satellites: plans and prices side by side."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from planner_core.certified.driver import Search
from planner_core.certified.lns.alternating import TurnSearch
from planner_core.certified.mip.program_search import ProgramSearch
from planner_core.certified.mip.solution_pool import PlanPool
from planner_core.certified.multipliers.ascent import Ascent, Steps
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.resources import PriceSearch
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.side_by_side import Together, side_by_side
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import is_fleet
from planner_core.certified.tuning import TUNING
from planner_core.problem import Floats


def plans_and_multipliers(search: Search) -> Iterator[None]:
    """Search for plans and multipliers side by side, and for plans again until that fails.

    Where other strategies have found a better plan, the search for plans goes on from that.
    """
    engine, best = search.engine(ResourceSearch), search.best
    turns, known = engine.turn_search, best.reward
    pool = PlanPool(search.problem, search.budget, search.seed)
    # A small fleet has other strategies, which go on when this one has ended.
    patience = TUNING.fleet_patience if is_fleet(engine.problem) else TUNING.patience
    with side_by_side(search.budget.num_threads) as together:
        pricing = _FleetPricing(engine)
        other: _FleetPricing | ProgramSearch = pricing
        idle_turns = 0
        while idle_turns < patience and not best.is_done:
            if best.reward > known:
                turns.adopt(best.plan)
            is_better = _take_turns(engine, turns, pool, together, other)
            known = best.reward
            idle_turns = 0 if is_better or other is pricing else idle_turns + 1
            yield
            if other is pricing and pricing.is_settled:
                other = ProgramSearch(
                    search.problem, pool, engine.price_search, pricing.losses, search.budget,
                    search.seed,
                )  # fmt: skip


def _take_turns(
    search: ResourceSearch,
    turns: TurnSearch,
    pool: PlanPool,
    together: Together,
    other: _FleetPricing | ProgramSearch,
) -> bool:
    """Let the search for plans and another go on side by side; return whether a plan is better.

    That search learns from no other: it would lead nowhere new from their plans.
    """
    together(partial(turns.turn, other.steps_beside), partial(_go_on, other, pool))
    pool.learn(turns.ended, turns.plan)
    is_better = [search.offer(plan) for plan in (turns.plan, pool.plan)]
    search.best.report("plans")
    return any(is_better)


def _go_on(other: _FleetPricing | ProgramSearch, pool: PlanPool) -> None:
    other.turn()
    pool.merge()


class _FleetPricing:
    """Prices by energy alone, then by relaxations with the plan's contacts; and what they prove.

    To search with the exact programmes takes fifty times as long as with energy alone, and brings
    next to nothing where each satellite has an antenna when it wants one. Where some do not, prices
    of antennas are found by it alone: four satellites and two stations that are to bring down all
    images come to 865 in place of 887, and another four to 1,068 in place of 1,077.
    Otherwise the relaxation of the plan's contacts knows of recorders as well, and its
    prices are nearly the best for all contacts.

    Attributes
    ----------
    prices
        The search that has seen what they prove, once it has come to that.
    knows_antennas
        Whether prices of antennas have lowered the bound.
    losses
        What taking each opportunity costs, about; infinite where no good plan does.
        Shape ``(n,)``.
    steps_beside
        How many steps of the search for plans take about as long as the next turn.
    """

    def __init__(self, search: ResourceSearch) -> None:
        self._search = search
        self._paths = EnergyPaths(search.problem)
        self.prices: PriceSearch | None = None
        self.is_settled = self.knows_antennas = False
        self._work = self._steps()
        self.steps_beside = next(self._work)

    @property
    def losses(self) -> Floats:
        relaxation, usage = self._search.best_relaxation, self._paths.usage
        if relaxation is not None:
            return relaxation.losses
        if self.prices is not None and self.knows_antennas:
            usage = self.prices.usage
        if self._search.problem.turns_to_the_sun or self.knows_antennas:
            # Pairs of tasks make programs large: those come first that most answers take.
            return np.where(usage > 0.0, 1.0 - usage / max(1.0, usage.max()), np.inf)
        return np.where(usage > 0.0, 0.0, np.inf)

    def turn(self) -> None:
        """Ask by energy alone some more, or relax, or prove something."""
        beside = next(self._work, None)
        self.is_settled = beside is None
        self.steps_beside = beside or 1

    def _steps(self) -> Iterator[int]:
        """Yield how long each turn takes, before it."""
        search, usage = self._search, self._paths.usage
        beside_prices = TUNING.steps_beside if is_fleet(search.problem) else TUNING.tries
        energy = ascent_on_energy(
            search.problem, self._paths, search.prices(), TUNING.epochs, search.seed
        )
        while not energy.is_settled:
            yield beside_prices
            # What takes opportunities counts from here on: answers come near the best plans.
            usage[:] = 0.0
            search.ask_energy(energy)
        yield beside_prices
        prices, _ = search.begin_prices(energy)
        known = search.best.bound
        search.price(prices, 1)
        self.prices = prices
        has_full_recorders = prices.value < (1.0 - TUNING.worth_a_step) * energy.value
        if prices.wants_antennas and search.problem.counts_delivery:
            yield from self._price_antennas(prices, known)
            if self.knows_antennas:
                yield from self._prove_finely(prices)
                return
        # With turns to the sun each pair of near tasks has a column, and a relaxation takes as long
        # as ten programs over the few tasks that most answers take.
        is_small = bool(np.count_nonzero(usage) <= TUNING.most_relaxed)
        is_relaxed = is_small and not search.problem.turns_to_the_sun
        if is_fleet(search.problem) and is_relaxed and has_full_recorders:
            for share in TUNING.price_shares[1:-1]:
                self._ask_near(share * energy.multipliers)
            # Without cutting planes at first: that finds tasks.
            for num_rounds in range(TUNING.tries):
                yield TUNING.steps_beside
                offered = (usage > 0.0) | (prices.usage > 0.0)
                relaxation = search.relax_plan(offered, num_rounds)
                if relaxation is None:
                    break
                self._ask_near(relaxation.prices)
                prices.restart(relaxation.prices)
        yield beside_prices
        search.price(prices, 1)
        if search.problem.counts_delivery:
            yield from self._prove_finely(prices)

    def _prove_finely(self, prices: PriceSearch) -> Iterator[int]:
        """Ask the best prices once more, with more levels of the recorder."""
        yield TUNING.steps_beside
        prices.count_finely(self._search.best.plan)
        self._search.price(prices, 1)

    def _price_antennas(self, prices: PriceSearch, known: Bound) -> Iterator[int]:
        """Let prices of antennas lower the bound, as long as they do.

        Parameters
        ----------
        known
            A bound from before: its prices are better where recorders are shorter than batteries.
        """
        if known.unit is not None and known.prices is not None and known.value < prices.value:
            prices.restart(known.prices)
        # Steps are many, and rounding to larger units loses less than they gain.
        unit, at_first = prices.unit, min(known.value, prices.value)
        began = prices.prices, prices.antenna_prices
        prices.count_in(TUNING.several * unit, moves_antennas=True)
        prices.usage[:] = 0.0
        for _ in range(TUNING.tries):
            yield 1
            self._search.price(prices, TUNING.several)
        if prices.value > (1.0 - TUNING.worth_a_step) * at_first:
            is_lower = prices.value < at_first
            prices.count_in(unit, moves_antennas=False)
            if not is_lower:
                prices.restart(*began)
            return
        self.knows_antennas = True
        while not prices.is_settled:
            yield 1
            self._search.price(prices, TUNING.several)

    def _ask_near(self, prices: Floats) -> None:
        """Let satellites answer prices near these, by energy alone: more tasks get to be known."""
        num_epochs = TUNING.many_epochs // TUNING.tries
        steps = Steps(first=TUNING.little * TUNING.first_step, last=1.0, num_epochs=num_epochs)
        search = self._search
        ascent = Ascent(self._paths, search.problem.best_worth, prices, steps, search.seed)
        ascent.improve(num_epochs, search.budget.stop)
