"""A window search that goes on where it stalls: a tenth of the best plan is planned afresh."""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.lns.search import WindowSearch
from planner_core.precedence.network import Network
from planner_core.problem.plan import Plan

_SHAKEN: Final = 0.1  # share of the parts of the network


class WindowStream:
    """Moves from one start, the same for the same seed.

    Parameters
    ----------
    patience
        How many moves without any gain there may be.

    Attributes
    ----------
    plan, reward
        The best plan so far.
    ended
        Where moves led nowhere for long, what they had led to.
    """

    def __init__(self, windows: WindowSearch, network: Network, seed: int, patience: float) -> None:
        self._windows, self._network, self._patience = windows, network, patience
        self._rng = np.random.default_rng(seed)
        self.plan, self.reward = windows.plan, windows.reward
        self.ended: list[Plan] = []
        self._highest, self._since = self.reward, 0

    def go_on(self, num_moves: int, budget: Budget) -> None:
        """Make some moves, and shake the best plan where they have led nowhere for long."""
        windows = self._windows
        windows.make_moves(num_moves, budget)
        self._since += num_moves
        if windows.reward > self._highest:
            self._highest, self._since = windows.reward, 0
        if windows.reward > self.reward:
            self.plan, self.reward = windows.plan, windows.reward
        if self._since >= self._patience:
            self.ended.append(windows.plan)
            if windows.reward == self.reward:
                self.plan = windows.plan
            windows.adopt(self._shaken())
            self._highest, self._since = windows.reward, 0

    def _shaken(self) -> Plan:
        """Return the best plan without the tasks of a few parts."""
        first = self._network.first
        is_cleared = np.repeat(self._rng.random(len(first) - 1) < _SHAKEN, np.diff(first))
        cleared = set(self._network.row[is_cleared].tolist())
        return Plan(tuple(a for a in self.plan.actions if a.opportunity not in cleared))
