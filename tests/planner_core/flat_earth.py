"""Small problems with continuous starts: satellites that oscillate above a plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.domain import Agility, Resources
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Floats,
    Problem,
)
from planner_core.problem.pointing import Path, Pointing, sights
from planner_core.problem.restrict import restricted
from tests.planner_core.problems import TIGHT, Task, make_problem

_STEP_S = 5.0
_HEIGHT_M = 500e3
_SWING_M = 900e3
_PERIOD_S = 1100.0
_REACH_M = 350e3
COLLECT_S = 30.0


def swinging_path(horizon_s: float, phase: float = 0.0, side_m: float = 0.0) -> Path:
    """Return a path along x; its lines of sight turn by up to 0.6 deg/s."""
    t_s = np.arange(0.0, horizon_s + 2.0 * _STEP_S, _STEP_S)
    turn = 2.0 * np.pi / _PERIOD_S
    nodes = np.zeros((len(t_s), 9))
    nodes[:, 0] = _SWING_M * np.sin(turn * t_s + phase)
    nodes[:, 1] = side_m
    nodes[:, 2] = _HEIGHT_M
    nodes[:, 3] = _SWING_M * turn * np.cos(turn * t_s + phase)
    return Path(_STEP_S, nodes)


def flat_problem(
    seed: int,
    *,
    num_targets: int = 6,
    num_satellites: int = 1,
    horizon_s: float = 600.0,
    spacing_s: float | None = None,
    use_resources: bool = False,
    has_rewards: bool = False,
    num_contacts: int = 0,
    agility: Agility = Agility(),  # noqa: B008 - immutable
    resources: Resources = TIGHT,
) -> Problem:
    """Return a crowded problem drawn from ``seed``, with true lines of sight.

    Without a spacing each access offers one collect, at its middle.
    """
    rng = np.random.default_rng(seed)
    targets_m = np.column_stack(
        [rng.uniform(-8e5, 8e5, num_targets), rng.uniform(-3e5, 3e5, num_targets),
         np.zeros(num_targets)]
    )  # fmt: skip
    paths = tuple(
        swinging_path(horizon_s, *rng.uniform([0.0, -1e5], [6.28, 1e5]))
        for _ in range(num_satellites)
    )
    tasks: list[Task] = []
    accesses: list[tuple[float, float]] = []
    for satellite, path in enumerate(paths):
        for target in range(num_targets):
            for open_s, end_s in _accesses(path, targets_m[target], horizon_s):
                last_s = end_s - COLLECT_S
                starts = [round(0.5 * (open_s + last_s), 3)]
                if spacing_s is not None:
                    starts = [*np.arange(open_s, last_s, spacing_s).round(3).tolist(), last_s]
                tasks += [
                    Task(kind=COLLECT, site=target, start_s=start_s, end_s=start_s + COLLECT_S,
                         satellite=satellite, access=len(accesses))
                    for start_s in starts
                ]  # fmt: skip
                accesses.append((open_s, end_s))
        for _ in range(num_contacts):
            start_s = round(float(rng.uniform(0.0, horizon_s - 100.0)), 3)
            tasks.append(Task(kind=CONTACT, site=0, start_s=start_s, end_s=start_s + 90.0,
                              satellite=satellite))  # fmt: skip
    problem = make_problem(
        tasks,
        num_targets=num_targets,
        num_satellites=num_satellites,
        horizon_s=horizon_s,
        use_resources=use_resources,
        rewards=rng.integers(1, 9, num_targets).tolist() if has_rewards else None,
        agility=agility,
        resources=resources,
    )
    pointing = Pointing(paths=paths, targets_m=targets_m, stations_m=np.array([[4e5, 4e5, 0.0]]))
    return _seen(problem, pointing, accesses)


def _accesses(path: Path, target_m: Floats, horizon_s: float) -> list[tuple[float, float]]:
    t_s = np.arange(0.0, horizon_s + 0.5, 1.0)
    along_m = np.interp(t_s, np.arange(len(path.nodes)) * path.step_s, path.nodes[:, 0])
    is_near = np.abs(along_m - target_m[0]) < _REACH_M
    change = np.flatnonzero(np.diff(np.concatenate([[False], is_near, [False]]).astype(int)))
    spans = [(float(t_s[a]), float(t_s[b - 1])) for a, b in change.reshape(-1, 2)]
    return [(a, b) for a, b in spans if b - a >= COLLECT_S]


def _seen(problem: Problem, pointing: Pointing, accesses: list[tuple[float, float]]) -> Problem:
    """Return the problem with the lines of sight and the accesses that its paths give."""
    table = problem.opportunities
    n = len(table)
    is_collect = table.kind == COLLECT
    for column, t_s in ((table.los_start, table.start_s), (table.los_end, table.end_s)):
        for index, path in enumerate(pointing.paths):
            for kind, sites in ((COLLECT, pointing.targets_m), (CONTACT, pointing.stations_m)):
                own = np.flatnonzero((table.satellite == index) & (table.kind == kind))
                column[own] = sights(path, sites, table.site[own], t_s[own])
    number = np.where(is_collect, table.access - n, 0)
    for row in np.flatnonzero(is_collect):
        table.access_start_s[row], table.access_end_s[row] = accesses[number[row]]
    continuous = replace(problem, continuous_starts=True, pointing=pointing)
    # Transitions are recomputed from the true lines of sight.
    return replace(restricted(continuous, np.arange(n, dtype=np.int32)), origin=None)
