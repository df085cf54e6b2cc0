"""The plan that every search begins with."""

from __future__ import annotations

from collections.abc import Iterator

from planner_core.budget import Budget
from planner_core.certified.driver import Search
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import has_limits
from planner_core.solvers.rule import Rule


def rule(search: Search) -> Iterator[None]:
    """Plan as the rule-based solver does, whatever the time."""
    plan = Rule().solve(search.problem, Budget(), search.seed).plan
    if has_limits(search.problem):
        search.engine(ResourceSearch).offer(plan)
    else:
        search.best.offer(plan)
    yield
