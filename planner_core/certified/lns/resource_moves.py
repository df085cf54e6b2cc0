"""Moves of the window search under battery and recorder, contacts among them.

A stretch of one satellite's tasks is planned anew. A target that is imaged outside of it may be on
the new path too, at next to no worth: its other image is then dropped, which leaves energy
elsewhere for nothing.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.certified.dp.resource_network import give_between
from planner_core.certified.lns.moves import Taken
from planner_core.certified.lns.resource_labels import After, Ground, Room, best_label, cost_at_end
from planner_core.certified.signs import FREE, NEVER, NOWHERE
from planner_core.certified.sizes import LABELS_PER_TASK, RESOURCE_WINDOW_NODES
from planner_core.certified.tolerances import ROUNDING, SLIGHT, STAYS
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, borrowing_inner
from planner_core.problem import Bytes

_FEWEST_TASKS, _MOST_TASKS = TUNING.window_tasks
_FOR_FREE_TARGET: Final = TUNING.aimed
_TRIALS: Final = TUNING.trials
_TIE: Final = TUNING.tie
_CONTACT: Final = TUNING.tight


@borrowing
def make_moves(
    ground: Ground, taken: Taken, room: Room, draws: Uint64s, num_moves: int, stop: Bytes
) -> None:
    """Make moves on one satellite's part of a plan, in place."""
    m = len(ground.rows)
    left_cost = ground.network.left_cost
    if left_cost > 0.0:
        # At the price itself fewer plans are worth the same, and the search is sooner stuck
        # (docs/bounds.md).
        left_cost *= 2.0 * next_draw(draws)
    for _ in range(num_moves):
        if stop[0] or m == 0:
            break
        low, high = _window(ground, taken, _pivot(ground, taken, draws), draws)
        left, right = low - 1, high
        while left >= 0 and not taken.is_taken[ground.rows[left]]:
            left -= 1
        while right < m and not taken.is_taken[ground.rows[right]]:
            right += 1
        energy, data, is_kept_to = _state_after(ground, taken, left)
        after = _after(ground, taken, right, _data_end(ground, taken, high), left_cost)
        if low >= high or not is_kept_to:
            continue
        if ground.is_polish:
            _weigh_liking(ground, taken, room, low, high, draws)
        else:
            _weigh(ground, taken, room, low, high, draws)
        last = best_label(ground, room, left, low, high, right, energy, data, after)
        if last != NOWHERE:
            saved = _cost_of(ground, taken, low, high, data, after)
            saved -= cost_at_end(after, data if last < 0 else room.data[last])
            _replace(ground, taken, room, low, high, last, saved)


@borrowing_inner
def _pivot(ground: Ground, taken: Taken, draws: Uint64s) -> int:
    """Return a task at random, mostly one of a target that is not imaged."""
    m = len(ground.rows)
    num_trials = _TRIALS if next_draw(draws) < _FOR_FREE_TARGET and not ground.is_polish else 1
    pivot = 0
    for _ in range(num_trials):
        pivot = int(next_draw(draws) * m)
        target = ground.target[pivot]
        if taken.holder[target] == FREE and ground.worth[ground.rows[pivot]] > 0.0:
            break
    return pivot


