"""From finished runs to the numbers of the figures and tables."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.paper.measure import Outcome, Task
from benchmarks.paper.published import TABLE_6, TABLE_7, ForwardRow, MctsRow
from benchmarks.paper.readings import BASE
from benchmarks.paper.settings import KINDS, PAPER_MCTS, PAPER_SEARCH, Kind, Params, settings
from benchmarks.paper.study import Done, Study
from planner_core.solvers.registry import SOLVERS

_PAPERS: Final = ("rule", "graph", "milp", "forward_search", "mcts")
METHODS: Final = (*_PAPERS, *(name for name in SOLVERS if name not in _PAPERS))
"""The order of all figures and tables: the paper's methods, then those it does not have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """One method in one figure: means over the draws, with the least and greatest reward.

    Attributes
    ----------
    bound, proven
        The best bound proven by any method; the number of draws in which a valid plan reaches it.
    """

    solver: str
    kind: Kind
    draws: int
    reward: float
    reward_min: float
    reward_max: float
    images: float
    violations: float
    repeats: float
    seconds: float
    reward_per_s: float
    bound: float
    proven: int

    @property
    def share(self) -> float:
        """Return the reward as a share of the bound."""
        return self.reward / self.bound if self.bound else 1.0


def bars(study: Study, done: Done, num_targets: int, *, res: bool) -> list[Bar]:
    """Return the bars of one figure; methods without a finished run are left out."""
    limits = _limits(study, done, num_targets, res=res)
    found = []
    for setting in settings(use_resources=res):
        tasks = [
            study.figure_task(setting, num_targets, draw, res=res) for draw in range(study.draws)
        ]
        pairs = [(done[task], limits[task.draw]) for task in tasks if task in done]
        if not pairs:
            continue
        outcomes = [outcome for outcome, _ in pairs]
        rewards = [o.reward for o in outcomes]
        found.append(
            Bar(
                solver=setting.solver,
                kind=setting.kind,
                draws=len(pairs),
                reward=statistics.fmean(rewards),
                reward_min=min(rewards),
                reward_max=max(rewards),
                images=statistics.fmean(o.images for o in outcomes),
                violations=statistics.fmean(o.violations for o in outcomes),
                repeats=statistics.fmean(o.repeats for o in outcomes),
                seconds=statistics.fmean(o.seconds for o in outcomes),
                reward_per_s=statistics.fmean(o.reward / o.seconds for o in outcomes),
                bound=statistics.fmean(limit.bound for _, limit in pairs),
                proven=sum(limit.is_reached for _, limit in pairs),
            )
        )
    return sorted(found, key=lambda bar: (METHODS.index(bar.solver), tuple(KINDS).index(bar.kind)))


def _limits(study: Study, done: Done, num_targets: int, *, res: bool) -> dict[int, _Limit]:
    """Return what all runs together have proven for each draw of a figure."""
    of_draw: dict[int, list[Outcome]] = {}
    for task, outcome in done.items():
        here = (task.reading, task.use_resources, task.num_targets)
        if here == (BASE, res, num_targets) and task.draw < study.draws:
            of_draw.setdefault(task.draw, []).append(outcome)
    return {draw: _Limit.of(outcomes) for draw, outcomes in of_draw.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Limit:
    bound: float
    is_reached: bool

    @classmethod
    def of(cls, outcomes: Sequence[Outcome]) -> _Limit:
        bound = min(o.bound for o in outcomes)
        best = max((o.reward for o in outcomes if not o.violations), default=0.0)
        # Every reward is 1, so a plan less than 1 below the bound has reached it.
        return cls(bound=bound, is_reached=best > bound - 1.0 + 1e-6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A grid point: the mean over its finished runs."""

    params: Params
    runs: int
    reward: float
    images: float
    violations: float
    seconds: float


def points(
    study: Study, done: Done, solver: str, chosen: Sequence[Params], *, res: bool
) -> list[Point]:
    """Return the measured points among ``chosen``, best first."""
    found = []
    for params in chosen:
        runs = study.mcts_runs if solver == "mcts" else 1
        tasks = [study.grid_task(solver, params, res=res, seed=run) for run in range(runs)]
        outcomes = [done[task] for task in tasks if task in done]
        if outcomes:
            found.append(_point(params, outcomes))
    return sorted(found, key=lambda point: -point.reward)


def _point(params: Params, outcomes: Sequence[Outcome]) -> Point:
    return Point(
        params=params,
        runs=len(outcomes),
        reward=statistics.fmean(o.reward for o in outcomes),
        images=statistics.fmean(o.images for o in outcomes),
        violations=statistics.fmean(o.violations for o in outcomes),
        seconds=statistics.fmean(o.seconds for o in outcomes),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class OutcomeRow:
    """A row of Table 6 or 7 with ours: at the paper's point, and at our best one."""

    published: ForwardRow | MctsRow
    same: Point | None
    best: Point | None


def outcome_rows(study: Study, done: Done, solver: str) -> list[OutcomeRow]:
    """Return Table 6 (forward search) or 7 (MCTS) with our measurements."""
    table: Sequence[ForwardRow | MctsRow] = TABLE_7 if solver == "mcts" else TABLE_6
    grid = study.mcts_points if solver == "mcts" else study.forward_points
    found = []
    for row in table:
        res = row.use_resources
        ours = [p for p in grid if p["breadth"] == row.breadth]
        same = points(study, done, solver, [row_params(row)], res=res)
        ranked = points(study, done, solver, ours, res=res)
        # A single lucky run must not beat a mean over many.
        most_runs = max((point.runs for point in ranked), default=0)
        ranked = [point for point in ranked if point.runs == most_runs]
        found.append(
            OutcomeRow(
                published=row,
                same=same[0] if same else None,
                best=ranked[0] if ranked else None,
            )
        )
    return found


def row_params(row: ForwardRow | MctsRow) -> Params:
    """Return a row's parameters, with those it leaves out set as in the grid."""
    return {**(PAPER_MCTS if isinstance(row, MctsRow) else PAPER_SEARCH), **row.tuned}


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A part of the study: how many of its runs are done, and the CPU time they took."""

    name: str
    runs: int
    planned: int
    cost_s: float

    @property
    def is_whole(self) -> bool:
        """Whether no run is missing."""
        return self.runs == self.planned


def parts(study: Study, done: Done) -> list[Part]:
    """Return the parts of the study; a run shared by two of them counts in the first."""
    named = {
        "figures, quick solvers": study.figures(exact=False),
        "figures, exact solvers": study.figures(exact=True),
        "forward search grid (Table 4)": study.forward(slow=False),
        "forward search grid, depth 7 with resources": study.forward(slow=True),
        "MCTS grid (Table 5), first run of each point": study.mcts(range(1)),
        "MCTS grid, further runs": study.mcts(range(1, study.mcts_runs)),
        "readings": study.read(slow=False) + study.read(slow=True),
    }
    seen: set[Task] = set()
    found = []
    for name, tasks in named.items():
        own = dict.fromkeys(task for task in tasks if task not in seen)
        seen.update(own)
        made = [done[task] for task in own if task in done]
        if own:
            cost_s = sum(outcome.cost_s for outcome in made)
            found.append(Part(name=name, runs=len(made), planned=len(own), cost_s=cost_s))
    return found
