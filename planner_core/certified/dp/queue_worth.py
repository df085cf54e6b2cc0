"""What a task adds to a path whose images wait for contacts, and what the whole path must gain."""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.queue_tables import Queues, level_of, top_of
from planner_core.certified.tolerances import DOWN, LEVEL
from planner_core.jit import inlined, inner
from planner_core.problem import Floats, Ints


@inner
def know(q: Queues, k: int, layer: int, at: int, earned: Ints, needed: Floats) -> None:
    """Fill in what a task adds at a listed level after it, and what the whole path must exceed.

    A task that no path needs to take adds -1 units. Data on board takes up a part of contacts,
    which completions count in full: the path must gain that much more.
    """
    is_end, num_levels = q.number[k] == layer, q.data.num_levels
    level, promised = level_of(q, top_of(q, layer), at)
    if is_end:
        level, promised = at % num_levels, at // num_levels
    earned[at] = 0
    if q.number[k] < 0:
        down_s = _down_s(q, layer, promised, max(0.0, q.data.least[level] + q.queued[k]))
        worth = q.decaying[k] * 2.0 ** (-max(down_s - q.end_s[k], 0.0) / q.half_life_s)
        worth = min(q.on_board[k] + worth, q.most[k]) - q.multiplier[k]
        if worth > 0.0:
            earned[at] = int(np.ceil(worth / q.unit - LEVEL))
        elif not (q.takes_worthless or q.network.is_kept[k]):
            earned[at] = -1
    if len(q.fixing.weight) > 0:
        amount = max(0.0, q.data.least[level] + q.queued[k] - 2.0 * DOWN)
        needed[at] = q.fixing.least + _taken_up(q, layer, is_end, promised, amount)


@inlined
def _taken_up(q: Queues, layer: int, is_end: bool, promised: int, amount: float) -> float:
    """Return what contacts' multipliers charge for data on board that must come down in them."""
    paid = 0.0
    if not is_end and layer < len(q.contact):
        first = min(amount, q.volume[layer] - DOWN)
        paid, amount = q.fixing.charge[layer] * first, amount - first
    after = layer + promised
    if 0 < promised < q.num_classes and after < len(q.contact):
        paid += q.fixing.charge[after] * min(amount, q.volume[after] - DOWN)
    return paid


@inner
def _down_s(q: Queues, layer: int, promised: int, amount: float) -> float:
    """Return when this amount of a queue may be down; infinite for never."""
    if layer == len(q.contact):
        return np.inf
    at = int(amount / q.step)
    down_s = q.down_s[layer, at] if at < q.down_s.shape[1] else np.inf
    if down_s < np.inf:
        return down_s
    at = int(max(0.0, amount - q.volume[layer]) / q.step)
    after = layer + promised
    if 0 < promised < q.num_classes:
        is_whole = after < len(q.contact) and at < q.down_s.shape[1]
        if is_whole and q.down_s[after, at] < np.inf:
            return float(q.down_s[after, at])
    return _later_down_s(q, max(after, layer + 1), at)


@inlined
def _later_down_s(q: Queues, after: int, at: int) -> float:
    """Return when ``at`` steps may be down by a contact from ``after`` on, or by several.

    A level that a contact takes down as a whole only by rounding may need another contact too.
    """
    earliest_s, is_short = np.inf, False
    for contact in range(after, len(q.contact)):
        down_s = q.ready_s[contact]
        if not is_short:
            down_s = q.down_s[contact, at] if at < q.down_s.shape[1] else np.inf
        is_short = is_short or down_s == np.inf
        earliest_s = min(earliest_s, down_s)
    return earliest_s
