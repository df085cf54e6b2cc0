"""Constants that steer the search of ``certified``: all that are neither sizes nor tolerances.

Whatever these values are, plans are judged by the referee and bounds are proven: they only decide
how soon both are good. ``python -m benchmarks.ablation --constants`` measures half and double of
each, in a row of docs/ablation.md under the name used here. Sizes of tables are in ``sizes``, and
what counts as equal is in ``tolerances``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """The constants of the search.

    Attributes
    ----------
    tries
        How often, or for how many, something is tried if more hardly pays: sets of contacts at a
        time, streams of a small fleet, programs without a better plan.
    several
        The same if each try takes next to no time: orders of elimination, contacts as the last.
    patience
        How many times in a row a search may find nothing better before it is done in another way.
    rounds
        Steps of a search that is to do more than a moment's work; levels of noise.
    fleet_patience
        Turns of a fleet's searches without a better plan before the solver ends; windows with
        continuous starts under resources.

    first_step_of_paths, first_step
        How far multipliers move in the first epoch, as a share of targets' worth: in an ascent on
        longest paths, or on chains in wide cells of start times; in any other ascent.
    last_step, last_step_of_few
        How far they move in the last epoch, as a share of that; the same if epochs are few.
    begin, begin_of_chains
        The initial multipliers, as a share of targets' worth; the same with continuous starts.
    newest_share
        Weight of an epoch's multipliers in the mean.
    moves_per_epoch
        How often multipliers move in an epoch, at most.
    epochs
        Epochs after which an ascent is settled; twice as many if a target is paid once in a pass.
    quick_nodes
        Nodes of a network that the quick bound may visit; a million take about 0.1 s.
    epochs_at_a_time, many_epochs
        Epochs between two checks of the budget and of other searches; if an epoch takes no time.

    deflection
        Share of the last direction in the next, in the ascent on exact programmes.
    shorter
        Factor by which steps are shortened when they no longer help.
    far_above
        Share of a bound: a plan or another bound that far away says little about the best plan.
    little
        Share of a bound, a gap, a goal, a step or noise: its smallest part that matters.
    worth_a_step
        Share of a bound that must be gained for (further) exact evaluations to be worth their time.
    levels_per_collect
        Levels of energy or worth in a typical collect, if tables are small; half as many if energy
        is an estimate.
    fine, coarse
        Levels of the recorder that the smallest collect fills: in proofs, and where many
        multipliers are tried; ``fine`` also of energy, when contacts are first named.
    units_per_reward
        Units in a typical target's worth in exact programmes, if many multipliers are tried.
    max_units
        Units of worth that a bound by exact programmes may count.
    multiplier_shares
        Shares of the multipliers by agility alone that are tried with resources.
    latency_work
        Opportunities times rounds of a quick bound if images lose worth as they age: a second.
    first_goal
        Share of the gain that the battery alone allows that an exact programme first aims for.

    widths_s
        The narrowest and the widest cells of start times.
    longest_piece_s
        Longest piece of a day that is bounded as a whole with continuous starts.
    tidy_s
        Seconds of an earlier start that outweigh a target in a label; clear time between pieces.
    beginning
        Share of time or moves for searches that others only begin with (also for plans of one
        satellite without its half-life), and for multipliers with a half-life at a time.

    window_tasks
        Tasks between which a window lies, at least and at most.
    aimed
        Share of moves that begin at an unassigned target.
    trials
        Draws to find such a target under resources, or a task that fits.
    tie
        Share of a target's worth by which equal targets are distinguished at random.
    trifle
        Share of a target's worth that counts as nothing.
    moves_at_a_time, moves_in_a_step
        Moves of the window search between two checks of the budget; the same under resources.
    moves_per_task
        Moves of the window search in a turn, for each task (``little`` of them beside an ascent on
        passes). Under resources, the most in a step.
    disturbance
        Largest share of a plan, or of multipliers, that a random move changes.

    near
        Share of a reward that a task may cost and yet be in the best plans.
    room, tight
        In typical targets: if the bound is less than ``room`` above the plan, the next image is
        hard to find, and is sought when multipliers get no lower (with half a target, 500 targets
        and turns to the sun: 26 CPU s for nothing, 1.25 % after 20 s instead of 0.42); two values
        within ``tight`` are the same. As a share of the bound by batteries alone: if it is more
        than ``tight`` above the plan, a fleet's recorders are full (docs/bounds.md).
    open_tasks
        Tasks of a program with fixed contacts, and of one replanned day, at first.
    more
        Factor by which more are offered if that finds nothing.
    tasks_per_task
        Tasks offered to a fleet's program at first, for each that the plan takes.
    large, small_fleet
        Opportunities above which steps with resources take long; up to which a fleet without
        resources is planned in streams and ends with cutting planes.
    dense
        Images of a satellite that turns to the sun above which whole days move them, not windows.
    most_columns, most_relaxed
        Tasks of a mixed-integer program, and of a relaxation without energy levels, at most.
    steps_beside
        Steps of the search for plans while another search has its turn.
    preference
        For targets of a large fleet that are hard to image, as a share of their worth.
    highs_nodes, highs_effort
        Nodes of a HiGHS search that only seeks plans, and its share of work on heuristics.
    max_cuts
        Zero-half cuts of a round.
    """

    tries: int = 2
    several: int = 4
    patience: int = 8
    rounds: int = 20
    fleet_patience: int = 60

    first_step_of_paths: float = 0.5
    first_step: float = 0.2
    last_step: float = 1e-3
    last_step_of_few: float = 0.05
    begin: float = 0.5
    begin_of_chains: float = 0.9
    newest_share: float = 0.15
    moves_per_epoch: int = 24
    epochs: int = 250
    quick_nodes: int = 6_000_000
    epochs_at_a_time: int = 10
    many_epochs: int = 100

    deflection: float = 0.3
    shorter: float = 0.6
    far_above: float = 0.2
    little: float = 0.01
    worth_a_step: float = 0.005
    units_per_reward: int = 48
    levels_per_collect: int = 24
    fine: int = 8
    coarse: int = 2
    max_units: int = 2000
    multiplier_shares: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)
    latency_work: int = 100_000
    first_goal: float = 0.95

    widths_s: tuple[float, float] = (2.5, 25.0)
    longest_piece_s: float = 15_000.0
    tidy_s: float = 60.0
    beginning: float = 0.25

    window_tasks: tuple[int, int] = (3, 14)
    aimed: float = 0.7
    trials: int = 100
    tie: float = 0.01
    trifle: float = 1e-3
    moves_at_a_time: int = 500
    moves_in_a_step: int = 250
    moves_per_task: float = 5.0
    disturbance: float = 0.3

    near: float = 0.2
    room: float = 1.5
    tight: float = 0.05
    open_tasks: int = 1000
    more: float = 1.5
    tasks_per_task: float = 2.0
    large: int = 3000
    small_fleet: int = 60_000
    dense: int = 2000
    most_columns: int = 6000
    most_relaxed: int = 12_000
    steps_beside: int = 6
    preference: float = 0.1
    highs_nodes: int = 100
    highs_effort: float = 0.2
    max_cuts: int = 150


TUNING: Final = Tuning()
"""The values in force. Kernels keep the values that they read when they were compiled."""


def tune(**changes: Any) -> None:
    """Use other values from now on, in all threads.

    Raises
    ------
    AttributeError
        If there is no such value.
    """
    for name, value in changes.items():
        getattr(TUNING, name)
        object.__setattr__(TUNING, name, value)


@contextmanager
def tuned(**changes: Any) -> Iterator[None]:
    """Use other values within the context, for measurements and tests."""
    before = {name: getattr(TUNING, name) for name in changes}
    try:
        tune(**changes)
        yield
    finally:
        tune(**before)
