r"""A bound on images by energy alone, where resources count.

Over the horizon :math:`H` a battery gives what it holds above its minimum and at most the
charge :math:`c H`. An image of :math:`\tau` seconds takes :math:`u \tau`; where the battery is
integrated over time it also takes :math:`c \tau` of charging. So the number of images is below
:math:`(p_0 - p_{\min} + c H) / u \tau`, or with :math:`(u + c) \tau` below the line. Contacts,
full batteries and slews only take more.
"""

from __future__ import annotations

import math

import numpy as np

from planner_core.problem import COLLECT, Problem

_ROUNDING = 1e-9


def energy_bound(problem: Problem) -> float:
    """Return how much reward the energy of all satellites can buy, infinite without resources."""
    table = problem.opportunities
    is_collect = table.kind == COLLECT
    if not problem.use_resources or not is_collect.any():
        return math.inf
    shortest_s = float(np.min((table.end_s - table.start_s)[is_collect]))
    images = 0
    for satellite in problem.satellites:
        r = satellite.resources
        charge_per_s = r.sunpoint_charge_per_s
        cost_per_s = r.collect_drain_per_s
        if problem.dynamics == "physical":
            cost_per_s += charge_per_s
        held = r.initial_battery_fraction - r.battery_min_fraction
        energy = held + charge_per_s * problem.horizon_s
        images += math.floor(energy / (cost_per_s * shortest_s) + _ROUNDING)
    return images * float(np.max(problem.target_reward))
