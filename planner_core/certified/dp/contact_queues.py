"""The most that one satellite can gain under battery and recorder if images wait for contacts.

As in ``contact_layers`` there is a layer for each contact, in which that contact is the next to be
taken. Here a path also knows what its recorder holds, and so when each image is down if that
contact takes it down: once all that was recorded before it is down as well. Images that the contact
has no time for come down in another one, and a path with such images promises which of the next
contacts that is: their levels of data are listed once for each promise. Only antennas are left out,
and the rule that a target is imaged once. Energy and data are in levels, rounded in favour of the
satellite or against it.

Worth is counted in small units, so that a path can be reconstructed from its value alone.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.completions import completions_of
from planner_core.certified.dp.queue_layers import fill
from planner_core.certified.dp.queue_paths import path_to
from planner_core.certified.dp.queue_tables import Queues, Tables, num_listed_of
from planner_core.certified.signs import ANYWHERE, UNREACHED_UNITS
from planner_core.jit import kernel
from planner_core.problem import Bytes, Ints


@kernel
def most_by_queues(q: Queues, stop: Bytes) -> tuple[float, Ints]:
    """Return the most that a path gains, and the rows of such a path.

    Returns infinity once ``stop`` is set, and no rows if finding them would take too much memory.
    """
    m, num_levels, width = len(q.number), q.data.num_levels, q.energy.width
    num_contacts = len(q.contact)
    num_listed = (q.num_classes + 1) * num_levels  # of a contact that ends its layer
    for layer in range(num_contacts):
        num_listed = max(num_listed, num_listed_of(q, layer))
    states = (num_contacts, q.num_classes + 1, num_levels, width)
    tables = Tables(
        np.empty((q.num_tables, num_listed, width), dtype=np.int32),
        np.zeros((q.num_tables, num_listed, 2), dtype=np.int64),
        np.empty(m, dtype=np.int32),
        np.empty(m, dtype=np.int32),
        np.full(states, UNREACHED_UNITS, dtype=np.int32),
        completions_of(num_contacts, m if len(q.fixing.weight) > 0 else 1, width),
        np.zeros(width, dtype=np.int32),
        np.empty((0, width), dtype=np.int32),
        np.empty(m, dtype=np.int64),
    )
    if len(q.fixing.weight) > 0:
        tables.completions.best[:] = q.fixing.after_contact
    best, last, level = 0, -1, 0
    for layer in range(num_contacts + 1):
        if stop[0]:
            return np.inf, np.empty(0, dtype=np.int32)
        best, last, level = fill(q, layer, ANYWHERE, tables)
    return max(best, 0) * q.unit, path_to(q, tables, best, last, level)
