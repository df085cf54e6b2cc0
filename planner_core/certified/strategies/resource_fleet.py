"""With battery and recorder, several satellites: plans and multipliers side by side."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from functools import partial
from operator import itemgetter

import numpy as np

from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.antenna_multipliers import AntennaMultipliers, antenna_multipliers
from planner_core.certified.mip.program_search import ProgramSearch
from planner_core.certified.mip.solution_pool import PlanPool
from planner_core.certified.multipliers.ascent import Ascent, Steps
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.resources import ResourceAscent
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.side_by_side import side_by_side
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import is_fleet
from planner_core.certified.tuning import TUNING
from planner_core.problem import Floats


def plans_and_multipliers(search: Search) -> Iterator[None]:
    """Search for plans and for multipliers side by side, until the multipliers have settled."""
    engine, plans = search.engine(ResourceSearch), search.engine(FleetPlans)
    ascent = plans.ascent(engine)
    while not (ascent.is_settled or search.best.is_done):
        plans.go_on(engine, ascent)
        yield


def plans_and_programs(search: Search) -> Iterator[None]:
    """Search for plans, in steps and by programs side by side, until neither finds a better one.

    Programs begin once the multipliers have been put to the exact programmes. Before, they would
    improve plans as much, but the bound would come last: with rewards of 1 to 10 four satellites
    are at 6.4 % after 20 s.
    """
    engine, plans = search.engine(ResourceSearch), search.engine(FleetPlans)
    ascent = plans.ascent(engine)
    while ascent.exact is None and not (ascent.is_settled or search.best.is_done):
        plans.go_on(engine, ascent)
        yield
    if search.best.is_done:
        return
    programs = None
    if ascent.exact is not None:
        programs = ProgramSearch(
            search.problem, plans.pool, ascent.exact, ascent, search.budget, search.seed
        )
    # For a small fleet, programs for sets of contacts and the whole one follow when this ends.
    patience = TUNING.fleet_patience if is_fleet(engine.problem) else TUNING.patience
    num_idle = 0
    while num_idle < patience and not search.best.is_done:
        num_idle = 0 if plans.go_on(engine, programs) else num_idle + 1
        yield


class FleetPlans:
    """A search for plans, and another beside it.

    Attributes
    ----------
    pool
        Plans of all searches, merged into better ones.
    """

    def __init__(self, best: Incumbent, seed: int) -> None:
        self._best, self._known = best, best.reward
        self.pool = PlanPool(best.problem, best.budget, seed)
        self._ascent: FleetAscent | None = None

    def ascent(self, search: ResourceSearch) -> FleetAscent:
        """Return the search for multipliers, the same one for all strategies."""
        if self._ascent is None:
            self._ascent = FleetAscent(search)
        return self._ascent

    def go_on(self, search: ResourceSearch, other: FleetAscent | ProgramSearch | None) -> bool:
        """Run the search for plans and another side by side; return whether a plan is better.

        The search for plans takes none from the other or the pool, as these would lead it nowhere
        new. If another strategy has found a better plan, it continues from that.
        """
        best, alternating = self._best, search.alternating_search
        if best.reward > self._known:
            alternating.adopt(best.plan)
        steps = TUNING.steps_beside if other is None else other.steps_beside
        with side_by_side(best.budget.num_threads) as together:
            together(partial(alternating.step, steps), partial(self._merge_after, other))
        self.pool.learn(alternating.ended, alternating.plan)
        is_better = [search.offer(plan) for plan in (alternating.plan, self.pool.plan)]
        best.report("plans")
        self._known = best.reward
        return any(is_better)

    def _merge_after(self, other: FleetAscent | ProgramSearch | None) -> None:
        if other is not None:
            other.step()
        self.pool.merge()


class FleetAscent:
    """Multipliers by energy alone, then from relaxations with the plan's contacts; their bound.

    Searching with the exact programmes takes fifty times as long as with energy alone, and gains
    next to nothing if each satellite has an antenna whenever it wants one. If some do not, the
    exact programmes are solved at multipliers of antennas from a linear program
    (``antenna_multipliers``), followed by steps if images count only on the ground. By such steps
    four satellites and two stations have 865 instead of 887, and another four 1,068 instead of
    1,077. Otherwise the relaxation of the plan's contacts accounts for recorders as well, and its
    multipliers are nearly the best for all contacts. If images on board earn a share and antennas
    are short, the relaxation of the whole program proves more.

    Attributes
    ----------
    exact
        The exact search for multipliers, once it has proven a bound.
    knows_antennas
        Whether steps on multipliers of antennas have lowered the bound.
    steps_beside
        How many steps of the search for plans take about as long as the next step here.
    """

    def __init__(self, search: ResourceSearch) -> None:
        self._search = search
        self._paths = EnergyPaths(search.problem)
        self.exact: ResourceAscent | None = None
        self.is_settled = self.knows_antennas = False
        self._work = self._steps()
        self.steps_beside = next(self._work)

    @property
    def losses(self) -> Floats:
        """Approximate cost of taking each; infinite if no good plan does. Shape ``(n,)``."""
        usage = self._paths.usage
        if self.exact is not None and self.knows_antennas:
            usage = self.exact.usage
        # The more answers take an opportunity, the less it costs.
        return np.where(usage > 0.0, 1.0 - usage / max(1.0, usage.max()), np.inf)

    def step(self) -> None:
        """Make the next step: ascend by energy alone, solve a relaxation, or prove a bound."""
        beside = next(self._work, None)
        self.is_settled = beside is None
        self.steps_beside = beside or 1

    def _steps(self) -> Iterator[int]:
        """Yield how long each step takes, before it."""
        search, usage = self._search, self._paths.usage
        beside_ascent = TUNING.steps_beside if is_fleet(search.problem) else TUNING.tries
        energy = ascent_on_energy(
            search.problem, self._paths, search.multipliers(), TUNING.epochs, search.seed
        )
        while not energy.is_settled:
            yield beside_ascent
            # Usage counts only the latest answers, which are nearer to the best plans.
            usage[:] = 0.0
            search.ask_energy(energy)
        yield beside_ascent
        value, multipliers = search.before_ascent(energy)
        # If batteries alone allow so much more than a plan earns, recorders are full: multipliers
        # that account for them prove more.
        is_far = search.best.reward < (1.0 - TUNING.tight) * energy.value
        if is_far:
            yield beside_ascent
            search.whole.solve()
        if search.whole.proves_more_than(value) and not is_fleet(search.problem):
            return
        ascent = search.begin_ascent(value, multipliers)
        yield from self._ascend_exactly(ascent, energy, is_far=is_far)
        yield TUNING.steps_beside
        search.whole.solve()

    def _ascend_exactly(
        self, ascent: ResourceAscent, energy: Ascent, *, is_far: bool
    ) -> Iterator[int]:
        """Lower the bound by the exact programmes."""
        search, known = self._search, self._search.best.bound
        if is_far:
            yield from self._go_by_plan(energy, ascent)
        search.ascend(ascent, 1)
        self.exact = ascent
        if ascent.wants_antennas and search.problem.counts_delivery:
            paid = self._antenna_multipliers(ascent)
            if paid is not None:
                yield TUNING.steps_beside
                search.whole.solve()
                if search.whole.proves_more_than(ascent.value):
                    return
            if (yield from self._ascend_on_antennas(ascent, paid, known)):
                yield from self._prove_finely(ascent)
                return
        if not is_far and ascent.value < (1.0 - TUNING.worth_a_step) * energy.value:
            yield from self._go_by_plan(energy, ascent)
        yield TUNING.steps_beside if is_fleet(search.problem) else TUNING.tries
        search.ascend(ascent, 1)
        if search.problem.counts_delivery:
            yield from self._prove_finely(ascent)

    def _go_by_plan(self, energy: Ascent, ascent: ResourceAscent) -> Iterator[int]:
        """Restart from multipliers of relaxations with the plan's contacts."""
        search, usage = self._search, self._paths.usage
        # With turns to the sun each pair of near tasks has a column, and a relaxation takes as long
        # as ten programs over the few tasks that most answers take.
        is_large = bool(np.count_nonzero(usage) > TUNING.most_relaxed)
        if is_large or search.problem.turns_to_the_sun or not is_fleet(search.problem):
            return
        for share in TUNING.multiplier_shares[1:-1]:
            self._ask_near(share * energy.multipliers)
        # Without cutting planes at first: its multipliers show which further tasks to offer.
        for num_rounds in range(TUNING.tries):
            yield TUNING.steps_beside
            offered = (usage > 0.0) | (ascent.usage > 0.0)
            relaxation = search.relax_plan(offered, num_rounds)
            if relaxation is None:
                break
            self._ask_near(relaxation.multipliers)
            ascent.restart(relaxation.multipliers)

    def _prove_finely(self, ascent: ResourceAscent) -> Iterator[int]:
        """Prove a bound at the best multipliers with more levels of the recorder."""
        yield TUNING.steps_beside
        ascent.count_finely(self._search.best.plan)
        self._search.ascend(ascent, 1)

    def _antenna_multipliers(self, ascent: ResourceAscent) -> AntennaMultipliers | None:
        """Return what antennas are worth if not all images can come down; else None."""
        search = self._search
        plan = search.mask(action.opportunity for action in search.best.plan.actions)
        choices = plan, ascent.latest
        return antenna_multipliers(
            search.problem, ascent.satellites, choices, search.budget, search.seed
        )

    def _ascend_on_antennas(
        self, ascent: ResourceAscent, paid: AntennaMultipliers | None, known: Bound
    ) -> Generator[int, None, bool]:
        """Lower the bound by multipliers of antennas; return whether that succeeded.

        Parameters
        ----------
        paid
            Multipliers to try first.
        known
            An earlier bound: its multipliers are better if recorders limit more than batteries.
        """
        if known.unit is not None and known.multipliers is not None and known.value < ascent.value:
            ascent.restart(known.multipliers)
        at_first, is_paid = min(known.value, ascent.value), False
        if paid is not None:
            lower = yield from self._pay_for_volume(ascent, paid, at_first)
            is_paid, at_first = lower < at_first, lower
        if not self._search.problem.objective.is_delivered:
            # If images earn a share on board, further steps gain too little for the time they take.
            return is_paid
        began = ascent.multipliers, ascent.antenna_multipliers
        # Larger units allow many steps, which gain more than rounding loses.
        unit = ascent.unit
        ascent.count_in(TUNING.several * unit, moves_antennas=True)
        ascent.usage[:] = 0.0
        for _ in range(TUNING.tries):
            yield 1
            self._search.ascend(ascent, TUNING.several)
        if ascent.value > (1.0 - TUNING.worth_a_step) * at_first:
            is_lower = ascent.value < at_first
            ascent.count_in(unit, moves_antennas=False)
            if not is_lower:
                ascent.restart(*began)
            return is_paid
        self.knows_antennas = True
        while not ascent.is_settled:
            yield 1
            self._search.ascend(ascent, TUNING.several)
        return True

    def _pay_for_volume(
        self, ascent: ResourceAscent, paid: AntennaMultipliers, at_first: float
    ) -> Generator[int, None, float]:
        """Try multipliers at which contacts pay for all that images earn by coming down.

        Those of targets are reduced accordingly: by the program's share of each target, or all to
        the share that images earn on board. Returns the better value of the two if it lowers the
        bound noticeably, else the known one.
        """
        search = self._search
        began = ascent.multipliers, ascent.antenna_multipliers
        best = at_first * (1.0 - TUNING.worth_a_step), *began
        for share in (paid.share, search.problem.objective.collected_share):
            yield TUNING.steps_beside
            ascent.restart(share * began[0], paid.of_groups)
            search.ascend(ascent, 1)
            best = min(
                best,
                (ascent.value, ascent.multipliers, ascent.antenna_multipliers),
                key=itemgetter(0),
            )
        ascent.restart(*best[1:])
        return at_first if best[1] is began[0] else best[0]

    def _ask_near(self, multipliers: Floats) -> None:
        """Solve by energy alone at multipliers near these, so that more tasks come into use."""
        num_epochs = TUNING.many_epochs // TUNING.tries
        steps = Steps(first=TUNING.little * TUNING.first_step, last=1.0, num_epochs=num_epochs)
        search = self._search
        ascent = Ascent(self._paths, search.problem.best_worth, multipliers, steps, search.seed)
        ascent.improve(num_epochs, search.budget.stop)
