"""Labels of paths that end with a task, kept as long as no other one is at least as good.

A label says what a path is worth, when its last task ends, and where the satellite looks then.
Labels enter in order of end. One that has ended before, is worth no less, and could have turned
since to where the new one looks reaches whatever the new one does: a slew through two angles
takes no less than one through both. Such a new label is left out. Asked for the best that a task
may follow, labels are looked at from the newest back, until none before is worth more.

Nothing is assumed of the tasks in between, so that "may follow" need not be transitive: but
where a satellite turns more slowly than it tracks, a task of no worth may still be a way to turn.

What else a path carries (a level of energy or data, the targets that it has imaged) belongs
beside the labels, by their number. A label then stands for another one only where it is at least
as good in that as well: such a caller asks ``is_as_good`` and its own question, and appends.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.jit import borrowing, kernel
from planner_core.problem import Floats, Ints
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.transitions import CLEARLY, Slews, Vector, turns_within

NO_LABEL: Final = -1

COMPARED: Final = 32
"""With how many of the newest labels one is compared before it enters. More would only keep out
a few more; fewer than half of all enter anyway."""

# One label lies in one line of the cache.
_VALUE: Final = 0
_END: Final = 1
_X: Final = 2
_Y: Final = 3
_Z: Final = 4
_TOP: Final = 5


class Skyline(NamedTuple):
    """Room for labels, in order of end.

    Attributes
    ----------
    label
        Value, end (s), line of sight (three numbers), and the greatest value up to here.
        Shape ``(n, 6)``.
    node
        The task that a label stands for. Shape ``(n,)``.
    top_at
        The label with the greatest value up to here. Shape ``(n,)``.
    """

    label: Floats
    node: Ints
    top_at: Ints


@kernel
def skyline_for(num_labels: int) -> Skyline:
    """Return room for so many labels."""
    return Skyline(
        np.empty((num_labels, 6)),
        np.empty(num_labels, dtype=np.int32),
        np.empty(num_labels, dtype=np.int32),
    )


@borrowing
def value_of(sky: Skyline, at: int) -> float:
    """Return what a label is worth; nothing for ``NO_LABEL``."""
    return sky.label[at, _VALUE] if at >= 0 else 0.0


@borrowing
def top_label(sky: Skyline, count: int) -> int:
    """Return the best of so many labels; ``NO_LABEL`` if there is none."""
    return int(sky.top_at[count - 1]) if count > 0 else NO_LABEL


@borrowing
def is_as_good(
    sky: Skyline, at: int, value: float, end_s: float, looked: Vector, slews: Slews
) -> bool:
    """Return whether whatever follows a new label may follow another one, for no less."""
    label = sky.label
    if label[at, _VALUE] < value:
        return False
    room_s = end_s - label[at, _END]
    if room_s >= slews.longest_s:
        return True
    cosine = label[at, _X] * looked[0] + label[at, _Y] * looked[1] + label[at, _Z] * looked[2]
    # Clearly, so that no rounding later on makes the other one late.
    least = slews.least_cosine[slews.first + int(room_s * slews.per_s)]
    return bool(cosine >= least + CLEARLY)


@borrowing
def append(sky: Skyline, count: int, value: float, end_s: float, looked: Vector, node: int) -> None:
    """Add a label to ``count`` others, none of which ends later."""
    label = sky.label
    label[count, _VALUE], label[count, _END] = value, end_s
    label[count, _X], label[count, _Y], label[count, _Z] = looked
    sky.node[count] = node
    if count == 0 or value > label[count - 1, _TOP]:
        label[count, _TOP], sky.top_at[count] = value, count
    else:
        label[count, _TOP], sky.top_at[count] = label[count - 1, _TOP], sky.top_at[count - 1]


@borrowing
def enter(
    sky: Skyline, count: int, value: float, end_s: float, looked: Vector, node: int, slews: Slews
) -> int:
    """Add a label to ``count`` others unless one is as good; return how many there are then.

    Labels must come in order of end.
    """
    for at in range(count - 1, max(count - 1 - COMPARED, -1), -1):
        if is_as_good(sky, at, value, end_s, looked, slews):
            return count
    append(sky, count, value, end_s, looked, node)
    return count + 1


@borrowing
def reaches(sky: Skyline, at: int, start_s: float, looks: Vector, slews: Slews) -> bool:
    """Return whether a task that starts then and looks there may follow a label's."""
    label = sky.label
    room_s = start_s - label[at, _END] - slews.settle_s + TIME_TOLERANCE_S
    return turns_within(slews, room_s, (label[at, _X], label[at, _Y], label[at, _Z]), looks)


@borrowing
def best_ahead(sky: Skyline, count: int, start_s: float, looks: Vector, slews: Slews) -> int:
    """Return the label worth most that a task may follow; ``NO_LABEL`` if none is worth anything.

    All that end in time must have entered.
    """
    label = sky.label
    best, best_at = 0.0, NO_LABEL
    always_s = start_s - slews.settle_s - slews.longest_s
    at = count - 1
    while at >= 0 and label[at, _TOP] > best:
        if label[at, _END] <= always_s:
            return int(sky.top_at[at])
        if label[at, _VALUE] > best and reaches(sky, at, start_s, looks, slews):
            best, best_at = label[at, _VALUE], at
        at -= 1
    return best_at
