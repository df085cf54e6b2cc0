"""Contacts inserted into a plan, and images moved, so that its images are downlinked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.tuning import TUNING
from planner_core.precedence.conflicts import conflicts
from planner_core.precedence.relation import excluded_beside
from planner_core.problem import CONTACT, Ints, Problem, SatelliteProblem
from planner_core.problem.plan import Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.view import Judge, View

Accepts = Callable[[View], bool]
"""Whether a trial plan is accepted: it loses no worth, and is better."""


def brought_down(problem: Problem, plan: Plan, budget: Budget, judge: Judge | None = None) -> Plan:
    """Return the plan with more of its images downlinked if that earns more.

    Adds contacts that fit beside its tasks, and takes other images of the same targets.

    Parameters
    ----------
    judge
        Judges plans; the referee by default.
    """
    if not problem.counts_delivery:
        return plan
    view = View.of(problem, plan, judge)
    images = view.timeline.collected.values()
    old = [one for one in view.timeline.brought_down if problem.on_board[one.image].is_waiting]
    are_down = all(i.is_downlinked for i in images) and all(i.delivered_s is not None for i in old)
    is_settled = problem.objective.half_life_s is None and are_down
    if not view.timeline.is_valid or is_settled:
        return plan
    best = view.timeline.reward

    def accepts(trial: View) -> bool:
        nonlocal best
        if not trial.timeline.is_valid or trial.timeline.reward <= best:
            return False
        best = trial.timeline.reward
        return True

    return _taken_elsewhere(with_contacts(view, accepts, budget), accepts, budget).plan


def _taken_elsewhere(view: View, accepts: Accepts, budget: Budget) -> View:
    """Return the plan with the few images that never come down replaced by others, if possible.

    Searches for plans go by the most that an image can earn. If nearly all images of a fleet come
    down, this replaces the rest: with 20 satellites over 2,000 cities two were left.
    """
    images = view.timeline.collected
    stranded = [target for target, image in images.items() if image.delivered_s is None]
    if len(stranded) > TUNING.patience:
        return view
    table = view.problem.opportunities
    for target in stranded:
        own = view.plan.actions[view.timeline.collected[target].position]
        others = [action.opportunity for action in view.plan.actions if action != own]
        is_contact = table.kind[others] == CONTACT
        contacts = np.array(others, dtype=np.int32)[is_contact]
        num_tried = 0
        for row in view.problem.collects_of(target).tolist():
            is_after = table.start_s[contacts] >= table.end_s[row]
            comes_down = np.any(is_after & (table.satellite[contacts] == table.satellite[row]))
            if row == own.opportunity or not comes_down or conflicts(view.problem, row, others):
                continue
            if num_tried == TUNING.patience or budget.is_spent():
                break
            num_tried += 1
            trial = view.of_another(Plan.of(view.problem, [*others, row]))
            if accepts(trial):
                view = trial
                break
    return view


def with_contacts(view: View, accepts: Accepts, budget: Budget) -> View:
    """Return the plan with contacts that bring images down sooner, one per gap at a time."""
    while not budget.is_spent():
        trial = _settled(view, _best_of_gaps(view), budget)
        if trial is None or not accepts(trial):
            return view
        view = trial
    return view


def _settled(view: View, rows: list[int], budget: Budget) -> View | None:
    """Return the plan with as many of these contacts as break no rule; None if none is left."""
    problem = view.problem
    table = problem.opportunities
    while rows and not budget.is_spent():
        plan = Plan(tuple(sorted((*view.plan.actions, *Plan.of(problem, rows).actions))))
        trial = view.of_another(plan)
        broken = [v for v in trial.timeline.violations if v.code != "duplicate"]
        if trial.timeline.is_valid:
            return trial
        gone = set[int]()
        for violation in broken:
            own = [row for row in rows if table.satellite[row] == violation.satellite]
            before = [r for r in own if table.start_s[r] <= violation.at_s + TIME_TOLERANCE_S]
            # Drop the last one before the violation, or all if none is, so that the loop ends.
            gone |= set(sorted(before)[-1:] or own)
        rows = [row for row in rows if row not in gone] if gone else []
    return None


def _best_of_gaps(view: View) -> list[int]:
    """Return, for each gap between contacts, the contact that fits and saves most time."""
    table = view.problem.opportunities
    taken = np.array([action.opportunity for action in view.plan.actions], dtype=np.int32)
    is_contact = table.kind[taken] == CONTACT
    contacts = taken[is_contact]
    num_taken = len(contacts)
    for index, satellite in enumerate(view.problem.satellites):
        own = taken[table.satellite[taken] == index]
        gaps = list(_by_gap(view, satellite, own))
        fits = _fit_between(view.problem, satellite, [row for rows in gaps for row in rows], own)
        for rows in gaps:
            for row in rows:
                # Contacts of other satellites matter if they hold the antenna.
                if row in fits and not conflicts(view.problem, row, contacts):
                    contacts = np.append(contacts, row)
                    break
    chosen: list[int] = contacts[num_taken:].tolist()
    return chosen


def _fit_between(
    problem: Problem, satellite: SatelliteProblem, rows: Sequence[int], taken: Ints
) -> set[int]:
    """Return which of these rows a satellite has time for besides those that it has taken."""
    local = problem.local_row
    beside = np.sort(local[taken])
    excluded, _ = excluded_beside(satellite, local[np.array(rows, dtype=np.int64)], beside)
    return set(rows).difference(rows[position] for position in np.unique(excluded).tolist())


def _by_gap(view: View, satellite: SatelliteProblem, taken: Ints) -> Iterator[list[int]]:
    """Yield, for each gap between taken contacts, the others in it, those that save most first.

    A contact saves the time that waiting images would otherwise wait for the next taken one.
    """
    problem = view.problem
    table, local = problem.opportunities, problem.local_row
    contacts = taken[table.kind[taken] == CONTACT]
    free = np.flatnonzero(satellite.kind == CONTACT)
    free = free[~np.isin(free, local[contacts])]
    taken_s, free_s = np.sort(table.start_s[contacts]), satellite.start_s[free]
    images = view.image_rows[np.isin(view.image_rows, taken)]
    index = problem.satellites.index(satellite)
    on_board_s = [
        min(0.0, one.collected_s)
        for one in problem.on_board
        if one.satellite == index and one.is_waiting
    ]
    ends_s = np.sort(np.append(table.end_s[images], on_board_s))
    gap = np.searchsorted(taken_s, free_s, side="right")
    last_s, next_s = np.append(-np.inf, taken_s)[gap], np.append(taken_s, problem.horizon_s)[gap]
    num_waiting = np.searchsorted(ends_s, free_s) - np.searchsorted(ends_s, last_s)
    saved_s = num_waiting * (next_s - free_s)
    for one in np.unique(gap[num_waiting > 0]):
        within = np.flatnonzero((gap == one) & (num_waiting > 0))
        best_first = within[np.argsort(-saved_s[within], kind="stable")][: TUNING.patience]
        yield satellite.rows[free[best_first]].tolist()
