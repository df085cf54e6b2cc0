r"""An upper bound if images are worth less the later they come down: queues before contacts.

Targets have multipliers as in ``latency``, and for each satellite an exact programme knows which
contact comes next and what data waits for it (``planner_core.certified.dp.contact_queues``).
Antennas are left out. Multipliers of contacts tell which contacts may follow each other in a plan
that earns more than some level (``planner_core.certified.dp.contact_pairs``). The programme over
what remains takes seconds, not hundredths as with those multipliers, and proves a percent more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.certified.dp.contact_queues import most_by_queues
from planner_core.certified.dp.queue_terms import queues_of
from planner_core.certified.dp.resource_network import network_of
from planner_core.certified.proofs.contact_reductions import Reduction, reductions
from planner_core.certified.sizes import PROMISES
from planner_core.precedence.relation import is_transitive_on
from planner_core.problem import Bytes, Floats, Ints, Problem, SatelliteProblem
from planner_core.worth import surplus


def is_supported(satellite: SatelliteProblem) -> bool:
    """Return whether the satellite's paths never need a task that is worth nothing."""
    own = satellite.resources
    is_dear = own.sun_pointing == "free" and own.idle_drain_per_s == 0.0
    return is_dear and is_transitive_on(satellite)


def queue_value(
    problem: Problem,
    multipliers: Floats,
    per_collect: int,
    stop: Bytes | None = None,
    *,
    contact_multipliers: Floats | None = None,
    exact_contacts: Sequence[int] = (),
    level: float = -np.inf,
) -> tuple[float, Ints]:
    """Return the bound that multipliers of targets prove, and the rows of paths that reach it.

    Infinite if the programme does not support a satellite or would take too long, or ``stop`` is
    set. With multipliers of contacts, paths that earn no more than ``level`` by these are left out;
    the bound is at least ``level``.

    Parameters
    ----------
    multipliers
        Shape ``(num_targets,)``.
    per_collect
        How many levels of energy a collect takes.
    contact_multipliers
        Multipliers as for ``latency_value``. Shape ``(num_contacts,)``.
    exact_contacts
        Rows of contacts whose energy is not rounded in the satellite's favour (as with kept rows).
    """
    multiplier = surplus(multipliers, problem.best_worth)
    stop = np.zeros(1, dtype=np.uint8) if stop is None else stop
    value, paths = float(multiplier.sum()), [np.empty(0, dtype=np.int32)]
    satellites = {index: one for index, one in enumerate(problem.satellites) if len(one)}
    if not all(map(is_supported, satellites.values())):
        return np.inf, paths[0]
    exact = np.zeros(len(problem.opportunities), dtype=np.bool_)
    exact[[*exact_contacts, *problem.kept_rows.tolist()]] = True
    reduced: dict[int, Reduction] = {}
    if contact_multipliers is not None:
        reduced = reductions(
            problem, multipliers, contact_multipliers, level, per_collect, exact, stop
        )
    for index, satellite in satellites.items():
        own = reduced.get(index)
        queues = queues_of(
            problem,
            satellite,
            network_of(problem, satellite),
            multiplier,
            per_collect=per_collect,
            num_classes=PROMISES,
            earliest=own.earliest if own else None,
            fixing=own.fixing if own else None,
            exact=exact[satellite.rows],
        )
        if queues is None or stop[0]:
            return np.inf, paths[0]
        gained, path = most_by_queues(queues, stop)
        value += gained
        paths.append(satellite.rows[path])
    return max(value, level), np.concatenate(paths)