@borrowing_inner
def _window(ground: Ground, taken: Taken, pivot: int, draws: Uint64s) -> tuple[int, int]:
    """Return the tasks between two of the plan, a few apart, around the pivot."""
    num_tasks = _FEWEST_TASKS + int(next_draw(draws) * (_MOST_TASKS - _FEWEST_TASKS + 1))
    num_before = int(next_draw(draws) * (num_tasks + 1))
    lowest = max(0, pivot - RESOURCE_WINDOW_NODES // 2)
    highest = min(len(ground.rows), pivot + RESOURCE_WINDOW_NODES // 2)
    low, high = pivot, pivot
    count = 0
    while low > lowest:
        if taken.is_taken[ground.rows[low - 1]]:
            if count == num_before:
                break
            count += 1
        low -= 1
    count = 0
    while high < highest:
        if taken.is_taken[ground.rows[high]]:
            if count == num_tasks - num_before:
                break
            count += 1
        high += 1
    return low, high


@borrowing_inner
def _state_after(ground: Ground, taken: Taken, last: int) -> tuple[float, float, bool]:
    """Return energy and data after the plan's tasks up to one, and whether limits are kept."""
    network = ground.network
    energy, data = network.energy_start, network.data_start
    before = -1
    for k in range(last + 1):
        if not taken.is_taken[ground.rows[k]]:
            continue
        if data > network.data_before[k]:
            return energy, data, False
        energy += give_between(network, before, k)
        before = k
        energy = min(energy, network.energy_cap[k]) - network.energy_cost[k]
        data = max(network.data_floor[k], data + network.data_gain[k])
        if energy < network.energy_floor[k] or data > network.data_after[k]:
            return energy, data, False
    return energy, data, True


@borrowing_inner
def _data_end(ground: Ground, taken: Taken, high: int) -> float:
    """Return the most data that may be left at the end, where tasks from ``high`` on stay.

    Where the last image must come down that hangs on which one it is. In the window it may be any.
    """
    network = ground.network
    if not network.must_deliver:
        return float(network.data_end)
    last = len(ground.rows) - 1
    while last >= 0:
        is_possible = last < high or taken.is_taken[ground.rows[last]]
        if is_possible and ground.worth[ground.rows[last]] > 0.0:
            return float(min(network.data_end, network.delivered[last]))
        last -= 1
    return float(network.data_end)


@borrowing_inner
def _after(ground: Ground, taken: Taken, first: int, data_end: float, left_cost: float) -> After:
    """Return what the plan's tasks from one on want, and make of the data."""
    network = ground.network
    need, bears, floor, gain = -np.inf, data_end, -np.inf, 0.0
    k = len(ground.rows) - 1
    following = -1
    while k >= first:
        if taken.is_taken[ground.rows[k]]:
            given = give_between(network, k, following) if following >= 0 else 0.0
            need = max(need - given, network.energy_floor[k]) + network.energy_cost[k]
            following = k
            if need > network.energy_cap[k]:
                return After(np.inf, bears, floor, gain, left_cost)
            bears = min(bears, network.data_after[k])
            if network.data_floor[k] > bears:
                return After(np.inf, bears, floor, gain, left_cost)
            bears = min(network.data_before[k], bears - network.data_gain[k])
            floor = max(floor, network.data_floor[k] + gain)
            gain += network.data_gain[k]
        k -= 1
    return After(need, bears, floor, gain, left_cost)


@borrowing_inner
def _cost_of(ground: Ground, taken: Taken, low: int, high: int, data: float, after: After) -> float:
    """Return what the data costs that stays at the end with the window's tasks as they are."""
    network = ground.network
    if after.left_cost == 0.0:
        return 0.0
    for k in range(low, high):
        if taken.is_taken[ground.rows[k]]:
            data = max(network.data_floor[k], data + network.data_gain[k])
    return cost_at_end(after, data)


@borrowing_inner
def _weigh(ground: Ground, taken: Taken, room: Room, low: int, high: int, draws: Uint64s) -> None:
    """Say what each task of a window adds to a path, and which targets come up repeatedly.

    Ties are broken at random, so that the search wanders over plans of equal worth; with more
    noise over such as are worth less.
    """
    move = room.move[0] + 1
    room.move[0] = move
    with_others, noise = next_draw(draws) < 0.5, _TIE + ground.noise
    for k in range(low, high):
        at = k - low
        target = ground.target[k]
        if ground.network.is_contact[k]:
            room.gain[at] = (
                NEVER if ground.is_shut[k] else -_CONTACT * ground.typical * next_draw(draws)
            )
            continue
        if room.marked_at[target] != move:
            room.marked_at[target] = move
            room.seen[target] = 0
        room.seen[target] += 1
        held = taken.holder[target]
        is_here = held != FREE and ground.satellite[held] == ground.number
        if is_here:
            is_here = low <= ground.local[held] < high
        worth = ground.worth[ground.rows[k]]
        if held == FREE or is_here:
            room.gain[at] = worth * (1.0 + noise * next_draw(draws)) if worth > 0.0 else NEVER
        elif with_others and not ground.is_locked[target]:
            better = worth - ground.worth[held]
            room.gain[at] = better + worth * noise * next_draw(draws)
        else:
            room.gain[at] = NEVER
        if ground.network.is_kept[k]:
            room.gain[at] = max(room.gain[at], 0.0)


@borrowing_inner
def _weigh_liking(
    ground: Ground, taken: Taken, room: Room, low: int, high: int, draws: Uint64s
) -> None:
    """Say the same for a polish: worth above all, then what is liked; contacts stay as they are.

    Half of the moves leave out targets that the plan does not image: where a window could earn
    more with them, the others would find nothing that is worth the same.
    """
    move = room.move[0] + 1
    room.move[0] = move
    with_free = next_draw(draws) < 0.5
    slight = SLIGHT * ground.typical
    for k in range(low, high):
        at, row = k - low, ground.rows[k]
        target = ground.target[k]
        if ground.network.is_contact[k]:
            room.gain[at] = STAYS * ground.typical if taken.is_taken[row] else NEVER
            continue
        if room.marked_at[target] != move:
            room.marked_at[target] = move
            room.seen[target] = 0
        room.seen[target] += 1
        held = taken.holder[target]
        worth, liking = ground.worth[row], ground.liking[row]
        is_here = held != FREE and ground.satellite[held] == ground.number
        if is_here:
            is_here = low <= ground.local[held] < high
        if (held == FREE and with_free) or is_here:
            room.gain[at] = worth + slight * (1.0 + liking) if worth > 0.0 else NEVER
        elif held != FREE and not ground.is_locked[target]:
            room.gain[at] = worth - ground.worth[held] + slight * (liking - ground.liking[held])
        else:
            room.gain[at] = NEVER
        if ground.network.is_kept[k]:
            room.gain[at] = max(room.gain[at], 0.0)


@borrowing_inner
def _replace(
    ground: Ground, taken: Taken, room: Room, low: int, high: int, last: int, saved: float
) -> None:
    """Let a path take the place of what is in the window, unless the plan is worth less then.

    By no more than the noise, that is.

    Parameters
    ----------
    saved
        What less data at the end is worth.
    """
    place = ground.target
    num_new, worth = 0, saved
    liking, num_contacts = 0.0, 0
    label = last
    while label >= 0:
        k = low + label // LABELS_PER_TASK
        room.path[num_new] = k
        num_new += 1
        if not ground.network.is_contact[k]:
            held = taken.holder[place[k]]
            worth += ground.worth[ground.rows[k]]
            liking += ground.liking[ground.rows[k]]
            if held != FREE and not (
                ground.satellite[held] == ground.number and low <= ground.local[held] < high
            ):
                worth -= ground.worth[held]
                liking -= ground.liking[held]
        else:
            num_contacts += 1
        label = room.source[label]
    num_old = 0
    for k in range(low, high):
        if taken.is_taken[ground.rows[k]]:
            room.old[num_old] = k
            num_old += 1
            if not ground.network.is_contact[k]:
                worth -= ground.worth[ground.rows[k]]
                liking -= ground.liking[ground.rows[k]]
            else:
                num_contacts -= 1
    if worth < -ROUNDING - ground.noise * ground.typical:
        return
    if ground.is_polish and (worth > ROUNDING or liking <= ROUNDING or num_contacts != 0):
        return
    for i in range(num_old):
        k = room.old[i]
        taken.is_taken[ground.rows[k]] = False
        if not ground.network.is_contact[k]:
            taken.holder[place[k]] = FREE
    for i in range(num_new):
        k = room.path[i]
        if not ground.network.is_contact[k]:
            held = taken.holder[place[k]]
            if held != FREE:
                taken.is_taken[held] = False
            taken.holder[place[k]] = ground.rows[k]
        taken.is_taken[ground.rows[k]] = True
