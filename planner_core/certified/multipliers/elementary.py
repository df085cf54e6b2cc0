"""Prices for the elementary bound: steps along the subgradient of one part after another.

A plan's parts share the targets alone. After each part's labels at the prices of the moment its
path takes the place of its last one, and prices follow the number of paths that want a target.
Their running mean is what is asked, from time to time, for a bound.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.certified.dp.elementary import (
    Labels,
    Memory,
    elementary_paths,
    label_part,
    labels_for,
)
from planner_core.draws import Uint64s, draws_of, next_draw
from planner_core.jit import borrowing
from planner_core.precedence.arcs import ArcNetwork
from planner_core.problem import (
    Bools,
    Bytes,
    Floats,
    Ints,
    Longs,
    Problem,
)
from planner_core.worth import weights

ROUND: Final = 6
"""Steps over all parts in a round: five that move the prices, and one that asks for a bound."""

_FIRST_STEP: Final = 0.2  # of a target's reward, for each path too many, in an epoch
_SHORTER: Final = 0.99  # from epoch to epoch
_LAST_STEP: Final = 0.01  # of few rounds
_SHORTEST: Final = 0.001
_MEMORY: Final = 0.85  # of the mean, from epoch to epoch


class ElementaryPrices:
    """Prices that come ever closer to the best, and the bound that they prove.

    Parameters
    ----------
    num_rounds
        How many rounds there will be, where they are few: steps get shorter the sooner.

    Attributes
    ----------
    bound
        The least that any prices so far have proven; infinite at first.
    prices
        Those. Shape ``(num_targets,)``.
    """

    def __init__(
        self,
        problem: Problem,
        network: ArcNetwork,
        memory: Memory,
        seed: int,
        num_rounds: int | None = None,
    ) -> None:
        self._network, self._memory = network, memory
        self._shorter = _SHORTER
        if num_rounds is not None:
            self._shorter = (_LAST_STEP / _FIRST_STEP) ** (1.0 / (num_rounds * (ROUND - 1)))
        self._labels = labels_for(network, memory)
        self._worth = problem.worth[network.row]
        self._top = np.append(problem.best_worth, 0.0)
        self._now = 0.5 * self._top
        self._mean = self._now.copy()
        self._draws = draws_of(seed)
        self._weight = np.zeros(len(network.row))
        self._is_on_path = np.zeros(len(network.row), dtype=np.bool_)
        self._wanted = np.zeros(len(self._top), dtype=np.int32)
        self._counts = np.zeros(len(self._top), dtype=np.int32)
        self._order = np.arange(len(network.first) - 1)
        self.step = _FIRST_STEP
        self.bound, self.prices = np.inf, self._now[:-1].copy()

    @property
    def is_worn_out(self) -> bool:
        """Whether steps have become too short to matter."""
        return self.step <= _SHORTEST

    def improve(self, num_rounds: int, stop: Bytes) -> None:
        """Go on for some rounds of epochs; each ends with a bound."""
        for _ in range(num_rounds):
            for _ in range(ROUND - 1):
                _epoch(
                    self._network, self._memory, self._labels, self._worth, self._top,
                    self._now, self._weight, self._is_on_path, self._wanted, self._order,
                    self.step, self._draws, stop,
                )  # fmt: skip
                if stop[0]:
                    return
                self._mean = _MEMORY * self._mean + (1.0 - _MEMORY) * self._now
                self.step = max(self.step * self._shorter, _SHORTEST)
            self.ask(self._mean)

    def ask(self, prices: Floats) -> None:
        """Note what bound some prices prove. Shape ``(num_targets + 1,)``, the last one zero."""
        weight = weights(self._worth, prices[self._network.place])
        paths = elementary_paths(self._network, self._memory, weight, self._labels, self._counts)
        value = float(prices.sum() + paths)
        if value < self.bound:
            self.bound, self.prices = value, prices[:-1].copy()


@borrowing
def _epoch(
    network: ArcNetwork,
    memory: Memory,
    labels: Labels,
    worth: Floats,
    top: Floats,
    now: Floats,
    weight: Floats,
    is_on_path: Bools,
    wanted: Ints,
    order: Longs,
    step: float,
    draws: Uint64s,
    stop: Bytes,
) -> None:
    """Take each part once, in random order, and let prices follow."""
    num_parts = len(order)
    for i in range(num_parts - 1, 0, -1):
        j = int(next_draw(draws) * (i + 1))
        order[i], order[j] = order[j], order[i]
    for i in range(num_parts):
        if stop[0]:
            return
        part = order[i]
        for b in range(network.first[part], network.first[part + 1]):
            place = network.place[b]
            weight[b] = max(0.0, worth[b] - now[place])
            if is_on_path[b]:
                is_on_path[b] = False
                wanted[place] -= 1
        _, at = label_part(network, memory, weight, labels, part)
        while at >= 0:
            if labels.is_paid[at] and worth[at] >= now[network.place[at]]:
                is_on_path[at] = True
                wanted[network.place[at]] += 1
            at = labels.previous[at]
        for place in range(len(now) - 1):
            moved = now[place] + step / num_parts * top[place] * (wanted[place] - 1)
            now[place] = min(max(moved, 0.0), top[place])
