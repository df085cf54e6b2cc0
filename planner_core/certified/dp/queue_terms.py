"""The data of the programme over contacts and queues for one satellite."""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.contact_layers import layers_of
from planner_core.certified.dp.data_levels import DataLevels, data_levels
from planner_core.certified.dp.energy_labels import Rounding, energy_levels
from planner_core.certified.dp.queue_tables import Fixing, Queues
from planner_core.certified.dp.resource_network import Network, part_of
from planner_core.certified.sizes import (
    MAX_QUEUE_ENTRIES,
    MAX_QUEUE_STEPS,
    MAX_QUEUE_WORK,
    MAX_UNITS,
    QUEUE_STEPS,
)
from planner_core.certified.tolerances import DOWN, DOWN_S
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, CONTACT, Bools, Floats, Ints, Problem, SatelliteProblem


def queues_of(
    problem: Problem,
    satellite: SatelliteProblem,
    network: Network,
    multiplier: Floats,
    *,
    per_collect: int,
    num_classes: int,
    data_per_collect: int | None = None,
    rows: Ints | None = None,
    earliest: Ints | None = None,
    fixing: Fixing | None = None,
    exact: Bools | None = None,
    keeps_battery: bool = False,
    keeps_recorder: bool = False,
) -> Queues | None:
    """Return the programme of a satellite; None if it would take too long.

    Parameters
    ----------
    network
        Its network, relaxed or strict as the programme is to be.
    multiplier
        Of each target. Shape ``(num_targets,)``.
    per_collect
        How many levels of energy the cheapest collect takes.
    num_classes
        Of promises.
    data_per_collect
        How many levels of data the smallest image takes; ``TUNING.coarse`` by default.
    rows
        The tasks to include, ascending; all by default.
    earliest, fixing
        Earliest direct predecessors of contacts, and what leaves paths out
        (``contact_reductions``); any and nothing by default. Shape ``(num_contacts + 1,)``.
    exact
        Tasks whose energy is not rounded, as in ``energy_levels``; by default those that must be
        taken. Shape ``(m,)``, of the tasks included.
    keeps_battery, keeps_recorder
        Whether energy, or data, is rounded so that all paths keep their limits, rather than so that
        no plan is lost.
    """
    network = network if rows is None else part_of(network, rows)
    rows = np.arange(len(satellite), dtype=np.int32) if rows is None else rows
    table_rows, is_image = satellite.rows[rows], satellite.kind[rows] == COLLECT
    contact = np.flatnonzero(satellite.kind[rows] == CONTACT).astype(np.int32)
    exact = network.is_kept.astype(np.bool_) if exact is None else exact
    rounding: Rounding = "pessimistic" if keeps_battery else "optimistic"
    energy = energy_levels(network, per_collect, rounding, exact)
    data = data_levels(network, data_per_collect or TUNING.coarse, is_optimistic=not keeps_recorder)
    number = np.full(len(rows), -1, dtype=np.int32)
    number[contact] = np.arange(len(contact))
    first = np.maximum(_must_follow(network, contact), -1 if earliest is None else earliest)
    on_board = problem.objective.collected_share * problem.worth_on_ground[table_rows]
    num_tables = _num_tables(network)
    width = data.num_levels * energy.width
    num_kept = num_classes * (num_tables + len(contact) + 1)
    num_done = _num_extensions(network, contact, first)
    if width * num_done > MAX_QUEUE_WORK or width * num_kept > MAX_QUEUE_ENTRIES:
        return None
    volume, site = satellite.volume[rows[contact]] + DOWN, satellite.site[rows]
    step = _step_of(data, volume)
    return Queues(
        network=network,
        energy=energy,
        data=data,
        fixing=fixing or _nothing_fixed(network),
        contact=contact,
        number=number,
        first=first,
        down_s=_down_s(problem, satellite, rows[contact], volume, step),
        step=step,
        ready_s=_ready_s(problem, satellite, rows[contact]) - DOWN_S,
        volume=volume,
        num_classes=num_classes,
        queued=-network.data_floor - DOWN,
        end_s=satellite.end_s[rows],
        on_board=np.where(is_image, on_board, 0.0),
        decaying=np.where(is_image, problem.worth_on_ground[table_rows] - on_board, 0.0),
        most=problem.worth[table_rows],
        multiplier=np.where(is_image, np.append(multiplier, 0.0)[site * is_image], 0.0),
        half_life_s=float(problem.objective.half_life_s or np.inf),
        unit=max(float(problem.worth[table_rows].sum()), 1e-9) / MAX_UNITS,
        num_tables=num_tables,
        takes_worthless=False,
    )


