"""Longest paths by agility alone, as an oracle."""

from __future__ import annotations

import numpy as np

from planner_core.certified.multipliers.ascent import Ascent, Epochs, Standing, Steps, move, weigh
from planner_core.certified.tuning import TUNING
from planner_core.jit import kernel
from planner_core.precedence.network import Network, heaviest_path, heaviest_paths
from planner_core.problem import Bools, Bytes, Floats, Ints, Problem


class Paths:
    """Each part's longest path through a network at given multipliers."""

    def __init__(self, problem: Problem, network: Network) -> None:
        n = len(network.row)
        self._network, self._worth = network, problem.worth[network.row]
        self.parts: Ints = np.flatnonzero(np.diff(network.first)).astype(np.int32)
        self._weight, self._value = np.empty(n), np.empty(n)
        self._previous = np.empty(n, dtype=np.int32)
        self._ends = np.empty(len(network.first) - 1, dtype=np.int32)
        self._is_on_path = np.zeros(n, dtype=np.bool_)

    def run(self, epochs: Epochs, standing: Standing, stop: Bytes) -> int:
        """Give parts new paths, move multipliers in between; return how many epochs were run."""
        return int(
            _run(
                self._network, epochs, standing, self._worth, self._is_on_path,
                self._weight, self._value, self._previous, stop,
            )
        )  # fmt: skip

    def gain(self, multipliers: Floats) -> float:
        """Return what the longest paths of all parts are worth together."""
        np.take(multipliers, self._network.site, out=self._weight)
        np.maximum(self._worth - self._weight, 0.0, out=self._weight)
        return float(
            heaviest_paths(self._network, self._weight, self._value, self._previous, self._ends)
        )


def ascent_on_paths(problem: Problem, network: Network, num_epochs: int, seed: int) -> Ascent:
    """Return the ascent on the bound that longest paths prove."""
    steps = Steps(first=TUNING.first_step_of_paths, last=TUNING.last_step, num_epochs=num_epochs)
    begin = TUNING.begin * problem.best_worth
    return Ascent(Paths(problem, network), problem.best_worth, begin, steps, seed)


@kernel
def _run(
    network: Network,
    epochs: Epochs,
    standing: Standing,
    worth: Floats,
    is_on_path: Bools,
    weight: Floats,
    value: Floats,
    previous: Ints,
    stop: Bytes,
) -> int:
    """Give each part a new path in each epoch, move multipliers in between; all in place.

    Parameters
    ----------
    is_on_path
        Which nodes the current paths are paid for. Shape ``(n,)``.
    weight, value, previous
        Workspace. Shape ``(n,)``.
    """
    for number in range(len(epochs.orders)):
        for i in range(len(epochs.moves_after)):
            if stop[0]:
                return number
            part = epochs.orders[number, i]
            begin, end = network.first[part], network.first[part + 1]
            weigh(begin, end, network.site, worth, standing, weight, is_on_path)
            _, at = heaviest_path(network, part, weight, value, previous)
            while at >= 0:
                # A path only passes through nodes that are worth nothing.
                if weight[at] > 0.0:
                    is_on_path[at] = True
                    standing.taken[network.site[at]] += 1
                at = previous[at]
            move(standing, epochs, number, i)
    return len(epochs.orders)
