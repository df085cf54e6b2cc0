"""The best stretch of one satellite's tasks under battery and recorder, between two that stay.

Paths are those of ``dp.resource_network``. Each task keeps a few labels: value gained, energy left
and data on board. The tasks after the stretch set the least energy and the most data with which
it may end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.resource_network import Network, give_between, may_be_next
from planner_core.certified.signs import AT_START, NEVER, NOWHERE
from planner_core.certified.sizes import LABELS_PER_TASK, RESOURCE_WINDOW_NODES
from planner_core.jit import borrowing_inner, inlined
from planner_core.problem import (
    Bools,
    Floats,
    Ints,
    Longs,
)


@bundle
class SearchData(NamedTuple):
    """What moves do not change; one satellite's tasks, shape ``(m,)``, unless stated.

    Attributes
    ----------
    network
        Its paths are plans that the referee accepts, stations aside.
    rows
        Row of each task in the table of opportunities.
    local
        Task of each opportunity within its satellite. Shape ``(n,)``.
    satellite
        Of each opportunity. Shape ``(n,)``.
    number
        Index of the satellite searched.
    target
        Of each task; for contacts, one past the last target.
    worth
        Of each opportunity. Shape ``(n,)``.
    typical
        Worth of a typical target.
    is_locked
        Which targets must stay where they are imaged. Shape ``(num_targets + 1,)``.
    is_shut
        Contacts whose antenna another satellite holds.
    liking
        Secondary objective of each opportunity; used by a polish only, which leaves the worth of
        the plan and its contacts as they are. Shape ``(n,)``.
    is_polish
        Whether the search is a polish.
    noise
        Largest share of an image's worth that a move adds to it at random; a move may lose this
        share of a typical target.
    """

    network: Network
    rows: Ints
    local: Ints
    satellite: Ints
    number: int
    target: Ints
    worth: Floats
    typical: float
    is_locked: Bools
    is_shut: Bools
    liking: Floats
    is_polish: bool
    noise: float


@bundle
class Workspace(NamedTuple):
    """Working memory of a window: labels, idle labels, and lists of tasks by when these idle.

    Attributes
    ----------
    value, energy, data, source
        Of each label; ``LABELS_PER_TASK`` for each task. ``source`` is the label before.
    num_labels
        Labels of each task.
    idle_value, idle_energy, idle_data, idle_label
        Labels that every task from here on may follow.
    next_idle, first_idle
        Linked lists of tasks by the task from which on their labels idle.
    gain
        What each task of the window adds to a label's value.
    seen
        How often each target occurs in the window, as of move ``marked_at``.
        Shape ``(num_targets + 1,)``.
    path, old, dropped
        Tasks that a move takes, drops in the window, and opportunities it drops elsewhere.
    move
        Moves so far. Shape ``(1,)``.
    """

    value: Floats
    energy: Floats
    data: Floats
    source: Ints
    num_labels: Ints
    idle_value: Floats
    idle_energy: Floats
    idle_data: Floats
    idle_label: Ints
    next_idle: Ints
    first_idle: Ints
    gain: Floats
    seen: Ints
    marked_at: Longs
    path: Ints
    old: Ints
    dropped: Ints
    move: Longs


class After(NamedTuple):
    """What the tasks after a window need, and what they do to the data.

    Attributes
    ----------
    need, bears
        The least energy and the most data at the end of the window with which they are feasible.
    floor, gain
        Data at the end of the window becomes ``max(floor, data + gain)`` at the end of the plan.
    left_cost
        Cost of a recorder that is full at the end, in worth.
    """

    need: float
    bears: float
    floor: float
    gain: float
    left_cost: float


def workspace_for(num_targets: int) -> Workspace:
    """Return working memory for a problem with ``num_targets`` targets."""

    def floats(length: int) -> Floats:
        return np.zeros(length)

    def ints(length: int) -> Ints:
        return np.zeros(length, dtype=np.int32)

    return Workspace(
        value=floats(RESOURCE_WINDOW_NODES * LABELS_PER_TASK),
        energy=floats(RESOURCE_WINDOW_NODES * LABELS_PER_TASK),
        data=floats(RESOURCE_WINDOW_NODES * LABELS_PER_TASK),
        source=ints(RESOURCE_WINDOW_NODES * LABELS_PER_TASK),
        num_labels=ints(RESOURCE_WINDOW_NODES),
        idle_value=floats(LABELS_PER_TASK),
        idle_energy=floats(LABELS_PER_TASK),
        idle_data=floats(LABELS_PER_TASK),
        idle_label=ints(LABELS_PER_TASK),
        next_idle=ints(RESOURCE_WINDOW_NODES),
        first_idle=ints(RESOURCE_WINDOW_NODES + 1),
        gain=floats(RESOURCE_WINDOW_NODES),
        seen=ints(num_targets + 1),
        marked_at=np.zeros(num_targets + 1, dtype=np.int64),
        path=ints(RESOURCE_WINDOW_NODES),
        old=ints(RESOURCE_WINDOW_NODES),
        dropped=ints(RESOURCE_WINDOW_NODES),
        move=np.zeros(1, dtype=np.int64),
    )


@borrowing_inner
def best_label(
    search: SearchData, work: Workspace, left: int, low: int, high: int, right: int,
    energy: float, data: float, after: After,
) -> int:  # fmt: skip
    """Find the path that gains most between two tasks; return its last label.

    ``AT_START`` if the best path has no tasks, ``NOWHERE`` if there is no path.
    """
    network = search.network
    m, size = len(search.rows), high - low
    for at in range(size + 1):
        work.first_idle[at] = -1
    num_idle = 0
    # Labels of tasks ahead of a kept task may not be extended past it.
    earliest, starts_open = low, False
    best, best_energy, best_label = -np.inf, -np.inf, NOWHERE
    charged = give_between(network, left, right) if right < m else 0.0
    if (
        energy + charged >= after.need
        and data <= after.bears
        and (left < 0 or right >= m or may_be_next(network, left, right))
    ):
        best, best_energy, best_label = -cost_at_end(after, data), energy, AT_START
    for k in range(low, high):
        at = k - low
        if not starts_open and (left < 0 or network.idle_from[left] <= k):
            starts_open = True
            num_idle = _keep(
                work.idle_value, work.idle_energy, work.idle_data, work.idle_label, 0, num_idle,
                0.0, energy, data, AT_START,
            )  # fmt: skip
        other = work.first_idle[at]
        while other >= 0:
            if other + low >= earliest:
                for i in range(
                    other * LABELS_PER_TASK, other * LABELS_PER_TASK + work.num_labels[other]
                ):
                    num_idle = _keep(
                        work.idle_value, work.idle_energy, work.idle_data, work.idle_label, 0,
                        num_idle, work.value[i], work.energy[i], work.data[i], i,
                    )  # fmt: skip
            other = work.next_idle[other]
        work.num_labels[at] = 0
        if work.gain[at] == NEVER:
            continue
        begin = at * LABELS_PER_TASK
        count = 0
        for i in range(num_idle):
            count = _extend(
                search, work, low, k, begin, count,
                work.idle_value[i], work.idle_energy[i], work.idle_data[i], work.idle_label[i],
            )  # fmt: skip
        for arc in range(network.straight_first[k], network.straight_first[k + 1]):
            i, give = network.straight_rows[arc], network.straight_give[arc]
            if i == left and not starts_open:
                count = _extend(
                    search, work, low, k, begin, count, 0.0, energy + give, data, AT_START
                )
            elif i >= earliest:
                first = (i - low) * LABELS_PER_TASK
                for label in range(first, first + work.num_labels[i - low]):
                    count = _extend(
                        search, work, low, k, begin, count,
                        work.value[label], work.energy[label] + give, work.data[label], label,
                    )  # fmt: skip
        work.num_labels[at] = count
        if network.is_kept[k]:
            num_idle, earliest, starts_open = 0, k, True
            best, best_energy, best_label = -np.inf, -np.inf, NOWHERE
        to = network.idle_from[k] - low
        if count > 0 and to <= size:
            work.next_idle[at] = work.first_idle[to]
            work.first_idle[to] = at
        if count > 0 and (right >= m or may_be_next(network, k, right)):
            charged = give_between(network, k, right) if right < m else 0.0
            for label in range(begin, begin + count):
                if work.energy[label] + charged < after.need or work.data[label] > after.bears:
                    continue
                value = work.value[label] - cost_at_end(after, work.data[label])
                if value > best or (value == best and work.energy[label] > best_energy):
                    best, best_energy, best_label = value, work.energy[label], label
    return best_label


@inlined
def cost_at_end(after: After, data: float) -> float:
    """Return the cost of the data left at the end of the plan if the window ends with ``data``."""
    if after.left_cost == 0.0:
        return 0.0
    return after.left_cost * max(after.floor, data + after.gain, 0.0)


@inlined
def _extend(
    search: SearchData, work: Workspace, low: int, k: int, begin: int, count: int,
    value: float, energy: float, data: float, label: int,
) -> int:  # fmt: skip
    """Extend a label by a task; return how many labels the task has then.

    ``energy`` is what is left on arrival, including what the arc gives back.
    """
    network = search.network
    if data > network.data_before[k]:
        return count
    energy = min(energy, network.energy_cap[k]) - network.energy_cost[k]
    data = max(network.data_floor[k], data + network.data_gain[k])
    if energy < network.energy_floor[k] or data > network.data_after[k]:
        return count
    target = search.target[k]
    if not network.is_contact[k] and work.seen[target] > 1:
        before = label
        while before >= 0:
            if search.target[low + before // LABELS_PER_TASK] == target:
                return count
            before = work.source[before]
    return _keep(
        work.value, work.energy, work.data, work.source, begin, count,
        value + work.gain[k - low], energy, data, label,
    )  # fmt: skip


@inlined
def _keep(
    values: Floats, energies: Floats, datas: Floats, sources: Ints, begin: int, count: int,
    value: float, energy: float, data: float, source: int,
) -> int:  # fmt: skip
    """Add a label unless another dominates it; drop those it dominates, or the poorest if full."""
    end = begin + count
    at = begin
    while at < end:
        if values[at] >= value and energies[at] >= energy and datas[at] <= data:
            return count
        if values[at] <= value and energies[at] <= energy and datas[at] >= data:
            end -= 1
            values[at], energies[at] = values[end], energies[end]
            datas[at], sources[at] = datas[end], sources[end]
        else:
            at += 1
    if end - begin == LABELS_PER_TASK:
        poorest = begin
        for i in range(begin + 1, end):
            if values[i] < values[poorest]:
                poorest = i
        if values[poorest] >= value:
            return end - begin
        at = poorest
    else:
        at = end
        end += 1
    values[at], energies[at], datas[at], sources[at] = value, energy, data, source
    return end - begin
