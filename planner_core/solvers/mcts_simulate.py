"""SIMULATE and ROLLOUT of Alg. 2, compiled."""

from __future__ import annotations

from typing import Final

from planner_core.jit import borrowing, borrowing_inner
from planner_core.mdp.actions import may_wait
from planner_core.mdp.model import (
    WAIT,
    counts_as_made,
    task_reward,
)
from planner_core.mdp.resource_columns import take
from planner_core.problem import Bytes
from planner_core.solvers.mcts_choices import (
    Step,
    expand,
    greedy_action,
    random_action,
)
from planner_core.solvers.mcts_tree import (
    ROLLED_OUT,
    UNSEEN,
    Tree,
    choose,
    has_room,
    new_edge,
    new_node,
)

ROOT: Final = 0
"""The node of the state that a step begins with."""


@borrowing_inner
def _simulate(tree: Tree, step: Step) -> None:
    """Run SIMULATE and ROLLOUT from the root; keep the best return and its actions in ``step``."""
    track, rules, guidance = step.track, step.rules, step.guidance
    worth, collected, path = step.worth, step.collected, step.path
    m = len(track.start_s)
    depth = rules.depth
    node = ROOT
    cursor, last = tree.cursor[ROOT], tree.last[ROOT]
    battery, recorder = tree.battery[ROOT], tree.recorder[ROOT]
    in_tree = 0
    d = 0
    is_rollout = False
    while d < depth:
        if not is_rollout and tree.first_edge[node] < 0:
            # The listing rolls out from a new state; the root itself is searched at once. A(s) of
            # a state is computed only when it is met again, which most never are.
            is_met = node == ROOT or tree.first_edge[node] == ROLLED_OUT
            if node != ROOT and not has_room(tree, rules.breadth):
                is_rollout = True
            elif is_met:
                expand(tree, step, node)
            else:
                tree.first_edge[node] = ROLLED_OUT
                is_rollout = True
        discount = 0.0
        if is_rollout:
            if rules.is_greedy:
                action, discount = greedy_action(step, cursor, last, battery, recorder)
                first = action
            else:
                action, first = random_action(step, cursor, last, battery, recorder)
            if action == m:
                break
        else:
            if tree.num_edges[node] == 0:
                break
            edge = choose(tree, node, rules.exploration)
            action, first = tree.action[edge], tree.action[tree.first_edge[node]]
            path.edge[d] = edge
            in_tree = d + 1
        now_s = track.start_s[cursor] if cursor >= 0 else 0.0
        path.image[d] = -1
        row = first if action == WAIT else action
        sojourn_s = track.start_s[row] - now_s
        if discount == 0.0:
            discount = guidance.gamma**sojourn_s
        if action == WAIT:
            path.reward[d] = guidance.sunpoint_reward_per_s * sojourn_s
        else:
            if track.use_resources:
                battery, recorder, _ = take(track.resources, last, row, battery, recorder)
            path.reward[d] = task_reward(
                track, guidance, worth, collected, sojourn_s, discount,
                row, battery, recorder,
            )  # fmt: skip
            last = row
            site = track.site[row]
            if (
                not track.is_contact[row]
                and not collected[site]
                and counts_as_made(track, guidance, battery, recorder)
            ):
                collected[site] = 1
                path.image[d] = site
        path.action[d] = action
        path.discount[d] = guidance.gamma if rules.is_per_decision else discount
        cursor = row
        if not is_rollout:
            if tree.child[path.edge[d]] != UNSEEN:
                node = tree.child[path.edge[d]]
            elif node == ROOT or has_room(tree, rules.breadth):
                tree.child[path.edge[d]] = new_node(tree, cursor, last, battery, recorder)
                node = tree.child[path.edge[d]]
            else:
                is_rollout = True
        d += 1
    returned = 0.0
    for i in range(d - 1, -1, -1):
        if path.image[i] >= 0:
            collected[path.image[i]] = 0
        q = path.discount[i] * returned
        if i >= in_tree or not rules.is_literal:
            q += path.reward[i]
        if i < in_tree:
            edge = path.edge[i]
            tree.visits[edge] += 1
            if rules.is_max_backup:
                if tree.visits[edge] == 1 or q > tree.value[edge]:
                    tree.value[edge] = q
            else:
                tree.value[edge] += (q - tree.value[edge]) / tree.visits[edge]
        returned = q
    if d > 0 and returned > step.best[0]:
        step.best[0] = returned
        for i in range(depth):
            step.best_actions[i] = path.action[i] if i < d else m


@borrowing
def search(tree: Tree, step: Step, num_simulations: int, stop: Bytes) -> int:
    """Run the simulations of one step and return the root's edge of greatest value."""
    for _ in range(num_simulations):
        if stop[0]:
            break
        _simulate(tree, step)
    chosen = UNSEEN
    if tree.first_edge[0] < 0:
        return chosen
    for edge in range(tree.first_edge[0], tree.first_edge[0] + tree.num_edges[0]):
        if tree.visits[edge] == 0:
            continue
        if chosen == UNSEEN or tree.value[edge] > tree.value[chosen]:
            chosen = edge
    return chosen


@borrowing
def sunpoint_instead(tree: Tree, step: Step, edge: int) -> int:
    """Return the edge of sun-pointing if the action of ``edge`` earns nothing by itself.

    Without resources A(s) has no sun-pointing; it is added here, and lets the first task pass.
    """
    track, rules, guidance = step.track, step.rules, step.guidance
    row = tree.action[edge]
    if row == WAIT:
        return edge
    last, battery, recorder = tree.last[0], tree.battery[0], tree.recorder[0]
    battery_after, recorder_after = battery, recorder
    if track.use_resources:
        battery_after, recorder_after, _ = take(track.resources, last, row, battery, recorder)
    now_s = track.start_s[tree.cursor[0]] if tree.cursor[0] >= 0 else 0.0
    reward = task_reward(
        track, guidance, step.worth, step.collected, track.start_s[row] - now_s, 1.0,
        row, battery_after, recorder_after,
    )  # fmt: skip
    end = tree.first_edge[0] + tree.num_edges[0]
    first = tree.action[tree.first_edge[0]]
    if reward > 0.0 or not may_wait(track, last, first, battery, recorder, rules.is_hard):
        return edge
    wait = end - 1
    if tree.action[wait] != WAIT:
        # It need not be next to the other edges, since only the branch below it is kept.
        wait = tree.used[1]
        new_edge(tree, 0, WAIT)
    if tree.child[wait] == UNSEEN:
        tree.child[wait] = new_node(tree, first, last, battery, recorder)
    return int(wait)
