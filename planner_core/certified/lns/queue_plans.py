"""Plans with given contacts, if images are worth less the later they come down.

With fixed contacts, the programme over queues handles the stretches of tasks between two contacts
one after another, which takes a fraction of a second. It may take a target twice; then the target
is settled on one of the two tasks, until no target is taken twice. In a fleet, one satellite's day
can be replanned while the others keep theirs.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.contact_queues import most_by_queues
from planner_core.certified.dp.queue_terms import queues_of
from planner_core.certified.dp.resource_network import network_of, strict_network_of
from planner_core.certified.sizes import FEW_CONTACTS, PROMISES
from planner_core.certified.tuning import TUNING
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import taking
from planner_core.referee.replay import replay
from planner_core.solvers.sequential import blocked_rows


def plan_with_queues(
    problem: Problem, multiplier: Floats, rng: np.random.Generator, stop: Bytes, per_collect: int
) -> Plan | None:
    """Return a good plan without optional contacts; None if a programme would take too long.

    Rounding the recorder against a plan costs an image at each contact: 206.4 instead of 208, of
    209.7. So it is rounded in favour of plans first, and against them if the plan is not valid.

    Parameters
    ----------
    multiplier
        Of each target, which keeps satellites from taking it twice. Shape ``(num_targets,)``.
    per_collect
        Energy levels that the cheapest collect takes. Rounded against the plan, they cost it up to
        one collect in each orbit.
    """
    for keeps_recorder in (False, True):
        plan = _plan(problem, multiplier, rng, stop, per_collect, keeps_recorder=keeps_recorder)
        if plan is None or stop[0] or replay(problem, plan, in_detail=False).is_valid:
            break
    return plan


def replanned_day(
    problem: Problem,
    plan: Plan,
    satellite: SatelliteProblem,
    rng: np.random.Generator,
    stop: Bytes,
    per_collect: int,
) -> Plan | None:
    """Return the plan with one satellite's day replanned, the others unchanged; None if impossible.

    The programme over queues chooses its contacts among those of the plan and others whose antenna
    is free (a random sample if these are many). A quarter of the energy levels suffices. With all
    contacts and half of the levels, that takes three times as long, and two fleets earn 912.6 and
    972.0 after 40 CPU seconds instead of 931.3 and 970.1. If this programme would take too long,
    the satellite keeps its contacts.
    """
    table = problem.opportunities
    rows = np.array([action.opportunity for action in plan.actions], dtype=np.int32)
    is_own = np.isin(rows, satellite.rows)
    own, others = rows[is_own], rows[~is_own]
    is_free = np.ones(len(problem.target_ids), dtype=np.bool_)
    is_free[table.site[others[table.kind[others] == COLLECT]]] = False
    is_tried = some_contacts(satellite, len(table), rng)
    is_tried[own] = True
    levels = per_collect // TUNING.several
    contacts = _named_contacts(problem, satellite, is_free, is_tried, others, levels, stop)
    if contacts is None:
        contacts = own[table.kind[own] == CONTACT].tolist()
    part, multiplier = taking(problem, contacts), np.zeros(len(is_free))
    for keeps_recorder in (False, True):
        path = _settled(
            part,
            satellite,
            is_free,
            multiplier,
            rng,
            stop,
            per_collect,
            keeps_recorder=keeps_recorder,
        )
        if path is None:
            return None
        whole = Plan.of(problem, [*others.tolist(), *satellite.rows[path].tolist()])
        if stop[0] or replay(problem, whole, in_detail=False).is_valid:
            return whole
    return None


def some_contacts(satellite: SatelliteProblem, num_rows: int, rng: np.random.Generator) -> Bools:
    """Return a mask of a random half of a satellite's contacts, all if few. Shape ``(num_rows,)``.

    At most ``2 * FEW_CONTACTS``: with 36 stations a satellite has a thousand contacts a day, and a
    day with half of them would take 20 s.
    """
    contacts = satellite.rows[satellite.kind == CONTACT]
    number = min(len(contacts), max(len(contacts) // 2, FEW_CONTACTS), 2 * FEW_CONTACTS)
    some = np.zeros(num_rows, dtype=np.bool_)
    some[rng.choice(contacts, number, replace=False)] = True
    return some


def _named_contacts(
    problem: Problem,
    satellite: SatelliteProblem,
    is_free: Bools,
    is_tried: Bools,
    others: Ints,
    per_collect: int,
    stop: Bytes,
) -> list[int] | None:
    """Return the contacts that a satellite would take, given the others' tasks.

    None if the programme would take too long.

    Parameters
    ----------
    is_free, is_tried
        Targets that it may image, and contacts that it may take. Shapes ``(num_targets,)`` and
        ``(n,)``.
    """
    taken = others[problem.opportunities.kind[others] == CONTACT]
    is_shut = blocked_rows(problem, satellite, taken.tolist()) != 0
    is_image = satellite.kind == COLLECT
    is_contact_open = ~is_shut & is_tried[satellite.rows]
    is_open = np.where(is_image, is_free[satellite.site * is_image], is_contact_open)
    network = network_of(problem, satellite)
    rows = np.flatnonzero(is_open | network.is_kept).astype(np.int32)
    queues = queues_of(
        problem,
        satellite,
        network,
        np.zeros(len(is_free)),
        per_collect=per_collect,
        num_classes=PROMISES,
        rows=rows,
    )
    if queues is None:
        return None
    path = rows[most_by_queues(queues, stop)[1]]
    named: list[int] = satellite.rows[path[~is_image[path]]].tolist()
    return named


def _plan(
    problem: Problem,
    multiplier: Floats,
    rng: np.random.Generator,
    stop: Bytes,
    per_collect: int,
    *,
    keeps_recorder: bool,
) -> Plan | None:
    """Plan one satellite after another, each over the targets that are left."""
    is_free = np.ones(len(problem.target_ids), dtype=np.bool_)
    rows = list[int]()
    for satellite in problem.satellites:
        if len(satellite) == 0:
            continue
        path = _settled(
            problem,
            satellite,
            is_free,
            multiplier,
            rng,
            stop,
            per_collect,
            keeps_recorder=keeps_recorder,
        )
        if path is None:
            return None
        images = path[satellite.kind[path] == COLLECT]
        is_free[satellite.site[images]] = False
        rows += satellite.rows[path].tolist()
    return Plan.of(problem, rows)


def _settled(
    problem: Problem,
    satellite: SatelliteProblem,
    is_free: Bools,
    multiplier: Floats,
    rng: np.random.Generator,
    stop: Bytes,
    per_collect: int,
    *,
    keeps_recorder: bool,
) -> Ints | None:
    """Return a path of a satellite that takes each free target at most once."""
    network = strict_network_of(problem, satellite)
    is_image = satellite.kind == COLLECT
    is_open = is_image & is_free[satellite.site * is_image]
    is_open &= problem.worth[satellite.rows] > 0.0
    is_open |= network.is_kept
    while not stop[0]:
        rows = np.flatnonzero(is_open).astype(np.int32)
        queues = queues_of(
            problem,
            satellite,
            network,
            multiplier,
            per_collect=per_collect,
            num_classes=1,
            rows=rows,
            keeps_battery=True,
            keeps_recorder=keeps_recorder,
        )
        if queues is None:
            return None
        path = rows[most_by_queues(queues, stop)[1]]
        # Kept tasks stay, even two images of a target.
        images = rng.permutation(path[is_image[path] & ~network.is_kept[path]])
        _, first, counts = np.unique(satellite.site[images], return_index=True, return_counts=True)
        if counts.max(initial=1) == 1:
            return path
        # Which of the two stays matters little: hundreds of others can replace the dropped one.
        settled = images[first]
        is_open &= ~(is_image & np.isin(satellite.site, satellite.site[settled]))
        is_open[settled] = True
    return None
