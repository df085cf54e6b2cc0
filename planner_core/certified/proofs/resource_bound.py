r"""An upper bound tightened by battery and recorder: multipliers and exact dynamic programmes.

As in ``planner_core.certified.proofs.lagrangian`` each target has a multiplier :math:`\lambda_i`,
and no plan earns more than :math:`\sum_i \lambda_i` plus what each satellite can gain where an
image of :math:`i` is worth :math:`r_i - \lambda_i`. Here the satellite's gain is the most that its
battery and its recorder allow, not only its agility. Worth is counted in whole units, rounded up,
so the bound holds for any unit; multipliers chosen to leave whole units lose nothing by it. If
satellites want the same antennas at the same time, antennas have multipliers too, which contacts
pay (``planner_core.precedence.antennas``).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.proofs.bound import Bound, is_optimal, reward_unit, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.satellite_relaxation import SatelliteRelaxation, relaxations
from planner_core.certified.sizes import MAX_CELLS, MAX_STEPS
from planner_core.certified.tolerances import ROUNDING
from planner_core.certified.tuning import TUNING
from planner_core.precedence.antennas import antenna_charges, paid_for_antennas
from planner_core.problem import COLLECT, Bytes, Floats, Ints, Problem
from planner_core.worth import common_unit, surplus, weights


def whole_worth(
    problem: Problem, multipliers: Floats, unit: float, antenna_multipliers: Floats | None = None
) -> Ints:
    """Return what each opportunity is worth at these multipliers, in units, rounded up.

    Contacts cost their antennas' multipliers (rounded down), or a unit more than all images are
    worth if that is less: no path pays that.
    """
    table = problem.opportunities
    is_collect = table.kind == COLLECT
    units = np.zeros(len(table), dtype=np.int32)
    multiplier = np.maximum(multipliers[table.site[is_collect]], 0.0)
    worth = weights(problem.worth[is_collect], multiplier)
    units[is_collect] = np.maximum(np.ceil(worth / unit - ROUNDING), 0.0)
    if antenna_multipliers is not None:
        charges = antenna_charges(problem, antenna_multipliers)
        most = int(units.sum(dtype=np.int64)) + 1
        units[~is_collect] = -np.minimum(np.floor(charges[~is_collect] / unit + ROUNDING), most)
    return units


def resource_value(
    problem: Problem,
    multipliers: Floats,
    unit: float,
    antenna_multipliers: Floats | None = None,
    *,
    level: float = -np.inf,
) -> float:
    """Return the bound that multipliers of targets, and of antennas if there are any, prove.

    This is the whole proof: it needs no search, only the problem. The bound holds however finely
    the recorder is counted; as neither of two finenesses is always better, the lower bound counts.

    Parameters
    ----------
    level
        A bound that suffices: if batteries alone prove it, recorders are left out.
    """
    fine, coarse = (relaxations(problem, levels) for levels in (TUNING.fine, TUNING.coarse))
    if antenna_multipliers is None:
        by_battery = _battery_value(problem, coarse, multipliers, unit)
        if rounded_bound(problem, by_battery, 0.0) <= level:
            return by_battery
    stop = np.zeros(1, dtype=np.uint8)
    return min(
        _value(problem, satellites, multipliers, unit, 0.0, stop, antenna_multipliers, twice=True)
        for satellites in (fine, coarse)
    )


def value_at(problem: Problem, multipliers: Floats, unit: float, enough: float) -> float:
    """Return the bound of ``resource_value`` with one fineness, or ``enough`` if that is more.

    The recorder is counted finely if there is only one satellite: its programme may stop early.
    """
    stop = np.zeros(1, dtype=np.uint8)
    is_alone = sum(len(s) > 0 for s in problem.satellites) == 1
    levels = TUNING.fine if is_alone else TUNING.coarse
    return _value(problem, relaxations(problem, levels), multipliers, unit, enough, stop)


def _value(
    problem: Problem,
    satellites: tuple[SatelliteRelaxation, ...],
    multipliers: Floats,
    unit: float,
    enough: float,
    stop: Bytes,
    antenna_multipliers: Floats | None = None,
    *,
    twice: bool = False,
) -> float:
    """Return the bound at these multipliers, or ``enough`` if that is more.

    Parameters
    ----------
    twice
        Whether to count again, now that the gain is known. Where images earn a share on board, the
        bound is lower the better the gain is known from the start, as searches know it.
    """
    multipliers = surplus(multipliers, problem.best_worth)
    worth = whole_worth(problem, multipliers, unit, antenna_multipliers)
    paid = float(multipliers.sum()) + paid_for_antennas(problem, antenna_multipliers)
    # Only a single satellite may stop early: of several, what the others gain is not yet known.
    units_enough = int(np.floor((enough - paid) / unit)) if len(satellites) == 1 else 0
    units = 0
    for satellite in satellites:
        most, _ = satellite.most(worth, unit, max(units_enough, 0), stop)
        if twice and satellite.shares is not None:
            most = min(most, satellite.most(worth, unit, 0, stop, near=most)[0])
        units += most
    rounded_away = ROUNDING * len(problem.opportunities) * unit
    return max(paid + units * unit + rounded_away, enough)


def quick_bound(problem: Problem, reward: float) -> Bound:
    """Return a cheap bound on any plan, by agility alone or by battery and recorder as well.

    Parameters
    ----------
    reward
        What a known plan earns: no bound can be lower.
    """
    best = lagrangian_bound(problem, reward)
    if is_optimal(reward, best.value, reward_unit(problem)):
        return best
    if problem.counts_delivery and problem.objective.half_life_s is not None:
        return _with_half_life(problem, best, reward)
    # If all images are worth the same and energy is short, multipliers of zero are best.
    is_plain = len(problem.satellites) == 1 and _is_alike(problem)
    satellites: tuple[SatelliteRelaxation, ...] = ()
    if problem.use_resources:
        is_quick = is_plain or len(problem.opportunities) <= TUNING.large
        satellites = relaxations(problem, TUNING.fine if is_quick else TUNING.coarse)
    if not satellites:
        return best
    stop = np.zeros(1, dtype=np.uint8)
    unit = _unit(problem, satellites, best.value)
    num_units = best.value / unit / len(satellites)
    is_large = num_units * max(satellite.num_near_steps for satellite in satellites) > MAX_STEPS
    start = np.zeros(1) if best.multipliers is None else best.multipliers
    offered = [
        leaving_whole_units(problem, share * start, unit) for share in TUNING.multiplier_shares
    ]
    # The bound by batteries alone takes a fraction of the time, and shows which are best.
    by_battery = partial(_battery_value, problem, satellites, unit=unit)
    offered = offered[:1] if is_plain else sorted(offered, key=by_battery)
    for multipliers in offered[: 1 if is_large else TUNING.tries]:
        if is_large:
            value = by_battery(multipliers)
        else:
            value = _value(problem, satellites, multipliers, unit, reward, stop)
        if value < best.value:
            rounded = rounded_bound(problem, value, reward)
            best = Bound(value=rounded, proof="dp", multipliers=multipliers, unit=unit)
    return best


def _with_half_life(problem: Problem, best: Bound, reward: float) -> Bound:
    """Return the bound by multipliers of contacts, which matter more here than recorders."""
    assert best.multipliers is not None
    num_rounds = TUNING.latency_work // max(1, len(problem.opportunities))
    num_rounds = int(np.clip(num_rounds, TUNING.tries, TUNING.rounds))
    ascent = LatencyAscent(problem, best.multipliers)
    ascent.improve(num_rounds, reward, np.zeros(1, dtype=np.uint8))
    bound = ascent.bound()
    value = rounded_bound(problem, bound.value, reward)
    return replace(bound, value=value) if value < best.value else best


def _battery_value(
    problem: Problem, satellites: tuple[SatelliteRelaxation, ...], multipliers: Floats, unit: float
) -> float:
    """Return the bound at these multipliers without recorders."""
    multipliers = surplus(multipliers, problem.best_worth)
    worth = whole_worth(problem, multipliers, unit)
    units = sum(s.most_by_battery(worth) for s in satellites)
    rounded_away = ROUNDING * len(problem.opportunities) * unit
    return float(multipliers.sum()) + units * unit + rounded_away


def _unit(problem: Problem, satellites: tuple[SatelliteRelaxation, ...], value: float) -> float:
    """Return a unit of worth that can be counted in good time: 1 if rewards are whole and few."""
    largest = max(len(s.satellite) for s in satellites)
    most_units = min(TUNING.max_units, MAX_CELLS // largest)
    if problem.reward_unit > 0.0 and value <= most_units:
        return 1.0
    whole = common_unit(problem.worth_on_ground)
    if whole > 0.0 and value <= most_units * whole:
        return whole / min(TUNING.several, most_units * whole // value)
    return max(value / most_units, 1e-12)


def leaving_whole_units(
    problem: Problem, multipliers: Floats, unit: float, typical: Floats | None = None
) -> Floats:
    """Return the nearest multipliers at which one image of each target is worth whole units.

    Other images of the target are rounded up, which costs the bound up to a unit for each that is
    taken: ``typical`` should be the image that plans take.

    Parameters
    ----------
    typical
        What that image earns; by default the target's best worth. Shape ``(num_targets,)``.
    """
    worth = problem.best_worth if typical is None else typical
    units = np.round((worth - multipliers) / unit)
    return np.clip(worth - units * unit, 0.0, problem.best_worth)


def _is_alike(problem: Problem) -> bool:
    """Return whether all images that can earn anything earn the same."""
    worth = problem.worth[problem.worth > 0.0]
    return len(worth) == 0 or bool(np.ptp(worth) == 0.0)
