"""The plan that every search starts from."""

from __future__ import annotations

from collections.abc import Iterator

from planner_core.budget import Budget
from planner_core.certified.driver import Search
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import has_limits
from planner_core.solvers.rule import Rule


def rule(search: Search) -> Iterator[None]:
    """Plan with the rule-based solver, whatever the budget."""
    plan = Rule().solve(search.problem, Budget(), search.seed).plan
    if has_limits(search.problem):
        search.engine(ResourceSearch).offer(plan)
    else:
        search.best.offer(plan)
    yield
