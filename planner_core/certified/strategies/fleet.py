"""Many satellites without resources: incremental multipliers, and a search that uses them.

A high multiplier means that several satellites would take the target. A first plan at these
multipliers gives each satellite about its share. The window search continues from there, and the
plans of its streams are merged. A small fleet goes on to cutting planes and HiGHS, as a single
satellite does. For a large fleet there is time for few moves only: its search prefers targets with
low multipliers, and takes only tasks that cost the bound little.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.fleet_start import start_at_multipliers
from planner_core.certified.lns.search import WindowSearch, num_choices
from planner_core.certified.mip.solution_pool import PlanPool
from planner_core.certified.multipliers.paths import ascent_on_paths
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.certificate import Multipliers
from planner_core.certified.side_by_side import side_by_side
from planner_core.certified.strategies.agility import AgilitySearch, cut_and_prove
from planner_core.certified.strategies.supports import is_small_free_fleet
from planner_core.certified.tuning import TUNING
from planner_core.precedence.network import heaviest_through, network_of
from planner_core.problem import COLLECT, Bools, Floats
from planner_core.problem.plan import Plan
from planner_core.worth import weights


class FleetSearch:
    """A plan of a fleet and a bound that multipliers of its targets prove."""

    def __init__(self, best: Incumbent, seed: int) -> None:
        self.best, self.problem, self.budget = best, best.problem, best.budget
        self._seed = seed
        self._network = network_of(self.problem)
        self._worth = self.problem.worth[self._network.row]
        self._dual = ascent_on_paths(self.problem, self._network, TUNING.epochs, seed)

    @property
    def multipliers(self) -> Floats:
        """Multipliers that prove the bound. Shape ``(num_targets,)``."""
        return self._dual.multipliers

    def ascend(self, num_epochs: float = math.inf) -> None:
        """Search for multipliers, for some epochs or until more are of little use."""
        while num_epochs > 0 and not (self._dual.is_settled or self.best.is_done):
            self._dual.improve(TUNING.epochs_at_a_time, self.budget.stop)
            bound = Bound(value=self._dual.value, proof="lagrangian", multipliers=self.multipliers)
            self.best.lower(bound)
            self.best.report("multipliers")
            num_epochs -= TUNING.epochs_at_a_time

    def start(self) -> None:
        """Plan one part of the network after another at the multipliers."""
        if self.best.is_done:
            return
        self.best.offer(self._plan_at_multipliers(self._seed))
        self.best.report("start")

    def _plan_at_multipliers(self, seed: int) -> Plan:
        table, kept = self.problem.opportunities, self.problem.kept_rows
        taken = np.zeros(len(self.problem.target_ids) + 1, dtype=np.bool_)
        taken[table.site[kept[table.kind[kept] == COLLECT]]] = True
        rows = start_at_multipliers(
            self._network, self._worth, np.append(self.multipliers, 0.0), taken, seed
        )
        return Plan.of(self.problem, rows).with_kept(self.problem)

    def search(self, moves_per_task: float) -> Iterator[None]:
        """Search windows, in several streams if the fleet is small, a slice at a time."""
        num_accesses = num_choices(self.problem)
        num_streams = TUNING.tries if is_small_free_fleet(self.problem) else 1
        offered = None if is_small_free_fleet(self.problem) else self.near_best()
        streams = [self.windows(number) for number in range(num_streams)]
        pool = PlanPool(self.problem, self.budget, self._seed)
        left = int(moves_per_task * num_accesses)
        # So many moves that a few slices without a better plan mean something.
        in_a_slice = int(TUNING.moves_per_task * num_accesses / TUNING.patience) + 1
        with side_by_side(self.budget.num_threads) as together:
            while left > 0 and not self.best.is_done:
                before, end = left, max(left - in_a_slice, 0)
                while left > end and self._is_wanted(pool, streams):
                    num_moves = min(left, TUNING.moves_at_a_time)
                    moves = [
                        partial(one.make_moves, num_moves, self.budget, offered) for one in streams
                    ]
                    together(*moves)
                    left -= num_moves
                    if num_streams > 1 and left // TUNING.moves_at_a_time % TUNING.several == 0:
                        self._merge(pool, streams)
                for plan in (pool.plan, *(stream.plan for stream in streams)):
                    self.best.offer(plan)
                if left == before:
                    return  # a stream's reward is close enough, but not by the referee
                yield

    def _is_wanted(self, pool: PlanPool, streams: Sequence[WindowSearch]) -> bool:
        """Report progress; return whether the search is to continue."""
        reward = max(pool.reward, *(stream.reward for stream in streams))
        self.best.report("window search", reward)
        return not (self.best.is_within(self.best.gap, reward) or self.budget.is_spent())

    def _merge(self, pool: PlanPool, streams: Sequence[WindowSearch]) -> None:
        """Merge the plans of the streams into a better one."""
        for stream in streams:
            pool.add(stream.plan.with_kept(self.problem))
        pool.merge()

    def near_best(self) -> Bools:
        """Return a mask of the opportunities that a plan may hold at little cost to the bound.

        Shape ``(num_opportunities,)``.
        """
        multiplier = np.append(self.multipliers, 0.0)[self._network.site]
        total, through = heaviest_through(self._network, weights(self._worth, multiplier))
        cost = total - through + np.maximum(multiplier - self._worth, 0.0)
        is_near = np.zeros(len(self.problem.opportunities), dtype=np.bool_)
        is_near[self._network.row] = cost <= TUNING.near * self._worth
        return is_near

    def windows(self, number: int) -> WindowSearch:
        """Return a window search with its own start: number 0 the best plan, others another one."""
        preference = None
        if not is_small_free_fleet(self.problem):
            # Targets with low multipliers are hard to reach, as satellites hardly compete for them.
            wanted = np.minimum(self.multipliers / np.maximum(self.problem.best_worth, 1e-300), 1.0)
            preference = 1.0 + TUNING.preference * (0.5 - wanted)
        seed = self._seed + number
        windows = WindowSearch(self.problem, seed, self._network, preference)
        windows.adopt(self.best.plan if number == 0 else self._plan_at_multipliers(seed))
        return windows


def fleet_multipliers(search: Search) -> Iterator[None]:
    """Ascend on the longest paths of all satellites, and plan at the multipliers."""
    fleet = search.engine(FleetSearch)
    for num_epochs in (TUNING.many_epochs, math.inf):
        fleet.ascend(num_epochs)
        fleet.start()
        yield


def windows(search: Search) -> Iterator[None]:
    """Search windows, in several streams if the fleet is small."""
    yield from search.engine(FleetSearch).search(search.effort.moves_per_task)


def fleet_cutting_planes(search: Search) -> Iterator[None]:
    """Add cutting planes and search a small fleet's plans, as for a single satellite."""
    fleet = search.engine(FleetSearch)
    if search.effort.max_rounds == 0:
        return
    engine = search.engine(AgilitySearch)
    search.proof = engine.proof
    engine.step(Multipliers(of_targets=fleet.multipliers))
    if not search.best.is_done:
        yield from cut_and_prove(engine, search.effort)
