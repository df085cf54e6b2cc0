"""The tasks of A(s), which simulations need again and again.

If agility alone counts, A(s) depends on the last task and on the targets imaged by then. The first
tasks that may follow each task are therefore computed once and kept.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import borrowing_inner, inlined
from planner_core.mdp.actions import is_repeated, next_action
from planner_core.mdp.track import Track
from planner_core.problem import Bytes, Floats, Ints

MOST: Final = 16
"""Tasks kept for each: more than a breadth, since some are imaged before they are needed."""

UNKNOWN: Final = -1


@bundle
class Successors(NamedTuple):
    """The first tasks that may follow each task directly, of different accesses, in time order.

    Those of task ``i`` begin at ``MOST * (i + 1)``, those of the start at 0. Shape
    ``(MOST * (m + 1),)`` unless said otherwise.

    Attributes
    ----------
    known
        How many a task has, or ``UNKNOWN`` before they are computed. Shape ``(m + 1,)``.
    discount
        Of each, from the start of the task before it.
    imaged
        1 for targets that the plan has by now; they are left out. Shape ``(num_targets,)``.
    """

    row: Ints
    discount: Floats
    known: Ints
    imaged: Bytes


def no_successors(num_rows: int, imaged: Bytes) -> Successors:
    """Return buffers for the successors of the start and of ``num_rows`` tasks, none known yet."""
    return Successors(
        row=np.empty(MOST * (num_rows + 1), dtype=np.int32),
        discount=np.empty(MOST * (num_rows + 1)),
        known=np.full(num_rows + 1, UNKNOWN, dtype=np.int32),
        imaged=imaged,
    )


@borrowing_inner
def _find(
    successors: Successors, track: Track, gamma: float, unimaged_only: bool, last: int
) -> None:
    begin = MOST * (last + 1)
    end = begin
    now_s = track.start_s[last] if last >= 0 else 0.0
    row = last
    while end < begin + MOST:
        row = next_action(
            track, last, row + 1, 0.0, 0.0, False, successors.imaged, unimaged_only, 0.0
        )
        if row == len(track.start_s):
            break
        if not is_repeated(track, successors.row, begin, end, row):
            successors.row[end] = row
            successors.discount[end] = gamma ** (track.start_s[row] - now_s)
            end += 1
    successors.known[last + 1] = end - begin


@inlined
def successors_of(
    successors: Successors, track: Track, gamma: float, unimaged_only: bool, last: int
) -> tuple[int, int]:
    """Return where the successors of a task begin and end."""
    if successors.known[last + 1] == UNKNOWN:
        _find(successors, track, gamma, unimaged_only, last)
    begin = MOST * (last + 1)
    return begin, begin + successors.known[last + 1]
