"""The most that images can earn if the objective counts when they reach the ground."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.domain import Objective
from planner_core.problem.columns import COLLECT, CONTACT, Floats, Longs
from planner_core.problem.problem import Problem, SatelliteProblem
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.worth import share_earned

_ROUNDING_S: Final = 1e-5  # the referee forgives a recorder 1e-9 of its capacity


def with_objective(problem: Problem, objective: Objective) -> Problem:
    """Return the problem with an objective, each worth lowered to the most the image can earn.

    Parameters
    ----------
    problem
        Its images earn their whole worth when they are taken.
    """
    if not problem.use_resources or not objective.counts_delivery:
        return problem
    age_s = least_age_s(problem)
    worth = problem.worth * share_earned(objective, age_s)
    return replace(problem, objective=objective, worth=worth, full_worth=problem.worth)


def without_half_life(problem: Problem) -> Problem:
    """Return the problem with images that keep their worth however late they come down."""
    plain = replace(problem, worth=problem.worth_on_ground, full_worth=None)
    return with_objective(plain, replace(problem.objective, half_life_s=None))


def lost_on_board(problem: Problem) -> Floats:
    """Return how much of its worth each image loses if it stays on board. Shape ``(n,)``."""
    if not problem.counts_delivery:
        return np.zeros(len(problem.worth))
    on_board = problem.objective.collected_share * problem.worth_on_ground
    return np.maximum(problem.worth - on_board, 0.0)


def least_age_s(problem: Problem) -> Floats:
    """Return a lower bound on each image's age when it is on the ground, whatever else is done.

    It assumes that the first contact to be set up after it takes down nothing but this image.
    Infinite if no contact follows, and for contacts. With continuous starts it holds for every
    start in the access. Shape ``(n,)``.
    """
    table = problem.opportunities
    first_end_s, last_end_s = table.end_s, table.end_s
    if problem.continuous_starts:
        length_s = table.end_s - table.start_s
        first_end_s, last_end_s = table.access_start_s + length_s, table.access_end_s
    age_s = np.full(len(table), np.inf)
    for satellite in problem.satellites:
        own = satellite.rows[satellite.kind == COLLECT]
        down_s = _first_down_s(
            problem, satellite, first_end_s[own], table.end_s[own] - table.start_s[own]
        )
        age_s[own] = np.maximum(down_s - last_end_s[own] - _ROUNDING_S, 0.0)
    return age_s


def _first_down_s(
    problem: Problem, satellite: SatelliteProblem, end_s: Floats, length_s: Floats
) -> Floats:
    """Return when images of these ends and lengths may be down; infinite for never."""
    r, links = satellite.resources, problem.downlinks
    contacts = np.flatnonzero(satellite.kind == CONTACT)
    contacts = contacts[np.argsort(satellite.start_s[contacts], kind="stable")]
    fastest_per_s = fastest_downlink_per_s(problem, satellite, contacts)
    if fastest_per_s <= 0.0:
        return np.full(len(end_s), np.inf)
    starts_s = satellite.start_s[contacts]
    ready_s = starts_s + links.stations.setup_s[satellite.site[contacts]]
    # For each contact, the earliest end of setup among it and all later ones.
    ready_s = np.append(np.minimum.accumulate(ready_s[::-1])[::-1], np.inf)
    following = np.searchsorted(starts_s, end_s - TIME_TOLERANCE_S)
    down_s = ready_s[following] + length_s * r.collect_fill_per_s / fastest_per_s
    last_s = float(satellite.end_s[contacts].max())
    return np.where(down_s <= last_s + _ROUNDING_S, down_s, np.inf)


def fastest_downlink_per_s(problem: Problem, satellite: SatelliteProblem, contacts: Longs) -> float:
    """Return the highest rate at any instant of these contacts; 0 without any."""
    links = problem.downlinks
    access, first = np.unique(
        problem.opportunities.access[satellite.rows[contacts]], return_index=True
    )
    fastest_per_s = (
        satellite.resources.downlink_per_s * links.stations.gain[satellite.site[contacts[first]]]
    )
    which = links.which(access)
    is_known = which >= 0
    fastest_per_s[is_known] = links.fastest_per_s[which[is_known]]
    return float(fastest_per_s.max(initial=0.0))
