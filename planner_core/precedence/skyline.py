"""Labels of paths that end with a task, kept as long as no other one is at least as good.

A label says what a path is worth, when its last task ends, and where the satellite looks then.
Labels enter in order of end. One that has ended before, is worth no less, and could have turned
since to where the new one looks reaches whatever the new one does: a slew through two angles
takes no less than one through both. Such a new label is left out. Labels hang together from the
one worth most down, so whoever asks for the best that a task may follow takes the first that it
may; those that could make a new label needless are the ones that stand before its place.

Nothing is assumed of the tasks in between, so that "may follow" need not be transitive: but
where a satellite turns more slowly than it tracks, a task of no worth may still be a way to turn.

What else a path carries (a level of energy or data, the targets that it has imaged) belongs
beside the labels, by their number. A label then stands for another one only where it is at least
as good in that as well: such a caller asks ``is_as_good`` and its own question, and inserts.
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
    """Room for labels, in order of end.

    Attributes
    ----------
    label
        Value, end (s) and line of sight (three numbers). Shape ``(n, 5)``.
    node
        The task that a label stands for. Shape ``(n,)``.
    next
        The label worth most, and after each label the one that is worth as much or else next to
        it; ``NO_LABEL`` after the last. Shape ``(n + 1,)``.
    """

    label: Floats
    node: Ints
    next: Ints


@kernel
def skyline_for(num_labels: int) -> Skyline:
    """Return room for so many labels."""
    next_label = np.empty(num_labels + 1, dtype=np.int32)
    next_label[0] = NO_LABEL
    return Skyline(np.empty((num_labels, 5)), np.empty(num_labels, dtype=np.int32), next_label)


@borrowing_inner
def clear(sky: Skyline) -> None:
    """Forget all labels."""
    sky.next[0] = NO_LABEL


@borrowing
def value_of(sky: Skyline, at: int) -> float:
    """Return what a label is worth; nothing for ``NO_LABEL``."""
    return sky.label[at, _VALUE] if at >= 0 else 0.0


@borrowing_inner
def top_label(sky: Skyline) -> int:
    """Return the label worth most; ``NO_LABEL`` if there is none."""
    return int(sky.next[0])


@borrowing_inner
def next_label(sky: Skyline, at: int) -> int:
    """Return the label that stands after one, worth no more; ``NO_LABEL`` after the last."""
    return int(sky.next[at + 1])


@borrowing_inner
def is_as_good(sky: Skyline, at: int, end_s: float, looked: Vector, slews: Slews) -> bool:
    """Return whether whatever follows a new label may follow another one that stands before it."""
    label = sky.label
    room_s = end_s - label[at, _END]
    if room_s >= slews.longest_s:
        return True
    cosine = label[at, _X] * looked[0] + label[at, _Y] * looked[1] + label[at, _Z] * looked[2]
    # Clearly, so that no rounding later on makes the other one late.
    least = slews.least_cosine[slews.first + int(room_s * slews.per_s)]
    return bool(cosine >= least + CLEARLY)


@borrowing_inner
def insert(
    sky: Skyline, count: int, before: int, value: float, end_s: float, looked: Vector, node: int
) -> None:
    """Add a label to ``count`` others, none of which ends later, after one worth no less."""
    label = sky.label
    label[count, _VALUE], label[count, _END] = value, end_s
    label[count, _X], label[count, _Y], label[count, _Z] = looked
    sky.node[count] = node
    sky.next[count + 1], sky.next[before + 1] = sky.next[before + 1], count


@borrowing_inner
def enter(
    sky: Skyline, count: int, value: float, end_s: float, looked: Vector, node: int, slews: Slews
) -> int:
    """Add a label to ``count`` others unless one is as good; return how many there are then.

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
    """Return whether a task that starts then and looks there may follow a label's."""
    label = sky.label
    room_s = start_s - label[at, _END] - slews.settle_s + TIME_TOLERANCE_S
    return turns_within(slews, room_s, (label[at, _X], label[at, _Y], label[at, _Z]), looks)


@borrowing_inner
def best_ahead(sky: Skyline, start_s: float, looks: Vector, slews: Slews) -> int:
    """Return the label worth most that a task may follow; ``NO_LABEL`` if there is none.

    All that end in time must have entered.
    """
    at = top_label(sky)
    while at >= 0 and not reaches(sky, at, start_s, looks, slews):
        at = next_label(sky, at)
    return at
