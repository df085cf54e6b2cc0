"""What is run, and in which order: the most important first, in case time runs out."""

from __future__ import annotations

import itertools
import json
import random
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from benchmarks.paper.measure import Outcome, Task
from benchmarks.paper.published import (
    GRID_TARGETS,
    MCTS_RUNS,
    TABLE_6,
    TABLE_7,
    TARGETS,
    ForwardRow,
    MctsRow,
    forward_grid,
    mcts_grid,
)
from benchmarks.paper.readings import BASE, Reading, readings
from benchmarks.paper.settings import (
    PAPER_MCTS,
    PAPER_SEARCH,
    Params,
    Setting,
    as_text,
    settings,
)
from planner_core.solvers.registry import SOLVERS

Done = Mapping[Task, Outcome]

MCTS_VARIANTS: Final[Mapping[str, Params]] = {
    "Algorithm 2 with the reward in q": {},
    "Algorithm 2 as printed": {"returns": "literal"},
    "discount per decision": {"discount": "per_decision"},
    "hard limits": {"feasibility": "hard"},
    "r <= 0 becomes sun-pointing": {"worthless": "sunpoint"},
}
"""Readings of the algorithm, in addition to those of the mission."""

_BEST_POINTS: Final = 5
_SLOW_LEAVES: Final = 10_000  # per decision; such searches take far longer than all others


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """The size of the study."""

    targets: tuple[int, ...] = TARGETS
    draws: int = 10
    grid_targets: int = GRID_TARGETS
    forward_points: tuple[Params, ...] = tuple(forward_grid())
    mcts_points: tuple[Params, ...] = tuple(mcts_grid())
    mcts_runs: int = MCTS_RUNS
    readings_without: tuple[Reading, ...] = readings(use_resources=False)
    readings_with: tuple[Reading, ...] = readings(use_resources=True)
    exact_limit_s: float = 20.0

    def figure_task(self, setting: Setting, num_targets: int, draw: int, *, res: bool) -> Task:
        """Return the run behind one dot of a figure."""
        return Task(
            reading=BASE,
            use_resources=res,
            num_targets=num_targets,
            draw=draw,
            solver=setting.solver,
            params=as_text(setting.params),
            limit_s=self.exact_limit_s if SOLVERS[setting.solver].exact else 0.0,
        )

    def figures(self, *, exact: bool) -> list[Task]:
        """Return the runs of the eight figures, by exact solvers or by all others."""
        return [
            self.figure_task(setting, num_targets, draw, res=res)
            for draw, num_targets, res in itertools.product(
                range(self.draws), sorted(self.targets, key=_distance_to_1000), (False, True)
            )
            for setting in settings(use_resources=res)
            if SOLVERS[setting.solver].exact == exact
        ]

    def grid_task(
        self, solver: str, params: Params, *, res: bool, seed: int = 0, reading: Reading = BASE
    ) -> Task:
        """Return one run of a grid point."""
        return Task(
            reading=reading,
            use_resources=res,
            num_targets=self.grid_targets,
            draw=0,
            solver=solver,
            params=as_text(params),
            seed=seed,
        )

    def forward(self, *, slow: bool) -> list[Task]:
        """Return the slow or the other runs of Table 4's grid in both families."""
        return [
            self.grid_task("forward_search", point, res=res)
            for point, res in itertools.product(
                sorted(self.forward_points, key=_leaves), (False, True)
            )
            if _is_slow_point(point, res=res) == slow
        ]

    def mcts(self, runs: range) -> list[Task]:
        """Return these runs of every point of Table 5's grid in both families.

        The paper's rows come first, then all others shuffled: if time runs out before the grid
        is done, the results are a fair sample of it.
        """
        rows = [row.tuned for row in TABLE_7]
        mixed = random.Random(0).sample(self.mcts_points, len(self.mcts_points))
        ordered = sorted(mixed, key=lambda point: all(row.items() - point.items() for row in rows))
        return [
            self.grid_task("mcts", point, res=res, seed=run)
            for run, point, res in itertools.product(runs, ordered, (False, True))
        ]

    def of_family(self, *, res: bool) -> tuple[Reading, ...]:
        """Return the readings of one family."""
        return self.readings_with if res else self.readings_without

    def read(self, *, slow: bool) -> list[Task]:
        """Return the paper's best rows under every reading: slow ones (a minute) or the rest."""
        tasks = []
        for res in (False, True):
            for reading in self.of_family(res=res):
                tasks.append(self.rule_task(reading, res=res))
                tasks.append(self.reading_task(best_forward(res), reading))
                for variant in MCTS_VARIANTS:
                    tasks.append(self.reading_task(best_mcts(res), reading, variant))
        return [task for task in tasks if _is_slow(task) == slow]

    def rule_task(self, reading: Reading, *, res: bool) -> Task:
        """Return the rule-based run of one reading."""
        rule = next(s for s in settings(use_resources=res) if s.solver == "rule")
        return self.grid_task("rule", rule.params, res=res, reading=reading)

    def reading_task(
        self, row: ForwardRow | MctsRow, reading: Reading, variant: str | None = None
    ) -> Task:
        """Return a row of the paper's tables, run under one reading."""
        if isinstance(row, ForwardRow):
            params = {**PAPER_SEARCH, **row.tuned}
            return self.grid_task("forward_search", params, res=row.use_resources, reading=reading)
        params = {**PAPER_MCTS, **row.tuned, **MCTS_VARIANTS[variant or next(iter(MCTS_VARIANTS))]}
        return self.grid_task("mcts", params, res=row.use_resources, reading=reading)

    def best_so_far(self, done: Done) -> list[Task]:
        """Return all runs of the MCTS points that are best for their breadth and family."""
        tasks = []
        for res, breadth in itertools.product((False, True), (3, 4, 5)):
            points = [p for p in self.mcts_points if p["breadth"] == breadth]
            leaders = sorted(points, key=lambda p: self._mean(p, res, done), reverse=True)
            tasks += [
                self.grid_task("mcts", point, res=res, seed=run)
                for run in range(self.mcts_runs)
                for point in leaders[:_BEST_POINTS]
            ]
        return tasks

    def _mean(self, point: Params, res: bool, done: Done) -> float:
        tasks = (self.grid_task("mcts", point, res=res, seed=r) for r in range(self.mcts_runs))
        rewards = [done[task].reward for task in tasks if task in done]
        return statistics.fmean(rewards) if rewards else -1.0

    def phases(self) -> Iterator[tuple[str, Callable[[Done], Sequence[Task]]]]:
        """Yield the phases in order; a phase may depend on earlier results."""
        yield "figures", lambda _: self.figures(exact=False)
        yield "forward search grid", lambda _: self.forward(slow=False)
        yield "figures, exact solvers", lambda _: self.figures(exact=True)
        yield "readings", lambda _: self.read(slow=False)
        yield "MCTS grid, first runs", lambda _: self.mcts(range(1))
        yield "readings, slow ones", lambda _: self.read(slow=True)
        yield "MCTS grid, leading points", self.best_so_far
        yield "forward search grid, slow points", lambda _: self.forward(slow=True)
        yield "MCTS grid, further runs", lambda _: self.mcts(range(1, self.mcts_runs))

    def all_tasks(self) -> list[Task]:
        """Return every task once, ignoring the time limit."""
        tasks = (task for _, choose in self.phases() for task in choose({}))
        return list(dict.fromkeys(tasks))


