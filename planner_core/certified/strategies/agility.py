"""Without resources: multipliers, window search, cutting planes, and HiGHS for what is left.

Any multipliers of targets and cuts give, for each task, the most that a plan with that task can
earn. Tasks that no better plan can hold are ruled out (reduced-cost fixing), so that fewer and
fewer remain, for the search as well as for the proof.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator

import numpy as np

from planner_core.certified.driver import Effort, Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.search import WindowSearch
from planner_core.certified.mip.prover import Prover
from planner_core.certified.mip.restricted_master import Master
from planner_core.certified.multipliers.ascent import Ascent
from planner_core.certified.multipliers.elementary import ascent_on_passes
from planner_core.certified.multipliers.paths import ascent_on_paths
from planner_core.certified.program.linear_program import Program
from planner_core.certified.program.model import plan_program
from planner_core.certified.proofs.bound import Bound, accessible, is_optimal, rounded_bound
from planner_core.certified.proofs.certificate import (
    Certificate,
    Multipliers,
    Refutation,
    is_below,
    values_through,
)
from planner_core.certified.proofs.lagrangian import default_epochs
from planner_core.certified.sizes import MAX_PAIRS, PAUSE_S
from planner_core.certified.strategies.supports import is_shared
from planner_core.certified.tolerances import TAKEN
from planner_core.certified.tuning import TUNING
from planner_core.precedence.network import network_of
from planner_core.precedence.relation import is_transitive, num_near_pairs
from planner_core.problem import (
    Bools,
    Floats,
    Ints,
)
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted


class AgilitySearch:
    """A plan, a bound, and the tasks that a better plan can hold."""

    def __init__(self, best: Incumbent, seed: int) -> None:
        self.best, self.problem, self.budget = best, best.problem, best.budget
        self.seed = seed
        self.steps = [Multipliers(of_targets=self.problem.best_worth)]
        self.is_transitive = is_transitive(self.problem)
        self._rows = np.arange(len(self.problem.opportunities), dtype=np.int32)
        self._rest = self.problem
        self._reported_s = 0.0
        self._num_searches = 0
        self._windows: WindowSearch | None = None
        self._window_rows: Ints = self._rows[:0]
        self._network = network_of(self.problem)
        self._ascent: Ascent | None = None
        self._certified = accessible(self.problem).value
        self.through: Floats = np.full(len(self._rows), self._certified)

    @property
    def refuted(self) -> float:
        """What plans are worth at most once it is proven that none is ``better``."""
        return self.best.reward if self.best.unit else self.best.better

    def lower(self, value: float) -> None:
        """Note that no plan is worth more than ``value``, by the steps and what they refute."""
        known = rounded_bound(self.problem, value, self.best.reward)
        self._certified = min(self._certified, known)
        self.best.lower(Bound(value=value, proof="lagrangian"))

    def step(self, step: Multipliers) -> None:
        """Learn from multipliers: a bound, and the most that plans with each open task earn."""
        total, through = values_through(
            self.problem, self._network, self._rows, step, ~self.is_ruled_out
        )
        before = self._certified
        # Plans with tasks that are ruled out are worth less than a better one.
        self.lower(max(total, self.refuted))
        by_row = np.empty(len(self._rows))
        by_row[self._network.row] = through
        lower = np.minimum(self.through, by_row)
        # Only steps that are kept may lower values: the proof replays those alone.
        if self._certified < before or np.any(
            is_below(lower, self.best.better) > self.is_ruled_out
        ):
            self.steps.append(step)
            self.through = lower

    @property
    def is_ruled_out(self) -> np.ndarray:
        """Which of the open tasks no better plan can hold."""
        return is_below(self.through, self.best.better)

    def shrink(self) -> None:
        """Remove the tasks that no better plan can hold."""
        keep = ~self.is_ruled_out
        self._rows, self.through = self._rows[keep], self.through[keep]
        self._rest = restricted(self.problem, self._rows)
        self._network = network_of(self._rest)

    def ascend(self) -> None:
        """Search anew for multipliers, over the open tasks."""
        ascent = ascent_on_paths(self._rest, self._network, default_epochs(len(self._rows)), 0)
        ascent.run(self.best.reward, self.budget.stop)
        self.step(Multipliers(of_targets=ascent.multipliers))

    def ascend_on_passes(self, num_epochs: int) -> None:
        """Ascend for some epochs on paths that are paid for a target once in each pass."""
        if self._ascent is None:
            self._ascent = ascent_on_passes(self.problem, self.seed)
        self._ascent.improve(num_epochs, self.budget.stop)
        value, multipliers = self._ascent.value, self._ascent.multipliers
        self.best.lower(
            Bound(value=value, proof="lagrangian", multipliers=multipliers, is_elementary=True)
        )
        self.best.report("multipliers")

    @property
    def is_small(self) -> bool:
        """Whether few enough tasks are open for cutting planes."""
        is_dense = num_near_pairs(self._rest) > MAX_PAIRS
        return not is_dense and (
            not self.problem.offers_choice or len(self._rows) <= TUNING.most_relaxed
        )

    @property
    def is_settled(self) -> bool:
        """Whether multipliers of targets alone will lower the bound no further."""
        return self._ascent is not None and self._ascent.is_settled

    def search(self, moves_per_task: float, rows: Ints) -> bool:
        """Search windows among some of the tasks; return whether the best plan improved."""
        own = np.array([a.opportunity for a in self.best.plan.actions], dtype=np.int32)
        rows = np.union1d(rows, own).astype(np.int32)
        if self._windows is None or not np.array_equal(rows, self._window_rows):
            self._num_searches += 1
            is_whole = len(rows) == len(self.problem.opportunities)
            focus = self.problem if is_whole else restricted(self.problem, rows)
            is_first = is_whole and self._rest is self.problem
            self._windows = WindowSearch(
                focus, self.seed + self._num_searches, self._network if is_first else None
            )
            self._window_rows = rows
        windows = self._windows
        # A search that has wandered over equal plans continues from its own plan.
        if windows.reward < self.best.reward:
            windows.adopt(Plan.of(windows.problem, np.searchsorted(rows, own)))
        windows.make_moves(int(moves_per_task * len(rows)), self.budget)
        return self.best.offer(
            Plan.of(self.problem, rows[[a.opportunity for a in windows.plan.actions]])
        )

    def open_rows(self, amount: float) -> Ints:
        """Return the tasks that a plan worth ``amount`` can hold."""
        return self._rows[~is_below(self.through, amount)]

    def cut(self, max_rounds: int) -> Generator[None, None, Master]:
        """Add cutting planes, a round per slice, until they lead no further; return the master."""
        self.shrink()
        start = self.best.bound.value + self.best.unit
        master = Master(self._rest, self._rows, self.budget, self.seed)
        bounds: list[float] = []
        for number in range(1, max_rounds + 1):
            taken = master.relaxed()
            if taken is None:
                break
            self.step(master.multipliers())
            self.best.report("cutting planes")
            bounds.append(master.value)
            if number == TUNING.patience and not self.best.is_done:
                self.round_off(master, taken)
            if self.best.is_done:
                break
            master.allow(~self.is_ruled_out)
            gap = max(bounds[-1] - self.best.better, 1e-9)
            # Until the relaxation is nearly as low as the subgradient's bound, zero-half cuts
            # mislead.
            num_added = master.cut(
                taken, with_zero_half_cuts=bounds[-1] <= start + TUNING.near * gap
            )
            is_stalled = (
                len(bounds) > TUNING.patience
                and bounds[-1 - TUNING.patience] - bounds[-1] < TUNING.little * gap
            )
            if num_added == 0 or is_stalled:
                if not self.round_off(master, taken) or self.best.is_done:
                    break
                bounds.clear()
            yield
        return master

    def round_off(self, master: Master, taken: Floats) -> bool:
        """Let HiGHS search the tasks with a share in a relaxation; return whether that helped."""
        if not self.is_transitive:
            return False
        is_own = np.isin(self._rows, [a.opportunity for a in self.best.plan.actions])
        is_offered = is_own | (taken > TAKEN)
        plan, _ = self._prover(master.program(is_offered), is_offered, self.best.better).prove(
            0.0, self._watch, TUNING.highs_nodes
        )
        return plan is not None and self.best.offer(self._whole(plan, is_offered))

    def prove(self, master: Master, amount: float) -> None:
        """Let HiGHS find a plan worth ``amount``, or prove that there is none."""
        is_open = ~is_below(self.through, amount)
        if self.is_transitive:
            program = master.program(is_open)
        else:
            # A plan may need tasks that it is not paid for.
            part = restricted(self.problem, self._rows[is_open])
            program = plan_program(part, "antichain", 0.0).program
            scale = float(self.problem.worth.max())
            program.worth = [worth / scale for worth in program.worth]
        prover = self._prover(program, is_open, amount)
        plan, bound = prover.prove(0.0, self._watch)
        if plan is not None:
            self.best.offer(self._whole(plan, is_open))
        # Every plan worth the amount consists of these tasks.
        below = amount - self.best.unit if self.best.unit else amount
        value = max(bound, below, self.best.reward)
        self.best.lower(Bound(value=value, proof="milp", log=prover.log))

    def _prover(self, program: Program, is_offered: Bools, amount: float) -> Prover:
        part = restricted(self.problem, self._rows[is_offered])
        return Prover(part, program, amount, self.best.bound.value, self.budget, self.seed)

    def _whole(self, plan: Plan, is_offered: Bools) -> Plan:
        """Return a plan of some of the open tasks as one of the whole problem."""
        rows = self._rows[is_offered]
        return Plan.of(self.problem, rows[[a.opportunity for a in plan.actions]])

    def _watch(self, _reward: float, _bound: float) -> None:
        now_s = time.monotonic()
        if now_s - self._reported_s > PAUSE_S:
            self._reported_s = now_s
            self.best.report("HiGHS searches")

    def proof(self) -> Bound:
        """Return the bound with all that proves it."""
        bound = self.best.bound
        # Bounds by multipliers alone follow from the steps too, to the tolerance of "better".
        is_certified = is_optimal(bound.value, self._certified, 0.0)
        if bound.proof != "lagrangian" or not is_certified or bound.is_elementary:
            return bound
        value = max(bound.value, self._certified)
        above = value + (self.best.unit or 4e-9 * max(1.0, value))
        certificate = Certificate(amount=above, refutation=Refutation(steps=tuple(self.steps)))
        return Bound(value=value, proof="lagrangian", certificate=certificate)


def _engine(search: Search) -> AgilitySearch:
    engine = search.engine(AgilitySearch)
    search.proof = engine.proof
    return engine


def path_multipliers(search: Search) -> Iterator[None]:
    """Ascend on the longest paths of a satellite, once."""
    _engine(search).ascend()
    search.best.report("multipliers")
    yield


def pass_multipliers(search: Search) -> Iterator[None]:
    """Ascend on paths that are paid for a target once in each pass over it.

    A fleet already has a bound by paths, and the first steps here prove less.
    """
    engine, best = _engine(search), search.best
    known = best.bound.value
    num_epochs = TUNING.many_epochs if is_shared(search.problem) else TUNING.epochs_at_a_time
    while not engine.is_settled:
        engine.ascend_on_passes(num_epochs)
        if best.bound.value < known or best.is_done:
            yield


def windows(search: Search) -> Iterator[None]:
    """Search windows of the plan; with a choice of starts, longer while that finds nothing."""
    engine, left = _engine(search), search.effort.moves_per_task
    is_beside = search.problem.offers_choice
    least = TUNING.moves_per_task * (TUNING.little if is_beside else 1.0)
    moves = least
    while left > 0 and not search.best.is_close:
        left -= moves
        is_better = engine.search(moves, engine.open_rows(search.best.reward))
        search.best.report("window search")
        moves = least if is_better else min(2.0 * moves, TUNING.moves_per_task)
        yield


def cutting_planes(search: Search) -> Iterator[None]:
    """Add cutting planes and search among the open tasks, until plan and bound meet."""
    engine, best = _engine(search), search.best
    engine.shrink()
    if not engine.is_small:
        best.report("too many starts for cutting planes")
        return
    yield from cut_and_prove(engine, search.effort)


def cut_and_prove(engine: AgilitySearch, effort: Effort) -> Iterator[None]:
    """Add cutting planes, then let HiGHS find a better plan or prove that there is none."""
    best = engine.best
    engine.ascend()
    yield
    master = yield from engine.cut(effort.max_rounds)
    while not best.is_done:
        before = (best.bound, best.reward)
        engine.prove(master, best.better)
        best.report("HiGHS")
        yield
        if (best.bound, best.reward) == before:
            return
