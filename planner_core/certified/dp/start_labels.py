r"""The heaviest path of one satellite with continuous starts: labels over cells of starts.

A label at a cell of a task says: some chain of tasks that ends with this one, begun at
``start_s`` or later in this cell, is worth at most ``value``, and holds at least the tasks in
``mask`` whose accesses are still open. Labels are extended by the tasks in the table of earliest
starts. Each step errs on one side only:

* A label is left out only if another one dominates it: that one is worth as much, even without
  the tasks that it alone remembers, and starts no later. Or it starts later by no more than
  m tasks can make up for, and is worth m of the heaviest tasks more: it leaves out the next m
  tasks of the other's chain and is in time again. (A task left out saves its length, during which
  lines of sight turn by no more than the greatest rate: see ``spare_s``.)
* If a cell has no room for another label, two are merged into one with the greater value, the
  earlier start and the tasks that both remember.
* A task that is remembered is passed through unpaid; one that is forgotten is paid again.

So the greatest value of all labels is never below the heaviest chain that takes no task twice.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.certified.dp.start_cells import Cells, Masks
from planner_core.certified.sizes import OPENING_LEVELS
from planner_core.certified.tolerances import EARLIER_S
from planner_core.certified.tuning import TUNING
from planner_core.jit import borrowing, borrowing_inner
from planner_core.precedence.earliest_starts import EARLY_S, cell_of
from planner_core.problem import Floats, Ints
from planner_core.problem.pointing import Vector, earliest_start_s, needed_s, sight

_NONE: Final = np.uint64(0)
_ALL: Final = np.uint64(0xFFFF_FFFF_FFFF_FFFF)
_ONE: Final = np.uint64(1)
_DE_BRUIJN: Final = np.uint64(0x03F7_9D71_B4CB_0A89)
_SHIFT: Final = np.uint64(58)
_NUMBER_OF_BIT: Final[Ints] = np.zeros(64, dtype=np.int32)
for _bit in range(64):
    _NUMBER_OF_BIT[(((1 << _bit) * int(_DE_BRUIJN)) & int(_ALL)) >> 58] = _bit
_PER_TASK_S: Final = TUNING.tidy_s


@bundle
class Labels(NamedTuple):
    """Labels of all cells, with room for ``most`` in each, of which the first ``used`` are set."""

    used: Ints
    value: Floats
    start_s: Floats
    mask: Masks
    parent: Ints
    is_paid: npt.NDArray[np.bool_]
    bit_weight: Floats


def labels_of(cells: Cells, most: int) -> Labels:
    """Return storage for labels."""
    n = len(cells.order)
    return Labels(
        used=np.zeros(n, dtype=np.int32),
        value=np.empty(n * most),
        start_s=np.empty(n * most),
        mask=np.empty(n * most, dtype=np.uint64),
        parent=np.empty(n * most, dtype=np.int32),
        is_paid=np.empty(n * most, dtype=np.bool_),
        bit_weight=np.zeros(64),
    )


@borrowing
def heaviest(
    cells: Cells, weight: Floats, labels: Labels, most: int, is_exact: bool
) -> tuple[float, int]:
    """Return a value that no chain exceeds, and the label that has it; -1 for none.

    Parameters
    ----------
    weight
        Of each task, not negative. Shape ``(n,)``.
    most
        Labels that a cell has room for.
    is_exact
        Otherwise earliest starts are estimated, which is quick but proves no bound.
    """
    spans, view, earliest = cells.spans, cells.pointing, cells.earliest
    width_s = earliest.width_s
    top, heaviest_task = 0.0, 0.0
    best = -1
    for i in range(len(weight)):
        heaviest_task = max(heaviest_task, weight[i])
    scale = heaviest_task, weight.mean() / _PER_TASK_S
    for cell in range(len(cells.order)):
        labels.used[cell] = 0
    for task in range(len(weight)):
        if cells.is_first[task]:
            _insert(
                cells, labels, most, scale, earliest.first_cell[task],
                weight[task], spans.open_s[task], cells.bit[task], -1, True,
            )  # fmt: skip
    next_open = 0
    for at in range(len(cells.order)):
        cell = cells.order[at]
        task = cells.task[cell]
        edge = spans.open_s[task] + (cell - earliest.first_cell[task]) * width_s
        # The weight of the task that each bit stands for in the cells that lie ahead.
        while next_open < len(weight) and spans.open_s[next_open] <= edge + width_s:
            if cells.bit[next_open] != _NONE:
                labels.bit_weight[_number_of(cells.bit[next_open])] = weight[next_open]
            next_open += 1
        for slot in range(cell * most, cell * most + labels.used[cell]):
            value, start_s = labels.value[slot], labels.start_s[slot]
            if value > top:
                top, best = value, slot
            end_s = start_s + spans.length_s[task]
            looked = sight(view.path, view.sites_m, spans.site[task], end_s)
            for arc in range(earliest.first_arc[cell], earliest.first_arc[cell + 1]):
                other = earliest.to[arc]
                then_s = max(edge + earliest.after_s[arc], spans.open_s[other])
                into = cell_of(earliest, spans, other, then_s)
                mask = _left_open(cells, labels.mask[slot], edge + width_s, into, other)
                bit = cells.bit[other]
                is_paid = mask & bit == _NONE
                worth = value + weight[other] if is_paid else value
                if _is_covered(cells, labels, most, heaviest_task, into, worth, then_s, mask | bit):
                    continue
                if start_s > edge:
                    guess_s = edge + earliest.after_s[arc] + earliest.slope[arc] * (start_s - edge)
                    if is_exact:
                        guess_s = _not_after_s(cells, end_s, looked, other, guess_s)
                    if guess_s > spans.close_s[other]:
                        continue
                    then_s = max(then_s, guess_s)
                    again = cell_of(earliest, spans, other, then_s)
                    if again != into:
                        into = again
                        mask = _left_open(cells, labels.mask[slot], edge + width_s, into, other)
                        is_paid = mask & bit == _NONE
                        worth = value + weight[other] if is_paid else value
                _insert(
                    cells, labels, most, scale, into,
                    worth, then_s, mask | bit, slot, is_paid,
                )  # fmt: skip
    return top, best


@borrowing_inner
def _not_after_s(cells: Cells, end_s: float, looked: Vector, task: int, guess_s: float) -> float:
    """Return a lower bound on the earliest start of a task after another one.

    It is the guess less ``EARLIER_S`` if the satellite cannot have turned by then.
    """
    spans, view = cells.spans, cells.pointing
    first_s = max(end_s + view.agile.settle_s, spans.open_s[task])
    guess_s -= EARLIER_S
    if guess_s <= first_s:
        return float(first_s)
    looks = sight(view.path, view.sites_m, spans.site[task], guess_s)
    if guess_s < end_s + needed_s(view.agile, looked, looks):
        return guess_s
    exact_s: float = earliest_start_s(
        view.agile, end_s, looked, view.path, view.sites_m,
        spans.site[task], spans.open_s[task], spans.close_s[task] + EARLY_S,
    )  # fmt: skip
    return exact_s - EARLY_S


@borrowing_inner
def _left_open(cells: Cells, mask: np.uint64, from_s: float, into: int, other: int) -> np.uint64:
    """Return what a chain still remembers at the right edge of the cell that it enters."""
    if mask == _NONE:
        return mask
    earliest = cells.earliest
    to_s = cells.spans.open_s[other] + earliest.width_s * (into - earliest.first_cell[other] + 1)
    first = int(from_s)
    last = min(int(to_s), len(cells.alive) - 1)
    mask &= cells.alive[last]
    size = last - first + 1
    if size <= 0 or mask == _NONE:
        return mask
    level, span = 0, 1
    while 2 * span <= size:
        level, span = level + 1, 2 * span
    if level >= OPENING_LEVELS:
        return _NONE
    new = cells.opened[level, first] | cells.opened[level, last - span + 1]
    left: np.uint64 = mask & (new ^ _ALL)
    return left


@borrowing_inner
def _number_of(bit: np.uint64) -> int:
    return int(_NUMBER_OF_BIT[(bit * _DE_BRUIJN) >> _SHIFT])


@borrowing_inner
def _is_as_good(
    cells: Cells,
    labels: Labels,
    heaviest_task: float,
    slack: float,
    late_s: float,
    extra: np.uint64,
) -> bool:
    """Return whether a label dominates another one.

    Parameters
    ----------
    slack, late_s
        By how much it is worth more, and starts later.
    extra
        The tasks that it remembers and the other does not.
    """
    if late_s > 0.0:
        slack -= heaviest_task * math.ceil(late_s / cells.spare_s)
    while slack >= 0.0 and extra != _NONE:
        low = extra & (~extra + _ONE)
        slack -= labels.bit_weight[_number_of(low)]
        extra ^= low
    return slack >= 0.0


@borrowing_inner
def _is_covered(
    cells: Cells,
    labels: Labels,
    most: int,
    heaviest_task: float,
    cell: int,
    value: float,
    start_s: float,
    mask: np.uint64,
) -> bool:
    for i in range(cell * most, cell * most + labels.used[cell]):
        if labels.value[i] >= value and _is_as_good(
            cells, labels, heaviest_task, labels.value[i] - value,
            labels.start_s[i] - start_s, labels.mask[i] & (mask ^ _ALL),
        ):  # fmt: skip
            return True
    return False


@borrowing_inner
def _insert(
    cells: Cells,
    labels: Labels,
    most: int,
    scale: tuple[float, float],
    cell: int,
    value: float,
    start_s: float,
    mask: np.uint64,
    parent: int,
    is_paid: bool,
) -> None:
    """Add a label to a cell, unless another one dominates it.

    ``scale`` is the worth of the heaviest task, and roughly what a second is worth.
    """
    heaviest_task, per_second = scale
    if _is_covered(cells, labels, most, heaviest_task, cell, value, start_s, mask):
        return
    base = cell * most
    kept = base
    for i in range(base, base + labels.used[cell]):
        if value >= labels.value[i] and _is_as_good(
            cells, labels, heaviest_task, value - labels.value[i],
            start_s - labels.start_s[i], mask & (labels.mask[i] ^ _ALL),
        ):  # fmt: skip
            continue
        if kept != i:
            labels.value[kept], labels.start_s[kept] = labels.value[i], labels.start_s[i]
            labels.mask[kept], labels.parent[kept] = labels.mask[i], labels.parent[i]
            labels.is_paid[kept] = labels.is_paid[i]
        kept += 1
    if kept < base + most:
        labels.value[kept], labels.start_s[kept] = value, start_s
        labels.mask[kept], labels.parent[kept] = mask, parent
        labels.is_paid[kept] = is_paid
        labels.used[cell] = kept + 1 - base
        return
    labels.used[cell] = most
    least, into = np.inf, base
    for i in range(base, kept):
        gain = abs(labels.value[i] - value)
        sooner = abs(labels.start_s[i] - start_s) * per_second
        is_better = (labels.value[i] >= value) == (labels.start_s[i] <= start_s)
        loss = 0.0 if is_better else min(gain, sooner)
        forgotten = (labels.mask[i] ^ mask) & (mask if value > labels.value[i] else labels.mask[i])
        while forgotten != _NONE:
            low = forgotten & (~forgotten + _ONE)
            loss += 0.5 * labels.bit_weight[_number_of(low)]
            forgotten ^= low
        if loss < least:
            least, into = loss, i
    labels.mask[into] &= mask
    labels.start_s[into] = min(labels.start_s[into], start_s)
    if value > labels.value[into]:
        labels.value[into], labels.parent[into] = value, parent
        labels.is_paid[into] = is_paid
