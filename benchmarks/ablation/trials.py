"""Cases of the suite with one change each: each a fork that starts from the same built problem."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from benchmarks.ablation.strategies import NOTHING, Change
from benchmarks.missions import problem_of
from benchmarks.suite import rows
from benchmarks.suite.engine import Case, Result, solve, warm_up
from benchmarks.suite.families import FAMILIES, scenario_of
from planner_core.problem import Problem


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial(rows.Row):
    """One line: a case of the suite and its change, ``NOTHING`` for the unchanged solver."""

    change: str = NOTHING


def run(changes: Mapping[str, Change], path: Path, *, anew: bool = False) -> None:
    """Run missing changes and the unchanged solver, and write each line at once.

    Parameters
    ----------
    anew
        Whether results of another revision count as missing.
    """
    revision, before = rows.revision(), rows.read(path, Trial)
    plain = {one.case for one in before if not one.change and one.revision == revision}
    told = [one for one in before if not anew or one.revision == revision]
    known = {(one.change, one.case) for one in told}
    for case, names in _by_case(changes).items():
        missing = [name for name in names if (name, case) not in known]
        if not missing:
            continue
        if case not in plain:
            missing.insert(0, NOTHING)
        warm_up(case.family)
        problem = problem_of(scenario_of(FAMILIES[case.family], case.draw))
        for name in missing:
            result = forked(problem, case, changes.get(name))
            trial = rows.row_of(case, result, Trial, change=name)
            rows.append(path, trial)
            print(
                f"{case.family} draw {case.draw}, {name or 'as it is'}: "
                f"{trial.failure or trial.gap_percent}, {trial.to_level_s}, {trial.used_s}",
                flush=True,
            )


def _by_case(changes: Mapping[str, Change]) -> dict[Case, list[str]]:
    """Return which changes each case is run with."""
    found: dict[Case, list[str]] = {}
    for name, change in changes.items():
        for case in cases_of(change):
            found.setdefault(case, []).append(name)
    return found


def cases_of(change: Change) -> Iterable[Case]:
    """Yield the cases on which a change is tried."""
    for family, budget_s in change.families.items():
        for draw in range(change.num_draws):
            yield Case(family=family, draw=draw, seed=draw, budget_s=budget_s)


def forked(problem: Problem, case: Case, change: Change | None) -> Result | str:
    """Return a changed solver's result, or how it failed."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=_answer, args=(theirs, problem, case, change))
    child.start()
    theirs.close()
    try:
        answer: Result | str = ours.recv()
    except EOFError:
        answer = "ended without an answer"
    child.join()
    return answer


def _answer(connection: Connection, problem: Problem, case: Case, change: Change | None) -> None:
    try:
        if change:
            change.apply()
        connection.send(solve(problem, case.seed, case.budget_s))
    except Exception as error:  # noqa: BLE001 - a strategy may be needed: that is a result
        connection.send(f"{type(error).__name__}: {error}")
