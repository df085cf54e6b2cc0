"""Monte Carlo tree search (Alg. 2): sample futures, and go where they turn out well.

States reached along different paths almost never coincide, because the images taken are part
of the state. The hash table of the listing is therefore a tree, kept in flat arrays; after
each step the branch that was taken is kept and its estimates live on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal, NamedTuple

import numpy as np

from planner_core.draws import Uint64s, draws_of, next_draw
from planner_core.jit import borrowing, kernel
from planner_core.model import (
    NO_TASK,
    WAIT,
    Guidance,
    Track,
    may_wait,
    next_action,
    take,
    task_reward,
)
from planner_core.problem import Bytes, Floats, Ints, Problem
from planner_core.solvers.base import Budget, Constraint, Feasibility, Solution
from planner_core.solvers.sequential import Turn, plan_in_turn
from planner_core.solvers.walk import CONTACT_ABOVE, naive_select_action

_UNSEEN: Final = -1


class Tree(NamedTuple):
    """States and actions of the search, both numbered in order of appearance.

    A node's actions stand side by side from ``first_edge[node]``; ``child`` of an edge is the
    node it leads to, or -1. Shape ``(num_nodes,)`` and ``(num_edges,)``; ``used`` counts both.
    """

    cursor: Ints
    last: Ints
    battery: Floats
    recorder: Floats
    first_edge: Ints
    num_edges: Ints
    action: Ints
    child: Ints
    visits: Ints
    value: Floats
    used: Ints


class Path(NamedTuple):
    """Room for one simulation; shape ``(depth,)``, ``options`` of ``(breadth + 1,)``."""

    edge: Ints
    action: Ints
    image: Ints
    reward: Floats
    discount: Floats
    options: Ints


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


@borrowing
def _new_node(tree: Tree, cursor: int, last: int, battery: float, recorder: float) -> int:
    node = int(tree.used[0])
    tree.used[0] += 1
    tree.cursor[node] = cursor
    tree.last[node] = last
    tree.battery[node] = battery
    tree.recorder[node] = recorder
    tree.first_edge[node] = _UNSEEN
    tree.num_edges[node] = 0
    return node


@borrowing
def _expand(tree: Tree, track: Track, rules: Rules, collected: Bytes, node: int) -> None:
    """Lines 5-8: enter A(s) with N = Q = 0. Its first task stands first, ``WAIT`` last."""
    m = len(track.start_s)
    tree.first_edge[node] = tree.used[1]
    row = tree.cursor[node]
    for _ in range(rules.breadth):
        row = next_action(
            track, tree.last[node], row + 1, tree.battery[node], tree.recorder[node],
            rules.is_hard, collected, rules.unimaged_only,
        )  # fmt: skip
        if row == m:
            break
        _new_edge(tree, node, row)
    if tree.num_edges[node] == 0 or not track.use_resources:
        return
    first = tree.action[tree.first_edge[node]]
    if may_wait(
        track, tree.last[node], first, tree.battery[node], tree.recorder[node], rules.is_hard
    ):
        _new_edge(tree, node, WAIT)


@borrowing
def _new_edge(tree: Tree, node: int, action: int) -> None:
    edge = tree.used[1]
    tree.used[1] += 1
    tree.num_edges[node] += 1
    tree.action[edge] = action
    tree.child[edge] = _UNSEEN
    tree.visits[edge] = 0
    tree.value[edge] = 0.0


@borrowing
def _choose(tree: Tree, node: int, exploration: float) -> int:
    """Line 11: the edge of greatest upper confidence; one that was never tried comes first."""
    first = int(tree.first_edge[node])
    total = 0
    for edge in range(first, first + tree.num_edges[node]):
        if tree.visits[edge] == 0:
            return edge
        total += tree.visits[edge]
    best, best_value = first, -np.inf
    log_total = np.log(total)
    for edge in range(first, first + tree.num_edges[node]):
        bound = tree.value[edge] + exploration * np.sqrt(log_total / tree.visits[edge])
        if bound > best_value:
            best, best_value = edge, bound
    return best


@borrowing
def _rollout_action(
    track: Track,
    rules: Rules,
    collected: Bytes,
    random: Uint64s,
    actions: Ints,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
) -> tuple[int, int]:
    """Return an action of the rollout policy and the first task of A(s), or (m, m) at the end."""
    m = len(track.start_s)
    if rules.is_greedy:
        row = naive_select_action(
            track, collected, rules.is_hard, True, CONTACT_ABOVE,
            cursor, last, battery, recorder,
        )  # fmt: skip
        return row, row
    count = 0
    row = cursor
    for _ in range(rules.breadth):
        row = next_action(
            track, last, row + 1, battery, recorder, rules.is_hard, collected, rules.unimaged_only
        )
        if row == m:
            break
        actions[count] = row
        count += 1
    if count == 0:
        return m, m
    if track.use_resources and may_wait(track, last, actions[0], battery, recorder, rules.is_hard):
        actions[count] = WAIT
        count += 1
    return actions[int(next_draw(random) * count)], actions[0]


@borrowing
def _simulate(
    tree: Tree,
    track: Track,
    rules: Rules,
    guidance: Guidance,
    target_reward: Floats,
    collected: Bytes,
    random: Uint64s,
    path: Path,
    root: int,
    best: Floats,
    best_actions: Ints,
) -> None:
    """SIMULATE and ROLLOUT from ``root``; keeps the sequence of greatest return in ``best``."""
    m = len(track.start_s)
    depth = rules.depth
    node = root
    cursor, last = tree.cursor[root], tree.last[root]
    battery, recorder = tree.battery[root], tree.recorder[root]
    in_tree = 0
    d = 0
    is_rollout = False
    while d < depth:
        if not is_rollout and tree.first_edge[node] == _UNSEEN:
            _expand(tree, track, rules, collected, node)
            # The listing rolls out from a new state; the root itself is searched at once.
            is_rollout = node != root
        if is_rollout:
            action, first = _rollout_action(
                track, rules, collected, random, path.options, cursor, last, battery, recorder
            )
            if action == m:
                break
        else:
            if tree.num_edges[node] == 0:
                break
            edge = _choose(tree, node, rules.exploration)
            action, first = tree.action[edge], tree.action[tree.first_edge[node]]
            path.edge[d] = edge
            in_tree = d + 1
        now_s = track.start_s[cursor] if cursor >= 0 else 0.0
        path.image[d] = -1
        row = first if action == WAIT else action
        sojourn_s = track.start_s[row] - now_s
        discount = guidance.gamma**sojourn_s
        if action == WAIT:
            path.reward[d] = guidance.sunpoint_reward_per_s * sojourn_s
        else:
            if track.use_resources:
                battery, recorder, _ = take(track, last, row, battery, recorder)
            path.reward[d] = task_reward(
                track, guidance, target_reward, collected, discount, row, battery, recorder
            )
            last = row
            place = track.place[row]
            if not track.is_contact[row] and not collected[place]:
                collected[place] = 1
                path.image[d] = place
        path.action[d] = action
        path.discount[d] = guidance.gamma if rules.is_per_decision else discount
        cursor = row
        if not is_rollout:
            if tree.child[path.edge[d]] == _UNSEEN:
                tree.child[path.edge[d]] = _new_node(tree, cursor, last, battery, recorder)
            node = tree.child[path.edge[d]]
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
    if d > 0 and returned > best[0]:
        best[0] = returned
        for i in range(depth):
            best_actions[i] = path.action[i] if i < d else m


@borrowing
def _search(
    tree: Tree,
    track: Track,
    rules: Rules,
    guidance: Guidance,
    target_reward: Floats,
    collected: Bytes,
    random: Uint64s,
    path: Path,
    num_simulations: int,
    stop: Bytes,
    best: Floats,
    best_actions: Ints,
) -> int:
    """Run the simulations of one step from node 0 and return the edge of greatest value."""
    for _ in range(num_simulations):
        if stop[0]:
            break
        _simulate(
            tree,
            track,
            rules,
            guidance,
            target_reward,
            collected,
            random,
            path,
            0,
            best,
            best_actions,
        )
    chosen = _UNSEEN
    if tree.first_edge[0] == _UNSEEN:
        return chosen
    for edge in range(tree.first_edge[0], tree.first_edge[0] + tree.num_edges[0]):
        if tree.visits[edge] == 0:
            continue
        if chosen == _UNSEEN or tree.value[edge] > tree.value[chosen]:
            chosen = edge
    return chosen


@kernel
def _copy_branch(old: Tree, new: Tree, root: int) -> None:
    """Make ``root`` of ``old`` node 0 of ``new``, with all that hangs below it."""
    new.used[0] = 0
    new.used[1] = 0
    waiting = np.empty(old.used[0] + 1, dtype=np.int32)
    waiting[0] = root
    _new_node(new, old.cursor[root], old.last[root], old.battery[root], old.recorder[root])
    done = 0
    while done < new.used[0]:
        source = waiting[done]
        new.first_edge[done] = _UNSEEN if old.first_edge[source] == _UNSEEN else new.used[1]
        first = old.first_edge[source]
        for edge in range(first, first + old.num_edges[source]):
            to = new.used[1]
            _new_edge(new, done, old.action[edge])
            new.visits[to] = old.visits[edge]
            new.value[to] = old.value[edge]
            child = old.child[edge]
            if child != _UNSEEN:
                waiting[new.used[0]] = child
                new.child[to] = _new_node(
                    new, old.cursor[child], old.last[child], old.battery[child],
                    old.recorder[child],
                )  # fmt: skip
        done += 1


def _empty_tree(num_nodes: int, num_edges: int) -> Tree:
    nodes = [np.empty(num_nodes, dtype=np.int32) for _ in range(4)]
    edges = [np.empty(num_edges, dtype=np.int32) for _ in range(3)]
    return Tree(
        cursor=nodes[0],
        last=nodes[1],
        battery=np.empty(num_nodes),
        recorder=np.empty(num_nodes),
        first_edge=nodes[2],
        num_edges=nodes[3],
        action=edges[0],
        child=edges[1],
        visits=edges[2],
        value=np.empty(num_edges),
        used=np.zeros(2, dtype=np.int32),
    )


def _described(text: str, **limits: float) -> dict[str, object]:
    return {**limits, "description": text}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mcts:
    """Sample sequences of actions from each state, steered by upper confidence bounds."""

    name: ClassVar[str] = "mcts"
    title: ClassVar[str] = "SMDP Monte Carlo tree search"
    paper: ClassVar[str] = "Algorithm 2, section Solution Methods"
    exact: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    num_simulations: int = field(
        default=200,
        metadata=_described("Simulations per step (N_sim max).", minimum=1, maximum=1_000_000),
    )
    depth: int = field(
        default=20,
        metadata=_described("Actions of a simulation (d_solve).", minimum=1, maximum=1000),
    )
    exploration: float = field(
        default=10.0, metadata=_described("Weight c of the upper confidence bound.", minimum=0)
    )
    breadth: int = field(
        default=3,
        metadata=_described("Tasks in A(s), the first in time (N_a max).", minimum=1, maximum=1000),
    )
    gamma: float = field(
        default=0.9999,
        metadata=_described("Discount, see discount.", exclusiveMinimum=0, maximum=1),
    )
    discount: Literal["per_second", "per_decision"] = field(
        default="per_second",
        metadata=_described(
            "per_second: gamma to the elapsed time (the paper); "
            "per_decision: gamma at each action (the authors' code)."
        ),
    )
    returns: Literal["with_reward", "literal"] = field(
        default="with_reward",
        metadata=_described(
            "with_reward: an action's own reward is part of its value; "
            "literal: line 14 of the listing, which leaves it out."
        ),
    )
    backup: Literal["mean", "max"] = field(
        default="mean",
        metadata=_described("Value of an action: the mean of its samples (the paper) or the best."),
    )
    rollout: Literal["random", "greedy"] = field(
        default="greedy",
        metadata=_described("random: any of A(s) (the paper); greedy: what the rule would take."),
    )
    keep_incumbent: bool = field(
        default=True,
        metadata=_described("Follow the best sequence sampled so far; the paper does not."),
    )
    unimaged_only: bool = field(
        default=True,
        metadata=_described(
            "Leave targets that are already imaged out of A(s); the paper keeps them in."
        ),
    )
    feasibility: Feasibility = field(
        default="hard",
        metadata=_described(
            "hard: only actions that keep every limit; "
            "penalty: the paper's soft form, where a broken limit costs reward (Table 2)."
        ),
    )
    contact_reward_per_s: float = field(
        default=1e-3,
        metadata=_described("Guidance per second of contact (Table 2: 0.1).", minimum=0),
    )
    sunpoint_reward_per_s: float = field(
        default=1e-4,
        metadata=_described("Guidance per second of sun-pointing (Table 2).", minimum=0),
    )
    penalty: float = field(
        default=1e4,
        metadata=_described("Guidance lost for each broken limit (Table 2).", minimum=0),
    )

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the plan; the same one for the same seed."""

        def plan_turn(turn: Turn) -> list[int]:
            return self._plan_turn(turn, problem.target_reward, budget, seed)

        return plan_in_turn(problem, budget, plan_turn)

    def _plan_turn(self, turn: Turn, target_reward: Floats, budget: Budget, seed: int) -> list[int]:
        track, collected = turn.track, turn.collected
        guidance = Guidance(
            gamma=self.gamma,
            contact_reward_per_s=self.contact_reward_per_s,
            sunpoint_reward_per_s=self.sunpoint_reward_per_s,
            penalty=self.penalty,
        )
        rules = Rules(
            depth=self.depth,
            breadth=self.breadth,
            exploration=self.exploration,
            is_hard=self.feasibility == "hard",
            unimaged_only=self.unimaged_only,
            is_per_decision=self.discount == "per_decision",
            is_literal=self.returns == "literal",
            is_greedy=self.rollout == "greedy",
            is_max_backup=self.backup == "max",
        )
        # A state stays in the tree for at most ``depth`` steps, so no more ever hang together.
        num_nodes = self.num_simulations * (self.depth + 1) + 2
        trees = [_empty_tree(num_nodes, num_nodes * (self.breadth + 1)) for _ in range(2)]
        tree, spare = trees
        _new_node(tree, NO_TASK, NO_TASK, track.battery_start, track.recorder_start)
        random = draws_of(seed)
        path = Path(
            edge=np.empty(self.depth, dtype=np.int32),
            action=np.empty(self.depth, dtype=np.int32),
            image=np.empty(self.depth, dtype=np.int32),
            reward=np.empty(self.depth),
            discount=np.empty(self.depth),
            options=np.empty(self.breadth + 1, dtype=np.int32),
        )
        best, best_actions = np.full(1, -np.inf), np.full(self.depth, NO_TASK, dtype=np.int32)
        taken: list[int] = []
        reward = 0.0
        while not budget.is_spent():
            edge = _search(
                tree, track, rules, guidance, target_reward, collected, random,
                path, self.num_simulations, budget.stop, best, best_actions,
            )  # fmt: skip
            if edge == _UNSEEN or budget.is_spent():
                break
            if self.keep_incumbent:
                edge = _edge_of(tree, int(best_actions[0]), edge)
            action = int(tree.action[edge])
            child = int(tree.child[edge])
            if action != WAIT:
                taken.append(action)
                place = track.place[action]
                if not track.is_contact[action] and not collected[place]:
                    collected[place] = 1
                    reward += float(target_reward[place])
            best[0] = -np.inf
            _copy_branch(tree, spare, child)
            tree, spare = spare, tree
            turn.report((int(tree.cursor[0]) + 1) / len(track.start_s), reward)
        return taken


def _edge_of(tree: Tree, action: int, otherwise: int) -> int:
    first = int(tree.first_edge[0])
    for edge in range(first, first + int(tree.num_edges[0])):
        if tree.action[edge] == action and tree.visits[edge] > 0:
            return edge
    return otherwise
