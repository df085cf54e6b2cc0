"""With battery and recorder, several satellites: plans and prices side by side."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Final

from planner_core.certified.drivers.resource_steps import ResourceSearch
from planner_core.certified.lns.alternating import TurnSearch
from planner_core.certified.mip.program_search import ProgramSearch
from planner_core.certified.mip.solution_pool import PlanPool
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.resources import PriceSearch
from planner_core.problem import Floats

_FLEET_PATIENCE: Final = 60  # turns of a fleet without a better plan
_TURN: Final = 6  # steps of the search for a fleet's plans
_BESIDE_PRICES: Final = (2, 12)  # such steps, for few opportunities and for many
_SHORT_PATIENCE: Final = 2  # of a small one
_FLEET_ROUNDS: Final = 300  # of the search for a fleet's prices
_FLEET_STEPS: Final = 2  # of prices with recorders, from there


def close_in_fleet(search: ResourceSearch, unit: float) -> None:
    """Search for plans and prices side by side, and for plans again until that gets nowhere.

    What is left of a small fleet HiGHS soon settles.
    """
    turns = search.turns(unit)
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
            search.ask_energy(energy)
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
