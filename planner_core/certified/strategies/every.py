"""All strategies of ``certified``, in the order in which they begin."""

from __future__ import annotations

from typing import Final

from planner_core.budget import Budget
from planner_core.certified.driver import Begin, Effort, Search, Strategy
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.proofs.continuous import quick_bound
from planner_core.certified.strategies import (
    agility,
    continuous,
    days,
    first_plan,
    fleet,
    half_life,
    resource_fleet,
    resources,
    whole_program,
)
from planner_core.certified.strategies.supports import (
    earns_on_board,
    fits_a_program,
    has_choice_of_starts,
    has_continuous_starts,
    has_continuous_starts_alone,
    has_continuous_starts_with_resources,
    has_one_start_each,
    has_slots,
    has_steady_worth,
    is_agility_only_fleet,
    is_agility_only_satellite,
    is_aging,
    is_aging_alone,
    is_aging_but_no_fleet,
    is_aging_in_programs,
    is_aging_on_board,
    is_alone_with_limits,
    is_fleet,
    is_large_free_fleet,
    is_shared,
    is_shared_and_aging_in_programs,
    is_shared_with_limits,
    is_small_and_shared,
    is_small_free_fleet,
    is_small_free_fleet_with_choice,
    is_within_reach,
    samples_starts,
)
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.solvers.base import Solution

