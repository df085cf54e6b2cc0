"""What a state offers to the search: A(s) in the tree, and the policies of rollouts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.draws import Uint64s, draws_of, next_draw
from planner_core.jit import borrowing, inlined
from planner_core.mdp.actions import is_repeated, may_wait, next_action
from planner_core.mdp.model import WAIT, Guidance
from planner_core.mdp.track import NO_TASK, Track
from planner_core.problem import Bytes, Floats, Ints
from planner_core.solvers.mcts_successors import MOST, Successors, no_successors, successors_of
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


@bundle
class Path(NamedTuple):
    """Buffers for one simulation; shape ``(depth,)``, ``options`` of ``(breadth + 1,)``."""

    edge: Ints
    action: Ints
    image: Ints
    reward: Floats
    discount: Floats
    options: Ints


@bundle
class Step(NamedTuple):
    """What the simulations of one step read, besides the tree, and what they leave.

    Attributes
    ----------
    worth
        Of each task. Shape ``(m,)``.
    collected
        Targets that are imaged already. Shape ``(num_targets,)``.
    best, best_actions
        The greatest return so far, and the sequence that earned it. Shape ``(1,)``, ``(depth,)``.
    """

    track: Track
    rules: Rules
    guidance: Guidance
    successors: Successors
    worth: Floats
    collected: Bytes
    random: Uint64s
    path: Path
    best: Floats
    best_actions: Ints


def step_for(
    track: Track, rules: Rules, guidance: Guidance, worth: Floats, collected: Bytes, seed: int
) -> Step:
    """Return what the simulations of a plan's steps read, with buffers for them."""
    # Only without resources is A(s) given by the last task and the images taken.
    num_rows = 0 if track.use_resources else len(track.start_s)
    return Step(
        track=track,
        rules=rules,
        guidance=guidance,
        successors=no_successors(num_rows, collected.copy()),
        worth=worth,
        collected=collected,
        random=draws_of(seed),
        path=Path(
            edge=np.empty(rules.depth, dtype=np.int32),
            action=np.empty(rules.depth, dtype=np.int32),
            image=np.empty(rules.depth, dtype=np.int32),
            reward=np.empty(rules.depth),
            discount=np.empty(rules.depth),
            options=np.empty(rules.breadth + 1, dtype=np.int32),
        ),
        best=np.full(1, -np.inf),
        best_actions=np.full(rules.depth, NO_TASK, dtype=np.int32),
    )


@inlined
def _enter_tasks(
    step: Step,
    actions: Ints,
    begin: int,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
) -> int:
    """Put the tasks of A(s) into ``actions`` from ``begin`` on and return where they end."""
    track, rules, successors, collected = step.track, step.rules, step.successors, step.collected
    m = len(track.start_s)
    end = begin
    row = cursor
    if not track.use_resources and cursor == last:
        at, known = successors_of(successors, track, step.guidance.gamma, rules.unimaged_only, last)
        is_all = known - at < MOST
        while at < known and end < begin + rules.breadth:
            row = successors.row[at]
            at += 1
            if track.is_contact[row] or not rules.unimaged_only or not collected[track.site[row]]:
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
def expand(tree: Tree, step: Step, node: int) -> None:
    """Enter A(s) with N = Q = 0 (lines 5-8). Its tasks come in order of time, ``WAIT`` last."""
    track = step.track
    begin = tree.used[1]
    last, battery, recorder = tree.last[node], tree.battery[node], tree.recorder[node]
    end = _enter_tasks(step, tree.action, begin, tree.cursor[node], last, battery, recorder)
    tree.first_edge[node] = begin
    for edge in range(begin, end):
        new_edge(tree, node, tree.action[edge])
    if end == begin or not track.use_resources:
        return
    if may_wait(track, last, tree.action[begin], battery, recorder, step.rules.is_hard):
        new_edge(tree, node, WAIT)


@inlined
def random_action(
    step: Step, cursor: int, last: int, battery: float, recorder: float
) -> tuple[int, int]:
    """Return a random action of A(s) and the first task of A(s), or (m, m) at the end."""
    track, rules, actions = step.track, step.rules, step.path.options
    m = len(track.start_s)
    count = _enter_tasks(step, actions, 0, cursor, last, battery, recorder)
    if count == 0:
        return m, m
    if track.use_resources and may_wait(track, last, actions[0], battery, recorder, rules.is_hard):
        actions[count] = WAIT
        count += 1
    return actions[int(next_draw(step.random) * count)], actions[0]


@inlined
def greedy_action(
    step: Step, cursor: int, last: int, battery: float, recorder: float
) -> tuple[int, float]:
    """Return the task that the rule takes next, or m, and its discount, 0 if not known yet."""
    track, rules, successors, collected = step.track, step.rules, step.successors, step.collected
    row = cursor
    if not track.use_resources and cursor == last:
        at, end = successors_of(successors, track, step.guidance.gamma, rules.unimaged_only, last)
        is_all = end - at < MOST
        while at < end:
            row = successors.row[at]
            if track.is_contact[row] or not collected[track.site[row]]:
                return row, successors.discount[at]
            at += 1
        if is_all:
            return len(track.start_s), 0.0
    row = naive_select_action(
        track, collected, rules.is_hard, True, CONTACT_ABOVE,
        row, last, battery, recorder, False,
    )  # fmt: skip
    return row, 0.0
