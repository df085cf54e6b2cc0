"""Predicates for the problems that a strategy supports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.certified.sizes import NEXT_CONTACTS
from planner_core.certified.tuning import TUNING
from planner_core.precedence.relation import is_transitive
from planner_core.problem import COLLECT, Problem


def is_shared(problem: Problem) -> bool:
    """Whether several satellites have opportunities."""
    return sum(len(satellite) > 0 for satellite in problem.satellites) > 1


def is_large(problem: Problem) -> bool:
    """Whether steps with resources take long, and the whole program is out of reach."""
    return len(problem.opportunities) > TUNING.large


def is_fleet(problem: Problem) -> bool:
    """Whether several satellites have so many opportunities that the whole program is too large."""
    return is_shared(problem) and is_large(problem)


def has_half_life(problem: Problem) -> bool:
    """Whether images are worth less the later they come down."""
    return problem.counts_delivery and problem.objective.half_life_s is not None


def has_continuous_starts(problem: Problem) -> bool:
    """Whether collects may start anywhere in their accesses."""
    return problem.pointing is not None


def has_continuous_starts_alone(problem: Problem) -> bool:
    """Whether starts are continuous, and neither battery nor recorder counts."""
    return has_continuous_starts(problem) and not problem.use_resources


def has_continuous_starts_with_resources(problem: Problem) -> bool:
    """Whether starts are continuous, and battery and recorder count."""
    return has_continuous_starts(problem) and problem.use_resources


def has_slots(problem: Problem) -> bool:
    """Whether starts are so many that a relaxation over slots of time comes first.

    With one start in each access exact programmes and whole relaxations soon prove more.
    """
    if has_continuous_starts(problem):
        return problem.use_resources
    return has_steady_worth(problem) and problem.offers_starts


def samples_starts(problem: Problem) -> bool:
    """Whether plans are sought among many starts in each access.

    Days of fleets whose images age take too long to plan with so many: four satellites over 500
    targets with a half-life of three hours earn 433 after twelve CPU seconds, and 563 without.
    """
    is_aging_fleet = has_half_life(problem) and is_shared(problem)
    return has_continuous_starts_with_resources(problem) and not is_aging_fleet


def has_limits(problem: Problem) -> bool:
    """Whether battery, recorder or turns in motion limit plans, with starts of opportunities."""
    return not has_continuous_starts(problem) and (problem.use_resources or problem.turns_in_motion)


def at_rest(problem: Problem) -> Problem:
    """Return the problem with slews from rest to rest."""
    return replace(
        problem,
        satellites=tuple(
            replace(one, agility=replace(one.agility, slew_model="rest"))
            for one in problem.satellites
        ),
    )


def is_agility_only(problem: Problem) -> bool:
    """Whether agility alone counts, with starts of opportunities.

    Kept tasks need no further care only if precedence is transitive.
    """
    if problem.use_resources or problem.turns_in_motion or has_continuous_starts(problem):
        return False
    return not problem.pinned.kept or is_transitive(problem)


def is_agility_only_satellite(problem: Problem) -> bool:
    """Whether agility alone counts, and at most one satellite has opportunities."""
    return is_agility_only(problem) and not is_shared(problem)


def has_choice_of_starts(problem: Problem) -> bool:
    """Whether one satellite with agility alone may start at several times in an access."""
    return is_agility_only_satellite(problem) and problem.offers_choice


def has_one_start_each(problem: Problem) -> bool:
    """Whether one satellite with agility alone may start at one time only in each access."""
    return is_agility_only_satellite(problem) and not problem.offers_choice


def is_agility_only_fleet(problem: Problem) -> bool:
    """Whether agility alone counts, and several satellites have opportunities."""
    return is_agility_only(problem) and is_shared(problem)


def is_small_free_fleet(problem: Problem) -> bool:
    """Whether a fleet with agility alone is searched in streams, and ends with cutting planes."""
    return is_agility_only_fleet(problem) and len(problem.opportunities) <= TUNING.small_fleet


def is_small_free_fleet_with_choice(problem: Problem) -> bool:
    """Whether such a small fleet may start at several times in an access."""
    return is_small_free_fleet(problem) and problem.offers_choice


def is_large_free_fleet(problem: Problem) -> bool:
    """Whether a fleet with agility alone is too large for streams and cutting planes."""
    return is_agility_only_fleet(problem) and not is_small_free_fleet(problem)


def has_steady_worth(problem: Problem) -> bool:
    """Whether limits apply, and images are worth the same whenever they come down."""
    return has_limits(problem) and not has_half_life(problem)


def is_shared_with_limits(problem: Problem) -> bool:
    """Whether limits apply, worths are steady, and several satellites have opportunities."""
    return has_steady_worth(problem) and is_shared(problem)


def fits_a_program(problem: Problem) -> bool:
    """Whether a program of all images, with contacts fixed, takes seconds.

    With turns to the sun each pair of near tasks has a column. Contacts that are not taken have
    none: over 36 stations five satellites have 1,600 images among 5,900 opportunities.
    """
    most = TUNING.large if problem.turns_to_the_sun else TUNING.most_columns
    num_images = int(np.count_nonzero(problem.opportunities.kind == COLLECT))
    return has_steady_worth(problem) and num_images <= most


def is_small_and_shared(problem: Problem) -> bool:
    """Whether limits apply, worths are steady, and several satellites have few opportunities."""
    return is_shared_with_limits(problem) and not is_large(problem)


def is_alone_with_limits(problem: Problem) -> bool:
    """Whether limits apply, worths are steady, and at most one satellite has opportunities."""
    return has_steady_worth(problem) and not is_shared(problem)


def is_aging(problem: Problem) -> bool:
    """Whether limits apply, and images lose worth as they age."""
    return has_limits(problem) and has_half_life(problem)


def is_aging_alone(problem: Problem) -> bool:
    """Whether images age, and at most one satellite has opportunities."""
    return is_aging(problem) and not is_shared(problem)


def is_aging_but_no_fleet(problem: Problem) -> bool:
    """Whether images age, and one satellite has opportunities, or several have few."""
    return is_aging(problem) and not is_fleet(problem)


def is_aging_on_board(problem: Problem) -> bool:
    """Whether one satellite has many images that age but earn the larger part when taken."""
    is_many = len(problem.opportunities) > TUNING.open_tasks
    return is_aging_alone(problem) and is_many and problem.objective.collected_share > 0.5


def is_aging_in_programs(problem: Problem) -> bool:
    """Whether images age, and programs include by which contact each comes down."""
    return is_aging(problem) and not is_large(problem) and is_transitive(problem)


def is_shared_and_aging_in_programs(problem: Problem) -> bool:
    """Whether such programs apply to several satellites with few tasks."""
    is_small = len(problem.opportunities) <= TUNING.open_tasks
    return is_shared(problem) and is_small and is_aging_in_programs(problem)


def earns_on_board(problem: Problem) -> bool:
    """Whether images age but earn a share on board, and no whole program comes first."""
    is_asked = is_aging(problem) and is_transitive(problem)
    has_share = problem.objective.collected_share > 0.0
    return is_asked and has_share and not is_shared_and_aging_in_programs(problem)


def has_few_deliveries(problem: Problem) -> bool:
    """Whether a relaxation with columns for the contacts after each image takes a few seconds."""
    num_images = int(np.count_nonzero(problem.opportunities.kind == COLLECT))
    return num_images * NEXT_CONTACTS <= TUNING.most_relaxed


def is_within_reach(problem: Problem) -> bool:
    """Whether the whole program is worth trying as the last resort."""
    if has_continuous_starts(problem):
        return False
    if has_half_life(problem):
        return has_limits(problem) and not is_large(problem)
    return not (is_fleet(problem) if has_limits(problem) else is_agility_only(problem))
