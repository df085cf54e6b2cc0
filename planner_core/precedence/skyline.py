"""Labels of paths that end with a task, kept unless another label is at least as good.

A label holds the worth of a path, when its last task ends, and where the satellite looks then.
Labels enter in order of end. An earlier label dominates a new one if it is worth no less and the
satellite could have turned since to where the new one looks: it then reaches whatever the new one
does, for two slews take no less than one through both angles. Dominated labels are left out. The
others are linked by falling worth, so the best label that a task may follow is the first in the
list that it may follow, and only labels before its position can dominate a new label.

Nothing is assumed about the tasks in between, so "may follow" need not be transitive; but if a
satellite turns more slowly than it tracks, a task of no worth may still be a way to turn.

Whatever else a path carries (a level of energy or data, the targets that it has imaged) is stored
beside the labels, by their index. A label then dominates another only if it is at least as good in
that as well: such a caller tests ``is_as_good`` and its own condition, and inserts.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.problem import Floats, Ints
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.transitions import CLEARLY, Slews, Vector, turns_within

NO_LABEL: Final = -1

_VALUE: Final = 0
_END: Final = 1
_X: Final = 2
_Y: Final = 3
_Z: Final = 4


class Skyline(NamedTuple):
    """Storage for labels, in order of end.

    Attributes
    ----------
    label
        Value, end (s) and line of sight (three numbers). Shape ``(n, 5)``.
    node
        The task that a label stands for. Shape ``(n,)``.
    next
        First the label worth most; at ``1 + i`` the label that comes after ``i`` by falling worth;
        ``NO_LABEL`` after the last. Shape ``(n + 1,)``.
    """

    label: Floats
    node: Ints
    next: Ints


@kernel
def skyline_for(num_labels: int) -> Skyline:
    """Return storage for this many labels."""
    next_label = np.empty(num_labels + 1, dtype=np.int32)
    next_label[0] = NO_LABEL
    return Skyline(np.empty((num_labels, 5)), np.empty(num_labels, dtype=np.int32), next_label)


@borrowing_inner
def clear(sky: Skyline) -> None:
    """Forget all labels."""
    sky.next[0] = NO_LABEL


@borrowing
def value_of(sky: Skyline, at: int) -> float:
    """Return what a label is worth; 0 for ``NO_LABEL``."""
    return sky.label[at, _VALUE] if at >= 0 else 0.0


@borrowing_inner
def top_label(sky: Skyline) -> int:
    """Return the label worth most; ``NO_LABEL`` if there is none."""
    return int(sky.next[0])


@borrowing_inner
def next_label(sky: Skyline, at: int) -> int:
    """Return the label after ``at``, which is worth no more; ``NO_LABEL`` after the last."""
    return int(sky.next[at + 1])


@borrowing_inner
def is_as_good(sky: Skyline, at: int, end_s: float, looked: Vector, slews: Slews) -> bool:
    """Return whether whatever may follow a new label may follow the earlier label ``at``."""
    label = sky.label
    room_s = end_s - label[at, _END]
    if room_s >= slews.longest_s:
        return True
    cosine = label[at, _X] * looked[0] + label[at, _Y] * looked[1] + label[at, _Z] * looked[2]
    # With a margin, so that no later rounding makes label ``at`` late.
    least = slews.least_cosine[slews.first + int(room_s * slews.per_s)]
    return bool(cosine >= least + CLEARLY)


@borrowing_inner
def insert(
    sky: Skyline, count: int, before: int, value: float, end_s: float, looked: Vector, node: int
) -> None:
    """Link a label after ``before``, worth no less, with ``count`` labels that end no later."""
    label = sky.label
    label[count, _VALUE], label[count, _END] = value, end_s
    label[count, _X], label[count, _Y], label[count, _Z] = looked
    sky.node[count] = node
    sky.next[count + 1], sky.next[before + 1] = sky.next[before + 1], count


@borrowing_inner
def enter(
    sky: Skyline, count: int, value: float, end_s: float, looked: Vector, node: int, slews: Slews
) -> int:
    """Add a label to ``count`` others unless one is as good; return the new count.

    Labels must come in order of end.
    """
    before, at = NO_LABEL, top_label(sky)
    while at >= 0 and value_of(sky, at) >= value:
        if is_as_good(sky, at, end_s, looked, slews):
            return count
        before, at = at, next_label(sky, at)
    insert(sky, count, before, value, end_s, looked, node)
    return count + 1


@borrowing_inner
def reaches(sky: Skyline, at: int, start_s: float, looks: Vector, slews: Slews) -> bool:
    """Return whether a task with this start and line of sight may follow label ``at``."""
    label = sky.label
    room_s = start_s - label[at, _END] - slews.settle_s + TIME_TOLERANCE_S
    return turns_within(slews, room_s, (label[at, _X], label[at, _Y], label[at, _Z]), looks)


@borrowing_inner
def best_ahead(sky: Skyline, start_s: float, looks: Vector, slews: Slews) -> int:
    """Return the label worth most that a task may follow; ``NO_LABEL`` if there is none.

    All labels that end in time must have entered.
    """
    at = top_label(sky)
    while at >= 0 and not reaches(sky, at, start_s, looks, slews):
        at = next_label(sky, at)
    return at
