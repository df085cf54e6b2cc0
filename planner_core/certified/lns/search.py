"""Large neighbourhood search on a plan without resources: windows replanned by longest chains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.lns.moves import Assignment, SearchData, make_moves
from planner_core.certified.lns.window_chains import workspace_for
from planner_core.certified.signs import UNASSIGNED
from planner_core.certified.tuning import TUNING
from planner_core.draws import draws_of
from planner_core.precedence.network import Network, network_of
from planner_core.precedence.relation import is_transitive_on
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Solution


class WindowSearch:
    """A plan of all satellites, and moves that improve it or leave it as good.

    Only collects and agility count; contacts are dropped. The same seed makes the same moves,
    however many each call makes.

    Parameters
    ----------
    network
        Of ``problem``, if it has been built already.
    preference
        Factor on the worth of each target that decides which targets a move prefers; a plan is
        never replaced by one that earns less. Shape ``(num_targets,)``.
    """

    def __init__(
        self,
        problem: Problem,
        seed: int,
        network: Network | None = None,
        preference: Floats | None = None,
    ) -> None:
        self.problem = problem
        network = network or network_of(problem)
        self._row = network.row
        self._search = _search_data(problem, network, preference)
        self._draws = draws_of(seed)
        self._workspace = workspace_for(len(problem.target_ids))
        self._every = np.ones(len(self._row), dtype=np.bool_)
        self.adopt(Plan())

    def adopt(self, plan: Plan) -> None:
        """Continue from another plan."""
        is_taken = np.zeros(len(self._row), dtype=np.bool_)
        is_taken[[action.opportunity for action in plan.actions]] = True
        is_taken[self.problem.opportunities.kind == CONTACT] = False
        is_taken = is_taken[self._row]
        imaged_by = np.full(len(self.problem.target_ids) + 1, UNASSIGNED, dtype=np.int32)
        # The best image of a target counts; of equally good ones, the first.
        own = np.flatnonzero(is_taken)[::-1]
        own = own[np.argsort(self._search.worth[own], kind="stable")]
        imaged_by[self._search.network.site[own]] = own
        # A second image of a target is dropped if its neighbours can do without it.
        part = np.searchsorted(self._search.network.first, own, side="right") - 1
        is_spare = imaged_by[self._search.network.site[own]] != own
        is_spare &= self._search.is_transitive[part] & ~self._search.is_kept[own]
        is_taken[own[is_spare]] = False
        self._assignment = Assignment(is_taken=is_taken, imaged_by=imaged_by)

    def make_moves(self, num_moves: int, budget: Budget, offered: Bools | None = None) -> None:
        """Make ``num_moves`` moves, or fewer if the budget is spent first.

        Parameters
        ----------
        offered
            Opportunities that moves may take besides those of the plan. Shape ``(n,)``.
        """
        nodes = self._every if offered is None else offered[self._row]
        while num_moves > 0 and not budget.is_spent():
            make_moves(
                self._search, self._assignment, nodes, self._workspace, self._draws,
                min(num_moves, TUNING.moves_at_a_time), budget.stop,
            )  # fmt: skip
            num_moves -= TUNING.moves_at_a_time

    @property
    def plan(self) -> Plan:
        """The current plan."""
        return Plan.of(self.problem, np.sort(self._row[self._assignment.is_taken]).tolist())

    @property
    def reward(self) -> float:
        """What the plan's targets earn."""
        held = self._assignment.imaged_by[:-1]
        return float(self._search.worth[held[held != UNASSIGNED]].sum())


def num_choices(problem: Problem) -> int:
    """Return the number of accesses with at least one collect."""
    table = problem.opportunities
    return len(np.unique(table.access[table.kind == COLLECT]))


def improved(
    problem: Problem, plan: Plan, moves_per_task: float, budget: Budget, seed: int
) -> Plan:
    """Return a plan that earns no less, after ``moves_per_task`` moves for each access."""
    search = WindowSearch(problem, seed)
    search.adopt(plan)
    search.make_moves(int(moves_per_task * num_choices(problem)), budget)
    return search.plan


def polished(
    problem: Problem, solution: Solution, moves_per_task: float, budget: Budget
) -> Solution:
    """Return a search's solution with its plan improved if only agility counts."""
    knows_turns = not (problem.use_resources or problem.turns_in_motion)
    if not knows_turns or moves_per_task == 0.0 or budget.is_spent():
        return solution
    plan = improved(problem, solution.plan, moves_per_task, budget, 0)
    return replace(solution, plan=plan)


def _search_data(problem: Problem, network: Network, preference: Floats | None) -> SearchData:
    is_transitive = np.array([is_transitive_on(s) for s in problem.satellites], dtype=np.bool_)
    num_targets = len(problem.target_ids)
    worth = problem.worth[network.row]
    is_kept = np.isin(network.row, problem.kept_rows)
    is_locked = np.zeros(num_targets + 1, dtype=np.bool_)
    is_locked[network.site[is_kept]] = True
    return SearchData(
        network=network,
        is_transitive=is_transitive[network.satellite],
        worth=worth,
        preference=np.ones(num_targets + 1) if preference is None else np.append(preference, 1.0),
        is_kept=is_kept,
        is_locked=is_locked,
        kept_worth=1.0 + float(problem.best_worth.sum()),
        is_alike=len(np.unique(worth)) <= 1,
    )
