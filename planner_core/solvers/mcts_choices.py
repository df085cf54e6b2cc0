"""What a state offers to the search: A(s) in the tree, and the policies of rollouts."""

from __future__ import annotations

from typing import NamedTuple

from planner_core.bundles import bundle
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, inlined
from planner_core.mdp.actions import is_repeated, may_wait, next_action
from planner_core.mdp.model import WAIT, Guidance
from planner_core.mdp.track import Track
from planner_core.problem import Bytes, Ints
from planner_core.solvers.mcts_successors import MOST, Successors, successors_of
from planner_core.solvers.mcts_tree import Tree, new_edge
from planner_core.solvers.walk import CONTACT_ABOVE, naive_select_action


@bundle
class Rules(NamedTuple):
    """The parameters of the search, as kernels take them."""

    depth: int
    breadth: int
    exploration: float
    is_hard: bool
    unimaged_only: bool
    is_per_decision: bool
    is_literal: bool
    is_greedy: bool
    is_max_backup: bool
    contact_above: float


@inlined
def _enter_tasks(
    track: Track,
    rules: Rules,
    guidance: Guidance,
    successors: Successors,
    collected: Bytes,
    actions: Ints,
    begin: int,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
) -> int:
    """Put the tasks of A(s) into ``actions`` from ``begin`` on and return where they end."""
    m = len(track.start_s)
    end = begin
    row = cursor
    if not track.use_resources and cursor == last:
        at, known = successors_of(successors, track, guidance.gamma, rules.unimaged_only, last)
        is_all = known - at < MOST
        while at < known and end < begin + rules.breadth:
            row = successors.row[at]
            at += 1
            if track.is_contact[row] or not rules.unimaged_only or not collected[track.place[row]]:
                actions[end] = row
                end += 1
        if is_all:
            return end
    while end < begin + rules.breadth:
        row = next_action(
            track, last, row + 1, battery, recorder, rules.is_hard, collected,
            rules.unimaged_only, rules.contact_above,
        )  # fmt: skip
        if row == m:
            break
        if not is_repeated(track, actions, begin, end, row):
            actions[end] = row
            end += 1
    return end


@borrowing
def expand(
    tree: Tree,
    track: Track,
    rules: Rules,
    guidance: Guidance,
    successors: Successors,
    collected: Bytes,
    node: int,
) -> None:
    """Lines 5-8: enter A(s) with N = Q = 0. Its first task stands first, ``WAIT`` last."""
    begin = tree.used[1]
    last, battery, recorder = tree.last[node], tree.battery[node], tree.recorder[node]
    end = _enter_tasks(
        track, rules, guidance, successors, collected, tree.action, begin,
        tree.cursor[node], last, battery, recorder,
    )  # fmt: skip
    tree.first_edge[node] = begin
    for edge in range(begin, end):
        new_edge(tree, node, tree.action[edge])
    if end == begin or not track.use_resources:
        return
    if may_wait(track, last, tree.action[begin], battery, recorder, rules.is_hard):
        new_edge(tree, node, WAIT)


@inlined
def random_action(
    track: Track,
    rules: Rules,
    guidance: Guidance,
    successors: Successors,
    collected: Bytes,
    random: Uint64s,
    actions: Ints,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
) -> tuple[int, int]:
    """Return any action of A(s) and the first task of A(s), or (m, m) at the end."""
    m = len(track.start_s)
    count = _enter_tasks(
        track, rules, guidance, successors, collected, actions, 0, cursor, last, battery, recorder
    )
    if count == 0:
        return m, m
    if track.use_resources and may_wait(track, last, actions[0], battery, recorder, rules.is_hard):
        actions[count] = WAIT
        count += 1
    return actions[int(next_draw(random) * count)], actions[0]


@inlined
def greedy_action(
    track: Track,
    rules: Rules,
    guidance: Guidance,
    successors: Successors,
    collected: Bytes,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
) -> tuple[int, float]:
    """Return what the rule takes next, or m, and its discount, 0 where that is to be worked out."""
    row = cursor
    if not track.use_resources and cursor == last:
        at, end = successors_of(successors, track, guidance.gamma, rules.unimaged_only, last)
        is_all = end - at < MOST
        while at < end:
            row = successors.row[at]
            if track.is_contact[row] or not collected[track.place[row]]:
                return row, successors.discount[at]
            at += 1
        if is_all:
            return len(track.start_s), 0.0
    row = naive_select_action(
        track, collected, rules.is_hard, True, CONTACT_ABOVE,
        row, last, battery, recorder,
    )  # fmt: skip
    return row, 0.0
