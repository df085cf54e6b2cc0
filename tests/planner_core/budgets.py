"""Budgets that end after a certain amount of work: the same on slow and fast machines."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

from planner_core.budget import Budget, Progress


def expiring(is_enough: Callable[[Progress], bool]) -> Budget:
    """Return a budget whose time is over with the first report that satisfies the condition."""
    budget = Budget()

    def look_at(progress: Progress) -> None:
        if is_enough(progress):
            budget.expire()

    budget.report = look_at
    return budget


def bounds_told(number: int) -> Callable[[Progress], bool]:
    """Return a condition that holds once this number of different bounds has been reported."""
    told: set[float] = set()

    def look_at(progress: Progress) -> bool:
        if progress.bound is not None:
            told.add(progress.bound)
        return len(told) >= number

    return look_at


def reports(number: int) -> Callable[[Progress], bool]:
    """Return a condition that holds once this number of reports has come."""
    told = count(1)
    return lambda _: next(told) >= number


class Reports(Budget):
    """A budget whose seconds are progress reports."""

    def __init__(self, number: int) -> None:
        super().__init__(report=self._count)
        self.left = number

    def _count(self, _: Progress) -> None:
        self.left -= 1

    def is_spent(self) -> bool:
        return super().is_spent() or self.left <= 0

    def remaining_s(self) -> float:
        return float(max(self.left, 0))