def best_forward(res: bool) -> ForwardRow:
    """Return the first row of Table 6 in one family."""
    return next(row for row in TABLE_6 if row.use_resources == res)


def best_mcts(res: bool) -> MctsRow:
    """Return the first row of Table 7 in one family."""
    return next(row for row in TABLE_7 if row.use_resources == res)


def quick() -> Study:
    """Return the study in five minutes: one draw, thinned grids, one run of each point."""
    forward = [p for p in forward_grid() if p["gamma"] in (0.99, 0.999) and p["depth"] == 3]
    mcts = [
        point
        for point in mcts_grid()
        if point["gamma"] != 0.999
        and point["depth"] in (10, 20)
        and point["exploration"] == 3.0
        and point["num_simulations"] in (50, 200)
    ]
    return Study(
        draws=1,
        forward_points=tuple(forward),
        mcts_points=tuple(mcts),
        mcts_runs=1,
        readings_with=(BASE, replace(BASE, look_deg=(0.0, 50.0))),
        exact_limit_s=3.0,
    )


def _distance_to_1000(num_targets: int) -> int:
    return abs(num_targets - GRID_TARGETS)


def _leaves(point: Params) -> int:
    return int((point["breadth"] + 1) ** point["depth"])


def _is_slow_point(point: Params, *, res: bool) -> bool:
    return res and _leaves(point) > _SLOW_LEAVES


def _is_slow(task: Task) -> bool:
    """Return whether a reading takes a minute: a deep search, or MCTS that wanders."""
    params = json.loads(task.params)
    if task.solver == "forward_search":
        return _is_slow_point(params, res=task.use_resources)
    return task.use_resources and params.get("returns") == "literal"