def _num_tables(network: Network) -> int:
    """Return for how many tasks tables are needed at a time."""
    num_rows = len(network.idle_from)
    ahead = (network.idle_from - np.arange(num_rows)).max(initial=0)
    return max(1, min(num_rows, int(ahead) + 1))


def _step_of(data: DataLevels, volume: Floats) -> float:
    """Return the step of data by which the times in ``Queues.down_s`` are listed."""
    level = float(data.least[1] - data.least[0]) if data.num_levels > 1 else 1.0
    return max(level / QUEUE_STEPS, float(volume.max(initial=0.0)) / MAX_QUEUE_STEPS)


def _ready_s(problem: Problem, satellite: SatelliteProblem, contacts: Ints) -> Floats:
    """Return when contacts begin to take data down. Shape ``(num_contacts,)``."""
    setup_s = problem.downlinks.stations.setup_s[satellite.site[contacts]]
    ready_s: Floats = satellite.start_s[contacts] + setup_s
    return ready_s


def _nothing_fixed(network: Network) -> Fixing:
    none = np.zeros(0)
    return Fixing(
        layers=layers_of(network),
        weight=np.zeros((0, 0)),
        charge=none,
        after_contact=np.zeros((0, 0)),
        least=-np.inf,
    )


def _must_follow(network: Network, contact: Ints) -> Ints:
    """Return for each layer the last contact before its own that paths must take; -1 for none."""
    kept = np.flatnonzero(np.append(network.is_kept[contact], False))
    position = np.searchsorted(kept, np.arange(len(contact) + 1))
    return np.append(-1, kept)[position].astype(np.int32)


def _num_extensions(network: Network, contact: Ints, first: Ints) -> float:
    """Return about how often paths are extended by a task, in all layers together."""
    m = len(network.site)
    begins = np.append(0, contact)[first + 1]
    num_tasks = int((np.append(contact, m) - begins).sum())
    return num_tasks * (2.0 + len(network.straight_rows) / max(1, m))


def _down_s(
    problem: Problem, satellite: SatelliteProblem, contacts: Ints, volume: Floats, step: float
) -> Floats:
    """Return when contacts have taken down 0, 1, 2, ... steps; see ``Queues``.

    Shape ``(num_contacts, num_steps)``.
    """
    links, access = problem.downlinks, problem.opportunities.access[satellite.rows[contacts]]
    amounts = step * np.arange(int(volume.max(initial=0.0) / step) + 2)
    found = np.full((len(contacts), len(amounts)), np.inf)
    begins_s = _ready_s(problem, satellite, contacts).tolist()
    for at, (row, ready_s) in enumerate(zip(contacts.tolist(), begins_s, strict=True)):
        fits = amounts <= volume[at]
        passing = links.passes.get(int(access[at]))
        if passing is None:
            gain = float(links.stations.gain[satellite.site[row]])
            rate_per_s = satellite.resources.downlink_per_s * gain
            found[at, fits] = ready_s + amounts[fits] / max(rate_per_s, 1e-12)
        else:
            before, whole = passing.until(np.array([ready_s, passing.time_s[-1]]))
            found[at, fits] = passing.when(np.minimum(before + amounts[fits], whole))
    found -= DOWN_S
    return found