STRATEGIES: Final = (
    Strategy(
        name="rule",
        supports=lambda _: True,
        slices=first_plan.rule,
        begin=Begin.ALWAYS,
    ),
    Strategy(
        name="bound by energy and data",
        supports=has_steady_worth,
        slices=resources.resource_bound,
        begin=Begin.ALWAYS,
    ),
    Strategy(
        name="relaxation over slots",
        supports=has_slots,
        slices=resources.slot_relaxation,
    ),
    Strategy(
        name="bound by agility",
        supports=is_aging,
        slices=half_life.agility_bound,
        begin=Begin.ALWAYS,
    ),
    # Without resources, one satellite.
    Strategy(
        name="multipliers of paths",
        supports=has_one_start_each,
        slices=agility.path_multipliers,
    ),
    Strategy(
        name="multipliers of passes",
        supports=has_choice_of_starts,
        slices=agility.pass_multipliers,
        patience=lambda: TUNING.patience,
    ),
    Strategy(
        name="windows beside multipliers of passes",
        supports=has_choice_of_starts,
        slices=agility.windows,
        patience=lambda: TUNING.patience,
    ),
    Strategy(
        name="windows",
        supports=has_one_start_each,
        slices=agility.windows,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="cutting planes",
        supports=is_agility_only_satellite,
        slices=agility.cutting_planes,
        begin=Begin.STALLED,
    ),
    # Without resources, a fleet.
    Strategy(
        name="multipliers of a fleet's paths",
        supports=is_agility_only_fleet,
        slices=fleet.fleet_multipliers,
    ),
    Strategy(
        name="streams of windows",
        supports=is_small_free_fleet,
        slices=fleet.windows,
        begin=Begin.STALLED,
        patience=lambda: TUNING.patience,
    ),
    Strategy(
        name="multipliers of a fleet's passes",
        supports=is_small_free_fleet_with_choice,
        slices=agility.pass_multipliers,
        patience=lambda: TUNING.patience,
    ),
    Strategy(
        name="a fleet's cutting planes",
        supports=is_small_free_fleet,
        slices=fleet.fleet_cutting_planes,
        begin=Begin.STALLED,
    ),
    Strategy(
        name="windows of a large fleet",
        supports=is_large_free_fleet,
        slices=fleet.windows,
        begin=Begin.STALLED,
    ),
    # Battery and recorder: several satellites, then one, with similar ones in another order.
    Strategy(
        name="plans and multipliers side by side",
        supports=is_shared_with_limits,
        slices=resource_fleet.plans_and_multipliers,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="plans and programs side by side",
        supports=is_shared_with_limits,
        slices=resource_fleet.plans_and_programs,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="a fleet's programs with the plan's contacts",
        supports=lambda p: fits_a_program(p) and is_shared(p),
        slices=resources.own_contacts,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="choices",
        supports=is_alone_with_limits,
        slices=resources.choices,
        begin=Begin.STALLED,
    ),
    Strategy(
        name="windows and choices",
        supports=is_alone_with_limits,
        slices=resources.windows_and_choices,
        begin=Begin.STALLED,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="programs with the plan's contacts",
        supports=lambda p: fits_a_program(p) and not is_shared(p),
        slices=resources.own_contacts,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="whole relaxation",
        supports=lambda p: has_steady_worth(p) and not is_fleet(p),
        slices=resources.whole_relaxation,
    ),
    Strategy(
        name="a small fleet's programs with contacts fixed",
        supports=is_small_and_shared,
        slices=resources.programs,
        patience=lambda: TUNING.several,
    ),
    Strategy(
        name="multipliers",
        supports=is_alone_with_limits,
        slices=resources.multipliers,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="choices from the best plan",
        supports=is_alone_with_limits,
        slices=resources.choices_from_the_best,
    ),
    Strategy(
        name="programs with contacts fixed",
        supports=is_alone_with_limits,
        slices=resources.programs,
        patience=lambda: TUNING.several,
    ),
    Strategy(
        name="a fleet's contacts exchanged",
        supports=lambda p: is_shared_with_limits(p) and p.use_resources,
        slices=resources.exchanged_contacts,
        begin=Begin.STALLED,
        patience=lambda: TUNING.several,
    ),
    # Images that lose worth as they age.
    Strategy(
        name="images by the contact that brings them down",
        supports=is_shared_and_aging_in_programs,
        slices=whole_program.images_by_contact,
    ),
    Strategy(
        name="forward search",
        supports=is_aging,
        slices=half_life.forward_search,
    ),
    Strategy(
        name="plans without the half-life",
        supports=is_aging_on_board,
        slices=half_life.plans_without_half_life,
    ),
    Strategy(
        name="a fleet's plans without the half-life",
        supports=lambda p: is_aging(p) and is_shared(p),
        slices=days.plans_without_half_life,
    ),
    Strategy(
        name="days planned anew",
        supports=lambda p: is_aging(p) and is_shared(p),
        slices=days.days,
    ),
    Strategy(
        name="multipliers of contacts",
        supports=is_aging,
        slices=half_life.multipliers,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="queues",
        supports=is_aging_alone,
        slices=half_life.queues,
    ),
    Strategy(
        name="plans by their contacts",
        supports=is_aging_but_no_fleet,
        slices=half_life.plans_by_contacts,
        patience=lambda: TUNING.patience,
    ),
    Strategy(
        name="whole relaxation with ages",
        supports=earns_on_board,
        slices=half_life.whole_relaxation,
    ),
    Strategy(
        name="windows by small programs",
        supports=is_aging_in_programs,
        slices=half_life.program_windows,
        begin=Begin.STALLED,
    ),
    # Continuous starts.
    Strategy(
        name="fixed starts",
        supports=has_continuous_starts_with_resources,
        slices=continuous.fixed_starts,
    ),
    Strategy(
        name="sampled starts",
        supports=samples_starts,
        slices=continuous.sampled_starts,
    ),
    Strategy(
        name="insertion",
        supports=has_continuous_starts_alone,
        slices=continuous.insertion,
        begin=Begin.ALWAYS,
    ),
    Strategy(
        name="windows with continuous starts",
        supports=has_continuous_starts_alone,
        slices=continuous.windows,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="windows with continuous starts and resources",
        supports=has_continuous_starts_with_resources,
        slices=continuous.windows_with_resources,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="multipliers of chains",
        supports=has_continuous_starts,
        slices=continuous.chain_multipliers,
        patience=lambda: TUNING.tries,
    ),
    Strategy(
        name="exhaust",
        supports=is_within_reach,
        slices=whole_program.exhaust,
        begin=Begin.STALLED,
    ),
)
"""Strategies that improve plans or lower bounds, each with the problems that it supports."""


def solved(
    problem: Problem, budget: Budget, seed: int, gap: float, effort: Effort | None = None
) -> Solution:
    """Return the best plan and its bound, by all strategies that support the problem."""
    is_agility_only = has_continuous_starts(problem)
    best = Incumbent(
        problem,
        budget,
        gap,
        bound=quick_bound(problem) if is_agility_only else None,
        covers_starts=is_agility_only,
    )
    return Search(best, seed, STRATEGIES, effort or Effort()).solved()
