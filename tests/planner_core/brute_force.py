"""The best plan of a small problem, by trying all; shares no code with the solvers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner_core.problem import COLLECT, Pinned, Problem
from planner_core.problem.plan import Columns, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.pinned_plan import breaches
from planner_core.referee.replay import replay
from planner_core.referee.sight import turns_between
from planner_core.referee.timeline import Timeline
from planner_core.worth import share_earned

Rows = tuple[int, ...]


def best_reward(problem: Problem) -> float:
    """Return the highest reward of any valid plan, judged by the referee; 0 if there is none."""
    best = best_plan(problem)
    return 0.0 if best is None else replay(problem, best, in_detail=False).reward


def best_plan(problem: Problem) -> Plan | None:
    """Return a valid plan of the highest reward, judged by the referee, if there is any.

    Plans with an infeasible slew or a broken pin are skipped. The others are judged in descending
    order of what they could earn, until no remaining one can earn more.
    """
    most, alone, refused = _Most(problem), _Alone(problem), _Refused(problem)
    # Among equals the longest first: it includes the contacts that its images need.
    plans = sorted(
        ((most.of(rows), len(rows), rows) for rows in possible_plans(problem)), reverse=True
    )
    best, reward = None, 0.0
    for at_most, _, rows in plans:
        if best is not None and at_most <= reward:
            break
        if refused.has(rows):
            continue
        if best is not None and alone.most(rows) + most.on_board <= reward:
            continue
        plan = Plan.of(problem, rows)
        timeline = replay(problem, plan, in_detail=False)
        refused.learn(rows, timeline)
        if timeline.is_valid and (best is None or timeline.reward > reward):
            best, reward = plan, timeline.reward
    return best


def has_plan(problem: Problem) -> bool:
    """Return whether there is any valid plan."""
    worthless = replace(problem, worth=np.zeros(len(problem.opportunities)), full_worth=None)
    return best_plan(worthless) is not None


def possible_plans(problem: Problem) -> Iterator[Rows]:
    """Yield the tasks of each plan in which every slew fits and every pin is kept."""
    kept = set(problem.kept_rows.tolist())
    for rows in _chains(problem, _not_ruled_out(problem), _may_follow(problem)):
        if not kept or kept.issubset(rows):
            yield rows


class _Most:
    """An upper bound on a plan's reward: each image is downlinked as soon as a contact begins."""

    def __init__(self, problem: Problem) -> None:
        table = problem.opportunities
        self._is_image: list[bool] = (table.kind == COLLECT).tolist()
        self._site: list[int] = table.site.tolist()
        self._satellite: list[int] = table.satellite.tolist()
        # Age of each image at each contact; last column: no contact follows.
        age_s = np.maximum(table.start_s[None, :] - table.end_s[:, None], 0.0)
        age_s = np.column_stack([age_s, np.full(len(table), np.inf)])
        if problem.counts_delivery:
            worth = problem.worth_on_ground[:, None] * share_earned(problem.objective, age_s)
        else:
            worth = np.broadcast_to(problem.worth[:, None], age_s.shape)
        self._worth: list[list[float]] = worth.tolist()
        self.on_board = sum(i.worth for i in problem.on_board if problem.counts_delivery)

    def of(self, rows: Rows) -> float:
        """Return an upper bound on what tasks in this order earn."""
        best: dict[int, float] = {}
        contact: dict[int, int] = {}
        for row in reversed(rows):
            if self._is_image[row]:
                worth = self._worth[row][contact.get(self._satellite[row], -1)]
                target = self._site[row]
                best[target] = max(best.get(target, 0.0), worth)
            else:
                contact[self._satellite[row]] = row
        return sum(best.values()) + self.on_board


