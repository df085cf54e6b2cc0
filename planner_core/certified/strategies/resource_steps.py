"""The steps with battery and recorder, each towards a better plan or a lower bound.

`resources.py` combines them into slices for one satellite, `resource_fleet.py` for several.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import AlternatingSearch
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.lns.downlinks import brought_down
from planner_core.certified.mip.contact_sets import FixedContacts, Relaxation
from planner_core.certified.multipliers.ascent import Ascent, Steps
from planner_core.certified.multipliers.data import DataPaths
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.resources import ResourceAscent
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.latency import latency_value
from planner_core.certified.strategies.relaxed import Relaxed
from planner_core.certified.strategies.supports import is_large
from planner_core.certified.tuning import TUNING
from planner_core.problem import CONTACT, Bools, Floats
from planner_core.problem.plan import Plan


class _Begun(NamedTuple):
    """What batteries or recorders alone prove, its multipliers, and if an ascent lowered it."""

    value: float
    multipliers: Floats
    has_fallen: bool


class ResourceSearch:
    """A plan and a bound of a problem with resources."""

    def __init__(self, best: Incumbent, seed: int) -> None:
        self.best, self.problem, self.budget = best, best.problem, best.budget
        self.seed, self._first = seed, best.bound
        self._relaxed: dict[tuple[int, ...], Relaxation] = {}
        # By contacts and number of tasks offered: the worth that no plan was found to have.
        self._missed: dict[tuple[tuple[int, ...], int], float] = {}
        self._unrounded = np.inf  # the bound before it was rounded
        self.whole = Relaxed(best, seed)
        self._one = self.problem.typical_worth
        self._agility_decides = False
        self._brought_down: set[Plan] = set()  # plans already tried with further contacts
        self._ascent: ResourceAscent | None = None

    @cached_property
    def unit(self) -> float:
        """The unit of worth for exact programmes."""
        unit, bound = self.best.unit, self.best.bound.value
        if unit == 0.0 or bound / unit > TUNING.max_units:
            return max(bound / TUNING.max_units, 1e-12)
        return unit

    def choose(self, alone: Callable[[], Bools]) -> Iterator[None]:
        """Seek first plans among choices of tasks, and near the best plan of agility alone.

        Parameters
        ----------
        alone
            Returns the tasks of a plan that only agility limits.
        """
        choices = ChoiceSearch(self.problem, self.unit, self.seed, self.budget.stop)
        choices.start(self.mask([]), TUNING.first_goal)
        self.offer(choices.plan)
        self.best.report("plans")
        yield
        self._agility_decides = self._is_bound_by_agility()
        if self._agility_decides and not self.best.is_done:
            choices.start(alone(), 1.0)
            self.offer(choices.plan)
            yield

    def _is_bound_by_agility(self) -> bool:
        """Return whether battery and recorder limit plans hardly more than agility alone."""
        if self.best.bound.proof == "lagrangian":
            return True
        if not self.problem.counts_delivery or self.problem.objective.is_delivered:
            return False
        # Data that stays on board lowers the other bound a little, but limits no images.
        alone = lagrangian_bound(self.problem, self.best.reward)
        # 0 to 3 % above it if agility decides (the demonstration's mission), 76 % or more if energy
        # does (the paper's draws).
        return alone.value <= (1.0 + TUNING.far_above) * self.best.bound.value

    @cached_property
    def alternating_search(self) -> AlternatingSearch:
        """The search for plans, the same one for all strategies."""
        return self.alternating(self.unit)

    def alternating(self, unit: float) -> AlternatingSearch:
        """Return a search for plans that starts from the best one."""
        return AlternatingSearch(self.problem, self.best.plan, unit, self.budget, self.seed)

    def search(self, alternating: AlternatingSearch, num_steps: int) -> bool:
        """Search for plans until a few steps gain nothing; return whether the best one improved."""
        before, idle_steps = self.best.reward, 0
        for _ in range(num_steps):
            if self.best.is_done or idle_steps == TUNING.several:
                break
            alternating.step(1)
            is_better = alternating.reward > self.best.reward and self.offer(alternating.plan)
            idle_steps = 0 if is_better else idle_steps + 1
        self.best.report("plans")
        return self.best.reward > before

    def offer(self, plan: Plan) -> bool:
        """Take a plan, or the plan with further contacts, if it is better; return whether it is.

        The search for plans counts the most that each image can earn. With further contacts more
        images come down: on the demonstration's mission a plan earns 178.6 of 180 after 10 CPU
        seconds, and 172.3 without them (177.6 and 171.7 after five).
        """
        is_better = self.best.offer(plan)
        if plan in self._brought_down:
            return is_better
        self._brought_down.add(plan)
        more = brought_down(self.problem, plan, self.budget, self.best.judge)
        return (more is not plan and self.best.offer(more)) or is_better

    def mask(self, rows: Iterable[int]) -> Bools:
        """Return a mask of these opportunities. Shape ``(n,)``."""
        mask = np.zeros(len(self.problem.opportunities), dtype=np.bool_)
        mask[list(rows)] = True
        return mask

    def ascend(self, ascent: ResourceAscent, num_steps: int) -> None:
        """Make steps towards better multipliers."""
        for _ in range(num_steps):
            if self.best.is_done:
                return
            goes_on = ascent.step(max(self.best.reward, self.relaxed))
            self._unrounded = min(self._unrounded, ascent.value)
            self.best.lower(ascent.bound())
            if not goes_on:
                break
        self.best.report("multipliers")

    def multipliers(self) -> Floats:
        """Return multipliers to start from."""
        known = self.best.bound.multipliers
        if known is None or self.best.bound is self._first:
            known = lagrangian_bound(self.problem, self.best.reward).multipliers
        return np.zeros(len(self.problem.target_ids)) if known is None else known

    @property
    def resource_ascent(self) -> ResourceAscent:
        """The exact search for multipliers, which starts from those of battery or recorder alone.

        If their ascent hardly lowers the value, the exact programme is not run at its multipliers.
        """
        if self._ascent is not None:
            return self._ascent
        begun = self._begun
        ascent = self.begin_ascent(begun.value, begun.multipliers)
        if begun.has_fallen:
            self.ascend(ascent, 1)
        return ascent

    @property
    def relaxation_suffices(self) -> bool:
        """Whether the whole relaxation proves more than the exact programmes' first multipliers."""
        return self.whole.is_known and self.whole.proves_more_than(self._begun.value)

    @cached_property
    def _begun(self) -> _Begun:
        """Solve by the battery and the recorder alone, which takes a fiftieth of the time."""
        paths = EnergyPaths(self.problem)
        energy = ascent_on_energy(
            self.problem, paths, self.multipliers(), TUNING.many_epochs, self.seed
        )
        energy.ask()
        before = energy.value
        self.ask_energy(energy)
        value, multipliers = self.before_ascent(energy)
        return _Begun(value, multipliers, value < before - TUNING.worth_a_step * before)

    def before_ascent(self, energy: Ascent) -> tuple[float, Floats]:
        """Return what batteries or recorders alone prove, and the multipliers for that."""
        self.prove_by_energy(energy)
        return self.ask_data(energy)

    def begin_ascent(self, value: float, multipliers: Floats) -> ResourceAscent:
        """Begin the exact search for multipliers; if it has begun, return the same search."""
        if self._ascent is None:
            self._ascent = ResourceAscent(
                self.problem, min(self.best.bound.value, value), multipliers, self.budget.stop
            )
            self._ascent.learn(self.best.plan)
        return self._ascent

    def ask_energy(self, energy: Ascent) -> None:
        """Seek better multipliers by energy alone, for some epochs."""
        energy.improve(TUNING.many_epochs, self.budget.stop)

    def ask_data(self, energy: Ascent) -> tuple[float, Floats]:
        """Return the better value by batteries or by recorders alone, and its multipliers.

        If energy is plentiful and images on board earn a share, recorders prove more: one to three
        real satellites over few stations have bounds of 125.3, 367.3 and 252.5 by them after ten
        CPU seconds, and 130.5, 377.5 and 258.8 without.
        """
        known = energy.value, energy.multipliers
        paths = DataPaths.of(self.problem)
        if paths is None:
            return known
        steps = Steps(first=TUNING.first_step, last=TUNING.last_step, num_epochs=TUNING.many_epochs)
        data = Ascent(paths, self.problem.best_worth, self.multipliers(), steps, self.seed)
        data.ask()
        if data.value > (1.0 + TUNING.far_above) * energy.value:
            return known  # energy decides
        data.improve(TUNING.many_epochs, self.budget.stop)
        return (data.value, data.multipliers) if data.value < energy.value else known

    def prove_by_energy(self, energy: Ascent) -> None:
        """Lower the bound to what batteries alone prove, if that is less.

        The exact programmes include recorders but count worth in units, and lose by that if images
        of a target differ in worth: four satellites under clouds have 801.0 by batteries and 806.2
        by those programmes, another four 728.8 by batteries and 734.0 by agility alone.
        """
        # With turns to the sun the values are estimates.
        if energy.value < self.best.bound.value and not self.problem.turns_to_the_sun:
            multipliers = energy.multipliers
            none = np.zeros(np.count_nonzero(self.problem.opportunities.kind == CONTACT))
            value = latency_value(self.problem, multipliers, none)
            self.best.lower(
                Bound(value=value, proof="dp", multipliers=multipliers, contact_multipliers=none)
            )

    def relax_sets(self, ascent: ResourceAscent, alternating: AlternatingSearch) -> bool:
        """Learn multipliers from the relaxations of sets of contacts; return whether any is new."""
        table = self.problem.opportunities
        plans = [
            self.mask(a.opportunity for a in p.actions) for p in (self.best.plan, alternating.plan)
        ]
        sets = [
            *(tuple(np.flatnonzero(p & (table.kind == CONTACT)).tolist()) for p in plans),
            *(key for key, _ in ascent.contact_sets.most_common()),
        ]
        new = [key for key in dict.fromkeys(sets) if key not in self._relaxed][: TUNING.tries]
        offered = np.ones(len(table), dtype=np.bool_)
        if is_large(self.problem):
            offered = (ascent.usage > 0.0) | (alternating.usage > 0.0)
        offered |= self.mask(action.opportunity for action in self.best.plan.actions)
        for contacts in new:
            if self.best.is_done:
                return False
            program = FixedContacts(self.problem, offered, contacts, self.budget, self.seed)
            self._relaxed[contacts] = program.relaxation()
        if not new or not np.isfinite(self.relaxed):
            return False
        least = self.relaxed - TUNING.room * self._one
        near = [r.multipliers for r in self._relaxed.values() if r.value >= least]
        ascent.restart(np.mean(near, axis=0))
        self.best.report("contacts fixed")
        return True

    def relax_plan(self, offered: Bools, num_rounds: int) -> Relaxation | None:
        """Return the relaxation with the best plan's contacts, None if it has no point.

        Parameters
        ----------
        offered
            Tasks that may be taken besides those of the plan. Shape ``(n,)``.
        num_rounds
            Of cutting planes.
        """
        own, contacts = self._own
        program = FixedContacts(self.problem, offered | own, contacts, self.budget, self.seed)
        relaxation = program.relaxation(num_rounds)
        self._relaxed[contacts] = relaxation
        self.best.report("contacts fixed")
        return relaxation if np.isfinite(relaxation.value) else None

    def fix_own_contacts(self) -> bool:
        """Search all tasks for a better plan with the best one's contacts; return if there is one.

        Rounds of cutting planes take three times as long and lead no further, nor does HiGHS beyond
        its first node: that node takes a second or two, the longer search took 16.
        """
        if self.best.bound.value < self.best.better + TUNING.room * self._one:
            return False
        own, contacts = self._own
        if contacts not in self._relaxed:
            self.relax_plan(np.ones_like(own), 0)
        return self.fix_contacts(is_last=False, is_rounded=True)

    @property
    def _own(self) -> tuple[Bools, tuple[int, ...]]:
        """Mask of the opportunities that the best plan takes, and its contacts."""
        own = self.mask(action.opportunity for action in self.best.plan.actions)
        is_contact = self.problem.opportunities.kind == CONTACT
        return own, tuple(np.flatnonzero(own & is_contact).tolist())

    def fix_contacts(self, *, is_last: bool, is_rounded: bool = False) -> bool:
        """Search for a better plan with the most promising contacts; return whether there is one.

        This takes long if a relaxation leaves little room above a better plan. Then, unless it is
        the last resort, it waits for multipliers, which may prove that there is none.

        Parameters
        ----------
        is_rounded
            Whether to look only near the relaxation.
        """
        can_sink = self._unrounded - self.relaxed > TUNING.tight * self._one
        room = TUNING.room if can_sink and not is_last else 0.0
        sizes = TUNING.open_tasks, int(TUNING.more * TUNING.open_tasks)
        hopeful = [
            (relaxation.value - TUNING.tight * attempt * self._one, contacts, size)
            for contacts, relaxation in self._relaxed.items()
            for attempt, size in enumerate(sizes)
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
        # The last image is the hardest to find and may not exist: only a later call asks for it.
        wanted = rounded_bound(self.problem, relaxed - self._one, self.best.better)
        if wanted >= self._missed.get((contacts, size), np.inf):
            wanted = self.best.better
        self.best.report("contacts fixed")
        plan = part.plan(wanted, is_rounded=is_rounded)
        is_better = plan is not None and self.best.offer(plan)
        if self.best.reward < wanted - 1e-6:
            self._missed[contacts, size] = wanted
        return is_better

    def promising(self, relaxation: Relaxation, size: int) -> Bools:
        """Return the tasks of least reduced cost in the relaxation, and those of the best plan."""
        losses = relaxation.losses
        cut_off = np.sort(losses[np.isfinite(losses)])[:size][-1]
        own = self.mask(action.opportunity for action in self.best.plan.actions)
        promising: Bools = (losses <= cut_off) | own
        return promising

    @property
    def relaxed(self) -> float:
        """Value of the best relaxation with fixed contacts: multipliers hardly get below it."""
        return max((r.value for r in self._relaxed.values()), default=-np.inf)
