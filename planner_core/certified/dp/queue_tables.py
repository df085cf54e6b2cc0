"""Tables of the programme over contacts and queues, and the index of each level in them."""

from __future__ import annotations

from typing import NamedTuple

from planner_core.bundles import bundle
from planner_core.certified.dp.completions import Completions
from planner_core.certified.dp.contact_layers import Layers
from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.energy_labels import EnergyLevels
from planner_core.certified.dp.resource_network import Network
from planner_core.jit import inlined, inner
from planner_core.problem import Floats, Ints, Longs


@bundle
class Fixing(NamedTuple):
    """A relaxation with small tables, by which paths that earn too little are recognized.

    Attributes
    ----------
    layers, weight
        Those of ``contact_layers``, each contact with a layer of its own, and what tasks are worth
        in them. The latter has shape ``(num_contacts + 1, m)``; ``(0, 0)`` if nothing is fixed.
    charge
        The multiplier of each contact, by volume. Shape ``(num_contacts,)``.
    after_contact
        The most that may be gained after each contact, by energy. Shape ``(num_contacts, width)``.
    least
        A path must gain more than this.
    """

    layers: Layers
    weight: Floats
    charge: Floats
    after_contact: Floats
    least: float


@bundle
class Queues(NamedTuple):
    """One satellite's tasks, contacts and images; shape ``(m,)`` unless said otherwise.

    Attributes
    ----------
    contact
        The tasks that are contacts, ascending. Shape ``(num_contacts,)``.
    number
        Index of each task in ``contact``; -1 for others.
    first
        For each layer, the earliest contact from which a path may continue in it; -1 for the
        start. Shape ``(num_contacts + 1,)``.
    down_s
        When each contact has taken down 0, 1, 2, ... steps of what was recorded; infinite for what
        it has no time for. Shape ``(num_contacts, num_steps)``.
    step
        Of ``down_s``, in recorder capacities.
    ready_s
        When each contact begins to take data down. Shape ``(num_contacts,)``.
    volume
        How much each contact takes down, in recorder capacities. Shape ``(num_contacts,)``.
    num_classes
        Of promises: the next contact after a layer's own, the one after that, ..., any later one.
    queued
        What is on board when each task has ended, less the data that its level stands for.
    end_s, on_board, decaying, most
        When each task ends, what it earns on board, how much more if it is down at once, and the
        most that it earns.
    multiplier
        Of each image's target; 0 for contacts.
    unit
        In which worth is counted.
    num_tables
        How many tasks' tables are kept at a time: all later tasks may follow a task by idling.
    takes_worthless
        Whether a path may need tasks that are worth nothing.
    """

    network: Network
    energy: EnergyLevels
    data: DataLevels
    fixing: Fixing
    contact: Ints
    number: Ints
    first: Ints
    down_s: Floats
    step: float
    ready_s: Floats
    volume: Floats
    num_classes: int
    queued: Floats
    end_s: Floats
    on_board: Floats
    decaying: Floats
    most: Floats
    multiplier: Floats
    half_life_s: float
    unit: float
    num_tables: int
    takes_worthless: bool


class Tables(NamedTuple):
    """The most units of a path that ends with a task, at each level of data and energy.

    A layer lists the levels of data that its contact takes down as a whole, and then all higher
    ones for each class of promises (see ``level_of``). An entry stands for at least a certain
    energy, counted from the task's ``lowest``; entries below 0 are not reached.

    Attributes
    ----------
    own
        Of tasks, each until all may follow it by idling. Shape
        ``(num_tables, most_listed, width)``.
    span
        Which entries of a row are told apart, from the first up to the second number: all before
        have the units of the first of them, all from the second on are not reached. The second is 0
        in a row without entries. Shape ``(num_tables, most_listed, 2)``.
    low, high
        The first and the last listed level reached, by task. Shape ``(m,)``.
    at_contact
        Of contacts, when they end their layers, by what was promised, 0 for nothing. Shape
        ``(num_contacts, num_classes + 1, num_levels, width)``.
    completions
        Of the current layer, by the relaxation.
    further
        Units of the completions of a task, rounded up; 0 if no paths are left out. Shape
        ``(width,)``.
    kept, kept_at
        Tables of a stretch, kept to trace a path back: listed levels from ``low`` up to ``high``,
        and where those of each task begin. Shapes ``(num_kept, width)`` and ``(m,)``.
    """

    own: Ints
    span: Longs
    low: Ints
    high: Ints
    at_contact: Ints
    completions: Completions
    further: Ints
    kept: Ints
    kept_at: Longs


class Idle(NamedTuple):
    """The most units of an idle path, in the form in which ``Tables`` hold those of a task.

    Attributes
    ----------
    units
        By energy counted from ``base``. Shape ``(num_listed, width)``.
    span
        Shape ``(num_listed, 2)``.
    reached
        The first and the last row with a path.
    """

    units: Ints
    span: Longs
    reached: Longs
    base: int


@inlined
def top_of(q: Queues, layer: int) -> int:
    """Return how many levels of data the contact of a layer takes down as a whole."""
    if layer == len(q.contact):
        return int(q.data.num_levels)
    k = q.contact[layer]
    return int(min(max(q.data.floor[k] - q.data.gain[k] + 1, 0), q.data.num_levels))


@inlined
def num_listed_of(q: Queues, layer: int) -> int:
    """Return how many levels of data are listed in a layer."""
    top = top_of(q, layer)
    return int(top + q.num_classes * (q.data.num_levels - top))


@inlined
def level_of(q: Queues, top: int, listed: int) -> tuple[int, int]:
    """Return the level of data at a listed index, and the class of promises; 0 for none."""
    if listed < top:
        return listed, 0
    promised = 1
    while listed >= q.data.num_levels:
        listed, promised = listed - (q.data.num_levels - top), promised + 1
    return listed, promised


@inlined
def index_of(q: Queues, top: int, level: int, promised: int) -> int:
    """Return the index at which a level of data is listed with a promise."""
    if level < top:
        return level
    return int(level + (promised - 1) * (q.data.num_levels - top))


@inlined
def level_after(data: DataLevels, k: int, level: int) -> int:
    """Return the level of data after a task."""
    return int(max(data.floor[k], level + data.gain[k], 0))


@inner
def stretch_of(q: Queues, layer: int, source: int) -> tuple[int, int]:
    """Return the range of tasks of a layer that paths from a contact, or from any, may take."""
    end = q.contact[layer] + 1 if layer < len(q.contact) else len(q.number)
    begin = q.contact[q.first[layer]] if q.first[layer] >= 0 else 0
    return (q.contact[source] if source >= 0 else begin), end
