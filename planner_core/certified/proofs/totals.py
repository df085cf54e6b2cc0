r"""A bound from the horizon's totals of energy and downlink, whatever the order of tasks.

For each satellite let images take :math:`T` seconds in all and contacts :math:`C`. At the
horizon's end the battery must be above its minimum and the recorder below its maximum, so

.. math::

    d_i T + d_c C &< b_0 - b_{min} + c \, \min(S, H - T - C) \\
    f T + t H - W(C) &< r_{max} - r_0 , \qquad C \le C_{max},

with the drains of images and contacts, the charge :math:`c` in at most :math:`S` sunlit seconds of
the :math:`H`, fill, telemetry, and the most :math:`W` that so many seconds of contacts take down:
the passes one after another, those with the highest rate first. A full battery or an empty recorder
only wastes charge or contact time. The greatest :math:`T` of all satellites add up to the capacity
of a knapsack of targets. Starts do not matter, so the bound holds for continuous ones too.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Floats,
    Problem,
    SatelliteProblem,
)


def totals_bound(problem: Problem) -> Bound | None:
    """Return the bound; None without resources, or in dynamics other than ``physical``."""
    if not problem.use_resources or problem.dynamics != "physical":
        return None
    table = problem.opportunities
    room_s = sum(_image_room_s(problem, satellite) for satellite in problem.satellites)
    collects = table.kind == COLLECT
    length_s = np.full(len(problem.target_ids), np.inf)
    np.minimum.at(length_s, table.site[collects], table.end_s[collects] - table.start_s[collects])
    offered = np.flatnonzero(np.isfinite(length_s))
    worth_per_s = problem.best_worth[offered] / length_s[offered]
    value = 0.0
    for target in offered[np.argsort(-worth_per_s, kind="stable")].tolist():
        share = min(1.0, room_s / length_s[target])
        value += share * float(problem.best_worth[target])
        room_s -= share * length_s[target]
        if room_s <= 0.0:
            break
    return Bound(value=rounded_bound(problem, value, 0.0), proof="totals")


def _image_room_s(problem: Problem, satellite: SatelliteProblem) -> float:
    """Return the most seconds of images that a satellite's battery and recorder allow."""
    r, horizon_s = satellite.resources, problem.horizon_s
    contact_s, down = _most_down(problem, satellite)
    most_s = float(contact_s[-1])
    sunlit_s = float(satellite.sunlight.seconds_until(np.array([horizon_s]))[0])
    energy = r.initial_battery_fraction - r.battery_min_fraction
    data = r.recorder_max_fraction - r.initial_recorder_fraction - r.telemetry_per_s * horizon_s
    charge = r.sunpoint_charge_per_s

    def room_s(used_s: float) -> float:
        rooms = [horizon_s]
        if r.collect_drain_per_s > 0.0:
            left = energy + charge * sunlit_s - r.contact_drain_per_s * used_s
            rooms.append(left / r.collect_drain_per_s)
        if r.collect_drain_per_s + charge > 0.0:
            left = energy + charge * (horizon_s - used_s) - r.contact_drain_per_s * used_s
            rooms.append(left / (r.collect_drain_per_s + charge))
        if r.collect_fill_per_s > 0.0:
            rooms.append((data + float(np.interp(used_s, contact_s, down))) / r.collect_fill_per_s)
        return min(rooms)

    # Contacts free the recorder and cost energy: the minimum of these limits is concave.
    low_s, high_s = 0.0, most_s
    for _ in range(100):
        third_s = (high_s - low_s) / 3.0
        if room_s(low_s + third_s) < room_s(high_s - third_s):
            low_s += third_s
        else:
            high_s -= third_s
    ends = (low_s, high_s, 0.0, most_s)
    return max(0.0, *(room_s(s) for s in ends)) + 1e-6


def _most_down(problem: Problem, satellite: SatelliteProblem) -> tuple[Floats, Floats]:
    """Return seconds of contacts, ascending, and the most data that so many seconds take down.

    Only one of the contacts that an access offers is taken. It takes down no more than the one
    with the largest volume, and no faster than the fastest.
    """
    contacts = np.flatnonzero(satellite.kind == CONTACT)
    volume, length_s = satellite.volume[contacts], (satellite.end_s - satellite.start_s)[contacts]
    access = problem.opportunities.access[satellite.rows[contacts]]
    _, group = np.unique(access, return_inverse=True)
    most, fastest = np.zeros(2 * len(contacts)).reshape(2, -1)
    np.maximum.at(most, group, volume)
    np.maximum.at(fastest, group, volume / length_s)
    used = np.flatnonzero(fastest > 0.0)
    used = used[np.argsort(-fastest[used], kind="stable")]
    contact_s = np.concatenate([[0.0], np.cumsum(most[used] / fastest[used])])
    return contact_s, np.concatenate([[0.0], np.cumsum(most[used])])
