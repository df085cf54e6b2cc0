"""The most that one satellite gains under battery and recorder where images wait for contacts.

As in ``contact_layers`` there is a layer for each contact, in which that one is the next to be
taken. Here a path also knows what its recorder holds. That says when each image is down if that
contact brings it down: once all that was recorded before it is down as well. What the contact has
no time for comes down in another, and a path with such images promises which one of the next that
is: their levels of data are listed once for each promise. So nothing is left out but antennas, and
that a target may be imaged twice; energy and data are in levels, rounded in favour of the
satellite or against it.

Worth is counted in small units, so that a path is found again from its value alone.
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
    """Return the most that a path gains, and the rows of one that does.

    Answers infinity once ``stop`` is set, and no rows where these would take too much room.
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
