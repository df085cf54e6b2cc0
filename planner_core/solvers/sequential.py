"""How the paper's single-satellite methods plan several satellites: one after another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner_core.budget import Budget, Progress, Termination
from planner_core.mdp.track import Track, compile_track
from planner_core.problem import (
    CONTACT,
    Bytes,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Solution
from planner_core.solvers.walk import CONTACT_ABOVE, rule_plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Subproblem:
    """One satellite's turn: its arrays, and what the satellites before it have taken.

    Attributes
    ----------
    collected
        1 for each target that is taken. Shape ``(num_targets,)``; each turn works on a copy.
    report
        To be called with the fraction of this turn that is done and the reward gathered in it.
    """

    satellite: SatelliteProblem
    track: Track
    collected: Bytes
    report: Callable[[float, float], None]


PlanSubproblem = Callable[[Subproblem], list[int]]
"""Returns the rows (of the track) that the satellite takes, in order."""


def plan_in_turn(problem: Problem, budget: Budget, plan_one: PlanSubproblem) -> Solution:
    """Let each satellite plan over the targets that remain and the antennas still free.

    Once the budget is spent, the rule plans what is left of the horizon and of the satellites.
    """
    table = problem.opportunities
    collected = np.zeros(len(problem.target_ids), dtype=np.uint8)
    taken: list[int] = []
    for step, index in enumerate(_order(problem)):
        satellite = problem.satellites[index]
        reward_before = problem.worth_of(np.array(taken, dtype=np.int64))

        def report(
            fraction: float, reward: float, step: int = step, so_far: float = reward_before
        ) -> None:
            budget.report(
                Progress(
                    phase="solve",
                    fraction=(step + fraction) / len(problem.satellites),
                    reward=so_far + reward,
                )
            )

        blocked = blocked_rows(problem, satellite, taken) | _is_wasted(problem, satellite)
        track = compile_track(problem, satellite, blocked)
        subproblem = Subproblem(
            satellite=satellite, track=track, collected=collected.copy(), report=report
        )
        rows = [] if budget.is_spent() else plan_one(subproblem)
        if budget.is_spent():
            rows = rows + _rest_by_rule(track, collected.copy(), rows)
        chosen = satellite.rows[np.asarray(rows, dtype=np.int64)]
        taken.extend(int(row) for row in chosen)
        images = chosen[table.kind[chosen] != CONTACT]
        collected[table.site[images]] = 1
    termination = budget.termination() if budget.is_spent() else Termination.HORIZON_COMPLETE
    return Solution(plan=Plan.of(problem, taken), termination=termination)


def _order(problem: Problem) -> list[int]:
    """Return the satellites in turn, first those that must take something and so need contacts."""
    is_bound = [bool(len(problem.kept_local(s))) for s in problem.satellites]
    return sorted(range(len(is_bound)), key=lambda index: not is_bound[index])


def _rest_by_rule(track: Track, collected: Bytes, taken: list[int]) -> list[int]:
    """Return what the rule adds to a search cut short, so that the horizon's rest is not empty."""
    rows = np.array(taken, dtype=np.int32)
    return [int(row) for row in rule_plan(track, collected, True, True, CONTACT_ABOVE, rows, False)]


def _is_wasted(problem: Problem, satellite: SatelliteProblem) -> Bytes:
    """Return 1 for each collect that earns nothing while another one of its target earns something.

    A planner that takes tasks as they come would have the target imaged for nothing.
    """
    is_image = satellite.kind != CONTACT
    wasted = np.zeros(len(satellite), dtype=np.uint8)
    wasted[is_image] = problem.best_worth[satellite.site[is_image]] > 0.0
    wasted[problem.worth[satellite.rows] > 0.0] = 0
    wasted[problem.kept_local(satellite)] = 0
    return wasted


def blocked_rows(problem: Problem, satellite: SatelliteProblem, taken: list[int]) -> Bytes:
    """Return 1 for each contact of ``satellite`` whose station is busy with others' contacts.

    Those are contacts in ``taken``, and what the other satellites must take.
    """
    blocked = np.zeros(len(satellite), dtype=np.uint8)
    table = problem.opportunities
    elsewhere = set(problem.kept_rows.tolist())
    if elsewhere:
        elsewhere -= set(satellite.rows.tolist())
    booked: Ints = np.array(list(elsewhere.union(taken)), dtype=np.int32)
    booked = booked[table.kind[booked] == CONTACT]
    if len(booked) == 0:
        return blocked
    for station in np.unique(table.site[booked]):
        there = booked[table.site[booked] == station]
        own = np.flatnonzero((satellite.kind == CONTACT) & (satellite.site == station))
        # Contacts that begin before this one ends, less those that end before it starts.
        num_busy = np.searchsorted(np.sort(table.start_s[there]), satellite.end_s[own])
        num_busy -= np.searchsorted(
            np.sort(table.end_s[there]), satellite.start_s[own], side="right"
        )
        blocked[own] = num_busy >= problem.station_antennas[station]
    blocked[problem.kept_local(satellite)] = 0
    return blocked
