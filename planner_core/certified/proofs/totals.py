r"""A bound from what a day's energy and downlink add up to, whatever the order of tasks.

For each satellite let images take :math:`T` seconds in all and contacts :math:`C`. At the
horizon's end the battery must be above its minimum and the recorder below its maximum, so

.. math::

    d_i T + d_c C &< b_0 - b_{min} + c \, \min(S, H - T - C) \\
    f T + t H - w C &< r_{max} - r_0 , \qquad C \le C_{max},

with the drains of images and contacts, the charge :math:`c` in at most :math:`S` sunlit seconds of
the :math:`H`, fill, telemetry and downlink. A battery that is full or a recorder that is empty
only wastes. The greatest :math:`T` of all satellites together is a knapsack for the targets.
Starts do not matter, so it holds for continuous ones too.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Problem,
    SatelliteProblem,
)


def totals_bound(problem: Problem) -> Bound | None:
    """Return the bound; None without resources or where they count by events."""
    if not problem.use_resources or problem.dynamics != "physical":
        return None
    table = problem.opportunities
    room_s = sum(_image_room_s(problem, satellite) for satellite in problem.satellites)
    collects = table.kind == COLLECT
    length_s = np.full(len(problem.target_ids), np.inf)
    np.minimum.at(length_s, table.place[collects], table.end_s[collects] - table.start_s[collects])
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
    contacts = satellite.kind == CONTACT
    most_s = float((satellite.end_s[contacts] - satellite.start_s[contacts]).sum())
    sunlit_s = float(satellite.sunlight.seconds_until(np.array([horizon_s]))[0])
    energy = r.initial_battery_fraction - r.battery_min_fraction
    data = r.recorder_max_fraction - r.initial_recorder_fraction - r.telemetry_per_s * horizon_s
    charge = r.sunpoint_charge_per_s

    def room_s(contact_s: float) -> float:
        rooms = [horizon_s]
        if r.collect_drain_per_s > 0.0:
            left = energy + charge * sunlit_s - r.contact_drain_per_s * contact_s
            rooms.append(left / r.collect_drain_per_s)
        if r.collect_drain_per_s + charge > 0.0:
            left = energy + charge * (horizon_s - contact_s) - r.contact_drain_per_s * contact_s
            rooms.append(left / (r.collect_drain_per_s + charge))
        if r.collect_fill_per_s > 0.0:
            rooms.append((data + r.downlink_per_s * contact_s) / r.collect_fill_per_s)
        return min(rooms)

    # Contacts make room on board and cost energy: the least of rising and falling lines.
    low_s, high_s = 0.0, most_s
    for _ in range(100):
        third_s = (high_s - low_s) / 3.0
        if room_s(low_s + third_s) < room_s(high_s - third_s):
            low_s += third_s
        else:
            high_s -= third_s
    ends = (low_s, high_s, 0.0, most_s)
    return max(0.0, *(room_s(s) for s in ends)) + 1e-6