class _Refused:
    """Sequences with which no satellite may begin, since battery or recorder breaks a limit there.

    A level after a task depends only on that task and those before it. So a plan in which
    a satellite begins like that is invalid, whatever follows.
    """

    def __init__(self, problem: Problem) -> None:
        self._satellite: list[int] = problem.opportunities.satellite.tolist()
        self._beginnings: set[Rows] = set()

    def has(self, rows: Rows) -> bool:
        """Return whether some satellite's tasks begin with a refused sequence."""
        own: dict[int, Rows] = {}
        if self._beginnings:
            for row in rows:
                satellite = self._satellite[row]
                own[satellite] = (*own.get(satellite, ()), row)
                if own[satellite] in self._beginnings:
                    return True
        return False

    def learn(self, rows: Rows, timeline: Timeline) -> None:
        """Record the limits that the referee reports as broken."""
        for violation in timeline.violations:
            if violation.code in ("battery", "recorder") and violation.blamed:
                begun = rows[: min(violation.blamed) + 1]
                satellite = violation.satellite
                self._beginnings.add(tuple(r for r in begun if self._satellite[r] == satellite))


class _Alone:
    """An upper bound on a plan's reward, from the referee's verdict on each satellite's part alone.

    Slews, battery and recorder concern one satellite, and many plans of a fleet share a part.
    """

    def __init__(self, problem: Problem) -> None:
        self._free = replace(problem, pinned=Pinned())
        self._satellite: list[int] = problem.opportunities.satellite.tolist()
        self._known: dict[Rows, dict[int, float] | None] = {}

    def most(self, rows: Rows) -> float:
        """Return an upper bound on the plan's reward; zero if a part of it is invalid."""
        parts: dict[int, list[int]] = {}
        for row in rows:
            parts.setdefault(self._satellite[row], []).append(row)
        if len(parts) < 2:
            return np.inf
        best: dict[int, float] = {}
        for part in parts.values():
            earned = self._earned(tuple(part))
            if earned is None:
                return 0.0
            for target, worth in earned.items():
                best[target] = max(best.get(target, 0.0), worth)
        return sum(best.values())

    def _earned(self, part: Rows) -> dict[int, float] | None:
        if part not in self._known:
            timeline = replay(self._free, Plan.of(self._free, part), in_detail=False)
            earned = {target: image.worth for target, image in timeline.collected.items()}
            self._known[part] = earned if timeline.is_valid else None
        return self._known[part]


def _not_ruled_out(problem: Problem) -> list[int]:
    """Return the tasks that no pin rules out, judged by the referee."""
    everything = Plan.of(problem, range(len(problem.opportunities)))
    ruled_out = {
        everything.actions[position].opportunity
        for violation in breaches(problem, everything)
        for position in violation.blamed
    }
    return [row for row in range(len(problem.opportunities)) if row not in ruled_out]


def _may_follow(problem: Problem) -> set[tuple[int, int]]:
    """Return the pairs of tasks between which a satellite has time to slew, by the referee."""
    table = problem.opportunities
    pairs: set[tuple[int, int]] = set()
    for index in range(len(problem.satellites)):
        own = np.flatnonzero(table.satellite == index)
        first, second = (own[i] for i in np.triu_indices(len(own), 1))
        before, after = (
            Columns(row=rows, start_s=table.start_s[rows], end_s=table.end_s[rows])
            for rows in (first, second)
        )
        turned = np.array(turns_between(problem, index, before, after)).reshape(-1, 2)
        fits = turned[:, 1] <= after.start_s - before.end_s + 2.0 * TIME_TOLERANCE_S
        pairs.update(zip(first[fits].tolist(), second[fits].tolist(), strict=True))
    return pairs


def _chains(problem: Problem, rows: list[int], may_follow: set[tuple[int, int]]) -> list[Rows]:
    """Return all plans of these rows in which each row follows one that it may follow."""
    satellite: list[int] = problem.opportunities.satellite.tolist()
    # Each with the last task of each satellite, if there is any.
    nothing: tuple[int | None, ...] = (None,) * len(problem.satellites)
    plans: list[tuple[Rows, tuple[int | None, ...]]] = [((), nothing)]
    for row in rows:
        own = satellite[row]
        before = {None, *(first for first, second in may_follow if second == row)}
        plans += [
            ((*taken, row), (*last[:own], row, *last[own + 1 :]))
            for taken, last in plans
            if last[own] in before
        ]
    return [taken for taken, _ in plans]
