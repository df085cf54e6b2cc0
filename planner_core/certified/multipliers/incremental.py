"""Prices of targets that several satellites share, changed after each satellite's own answer.

A subgradient step waits for all satellites' heaviest paths. Here each part of the network in
turn, in random order, answers the prices of the moment, and every few parts the prices move: up
where the paths that are current take a target more than once, down where none does. Steps get
shorter; the mean of the prices settles far sooner than the prices do, and it is the mean that is
put to all satellites at once now and then, which is what proves a bound.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.jit import kernel
from planner_core.precedence.network import Network, heaviest_path, heaviest_paths
from planner_core.problem import (
    Bools,
    Bytes,
    Floats,
    Ints,
    Longs,
    Problem,
)

_FIRST_STEP: Final = 0.5  # of a reward, for all parts together
_LAST_STEP: Final = 1e-3  # of the first
_NEWEST: Final = 0.15  # share of an epoch's prices in the mean
_ASKED_EVERY: Final = 5  # epochs
_MOVES: Final = 24  # of the prices in an epoch, at most


class IncrementalPrices:
    """Prices that get better epoch by epoch; in each every part of the network answers once.

    Parameters
    ----------
    worth
        Of each node. Shape ``(n,)``.
    most
        The best worth of each place, with a last entry of zero that stands for contacts.
    num_epochs
        After how many the steps shall be so short that more are of little use.

    Attributes
    ----------
    value, prices
        The least bound that was proven so far, and the prices that prove it. Shape of ``most``.
    """

    def __init__(
        self, network: Network, worth: Floats, most: Floats, num_epochs: int, seed: int
    ) -> None:
        n = len(network.row)
        self._network = network
        self._busy = np.flatnonzero(np.diff(network.first))
        self._weight, self._value = np.empty(n), np.empty(n)
        self._previous = np.empty(n, dtype=np.int32)
        self._ends = np.empty(len(network.first) - 1, dtype=np.int32)
        self._is_on_path = np.zeros(n, dtype=np.bool_)
        self._count = np.zeros(len(most), dtype=np.int32)
        self._worth, self._top = worth, most
        self._now = 0.5 * self._top
        self._mean = self._now.copy()
        self._rng = np.random.default_rng(seed)
        self._epoch = 0
        self._num_epochs = num_epochs
        # Each target for its whole reward, and nothing for any task.
        self.value, self.prices = float(self._top.sum()), self._top.copy()

    @property
    def is_settled(self) -> bool:
        """Whether more epochs are of little use."""
        return self._epoch >= self._num_epochs

    def improve(self, num_epochs: int, stop: Bytes) -> None:
        """Let all parts answer so many times, and prove a bound now and then."""
        shorter = _LAST_STEP ** (1.0 / self._num_epochs)
        for _ in range(num_epochs):
            order = self._rng.permutation(self._busy)
            _answer_in_turn(
                self._network, order, min(_MOVES, len(order)), self._worth, self._top, self._now,
                _FIRST_STEP * shorter**self._epoch, self._count, self._is_on_path,
                self._weight, self._value, self._previous, stop,
            )  # fmt: skip
            if stop[0]:
                return
            self._epoch += 1
            self._mean += _NEWEST * (self._now - self._mean)
            if self._epoch % _ASKED_EVERY == 0:
                self.ask(self._mean)

    def ask(self, prices: Floats) -> float:
        """Return the bound that prices prove, and keep it if it is the least."""
        np.take(prices, self._network.place, out=self._weight)
        np.maximum(self._worth - self._weight, 0.0, out=self._weight)
        value = float(prices.sum()) + heaviest_paths(
            self._network, self._weight, self._value, self._previous, self._ends
        )
        if value < self.value:
            self.value, self.prices = value, prices.copy()
        return value


def incremental_prices(
    problem: Problem, network: Network, level: float, num_epochs: int, stop: Bytes
) -> tuple[float, Floats]:
    """Return the bound that prices prove after so many epochs, and the prices.

    Ends early at ``level``, which some plan earns. Shape of the prices ``(num_targets,)``.
    """
    worth, most = problem.worth[network.row], np.append(problem.best_worth, 0.0)
    search = IncrementalPrices(network, worth, most, max(1, num_epochs), 0)
    done = 0
    while done < num_epochs and search.value > level and not stop[0]:
        search.improve(_ASKED_EVERY, stop)
        done += _ASKED_EVERY
    return search.value, search.prices[:-1]


@kernel
def _answer_in_turn(
    network: Network,
    order: Longs,
    num_moves: int,
    worth: Floats,
    top: Floats,
    prices: Floats,
    step: float,
    count: Ints,
    is_on_path: Bools,
    weight: Floats,
    value: Floats,
    previous: Ints,
    stop: Bytes,
) -> None:
    """Give each part a new path, and move the prices now and then; all in place.

    Parameters
    ----------
    order
        The parts.
    num_moves
        How often the prices move.
    step
        What a price moves altogether, in rewards, for each path too many.
    count, is_on_path
        How many of the current paths take each place, and which nodes those are.
    weight, value, previous
        Room to work in. Shape ``(n,)``.
    """
    num_done = 0
    for move in range(num_moves):
        if stop[0]:
            return
        until = len(order) * (move + 1) // num_moves
        while num_done < until:
            part = order[num_done]
            num_done += 1
            for a in range(network.first[part], network.first[part + 1]):
                weight[a] = max(0.0, worth[a] - prices[network.place[a]])
                if is_on_path[a]:
                    is_on_path[a] = False
                    count[network.place[a]] -= 1
            _, at = heaviest_path(network, part, weight, value, previous)
            while at >= 0:
                # What is worth nothing is only passed through.
                if weight[at] > 0.0:
                    is_on_path[at] = True
                    count[network.place[at]] += 1
                at = previous[at]
        for i in range(len(prices)):
            moved = prices[i] + step / num_moves * top[i] * (count[i] - 1)
            prices[i] = min(max(moved, 0.0), top[i])
