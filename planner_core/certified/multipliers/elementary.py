"""Longest paths that are paid for a target only once in each pass over it, as an oracle."""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.elementary import (
    Labels,
    Memory,
    elementary_paths,
    label_part,
    labels_for,
    memory_of,
)
from planner_core.certified.multipliers.ascent import Ascent, Epochs, Standing, Steps, move, weigh
from planner_core.certified.tuning import TUNING
from planner_core.jit import borrowing
from planner_core.precedence.arcs import ArcNetwork, arc_network_of
from planner_core.problem import Bools, Bytes, Floats, Ints, Problem
from planner_core.worth import weights


class ElementaryPaths:
    """Each part's best path at given multipliers, with no target paid twice in a pass."""

    def __init__(self, problem: Problem, network: ArcNetwork, memory: Memory) -> None:
        n = len(network.row)
        self._network, self._memory = network, memory
        self._labels = labels_for(network, memory)
        self._worth = problem.worth[network.row]
        self.parts: Ints = np.flatnonzero(np.diff(network.first)).astype(np.int32)
        self._weight = np.zeros(n)
        self._is_on_path = np.zeros(n, dtype=np.bool_)
        self._count = np.zeros(len(problem.target_ids) + 1, dtype=np.int32)

    def run(self, epochs: Epochs, standing: Standing, stop: Bytes) -> int:
        """Give parts new paths, move multipliers in between; return how many epochs were run."""
        return int(
            _run(
                self._network, self._memory, self._labels, epochs, standing, self._worth,
                self._weight, self._is_on_path, stop,
            )
        )  # fmt: skip

    def gain(self, multipliers: Floats) -> float:
        """Return an upper bound on the worth of all parts' paths together."""
        weight = weights(self._worth, multipliers[self._network.site])
        return float(
            elementary_paths(self._network, self._memory, weight, self._labels, self._count)
        )


def ascent_on_passes(problem: Problem, seed: int, num_epochs: int | None = None) -> Ascent:
    """Return the ascent on the bound that such paths prove.

    Parameters
    ----------
    num_epochs
        How many epochs there will be, if few: steps then get shorter sooner.
    """
    network = arc_network_of(problem)
    oracle = ElementaryPaths(problem, network, memory_of(problem, network))
    steps = Steps(
        first=TUNING.first_step,
        last=TUNING.last_step if num_epochs is None else TUNING.last_step_of_few,
        num_epochs=num_epochs or 2 * TUNING.epochs,
    )
    return Ascent(oracle, problem.best_worth, TUNING.begin * problem.best_worth, steps, seed)


@borrowing
def _run(
    network: ArcNetwork,
    memory: Memory,
    labels: Labels,
    epochs: Epochs,
    standing: Standing,
    worth: Floats,
    weight: Floats,
    is_on_path: Bools,
    stop: Bytes,
) -> int:
    """Give each part a new path in each epoch, move multipliers in between; all in place."""
    for number in range(len(epochs.orders)):
        for i in range(len(epochs.moves_after)):
            if stop[0]:
                return number
            part = epochs.orders[number, i]
            begin, end = network.first[part], network.first[part + 1]
            weigh(begin, end, network.site, worth, standing, weight, is_on_path)
            _, at = label_part(network, memory, weight, labels, part)
            while at >= 0:
                if labels.is_paid[at] and worth[at] >= standing.now[network.site[at]]:
                    is_on_path[at] = True
                    standing.taken[network.site[at]] += 1
                at = labels.previous[at]
            move(standing, epochs, number, i)
    return len(epochs.orders)
