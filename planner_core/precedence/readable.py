"""Longest paths over a skyline in plain Python: the reference for the compiled passes.

``skyline`` and ``network`` do the same with labels in arrays, parts, and a table of slews.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from planner_core.problem import Floats, Transitions, may_follow
from planner_core.problem.slew import TIME_TOLERANCE_S, angle_between_deg, slew_s


def heaviest_to_each(transitions: Transitions, weight: Floats) -> Floats:
    """Return the weight of the heaviest path that ends with each task of one satellite.

    Shape ``(m,)``.

    Parameters
    ----------
    weight
        Worth of each task, not negative. Shape ``(m,)``.
    """
    start_s, end_s, slews = transitions.start_s, transitions.end_s, transitions.slews
    waiting = deque(np.lexsort((start_s, end_s)).tolist())
    labels: list[int] = []  # tasks
    value = np.zeros(len(weight))

    def has_turned(a: int, c: int) -> bool:
        angle_deg = angle_between_deg(tuple(transitions.looked[a]), tuple(transitions.looked[c]))
        needed_s = slew_s(angle_deg, slews.rate_deg_s, slews.acceleration_deg_s2)
        return bool(needed_s < end_s[c] - end_s[a])

    for b in range(len(weight)):
        while waiting and waiting[0] < b and end_s[waiting[0]] <= start_s[b] + TIME_TOLERANCE_S:
            c = waiting.popleft()
            if not any(value[a] >= value[c] and has_turned(a, c) for a in labels):
                labels.append(c)
        ahead = [value[a] for a in labels if may_follow(transitions, a, b)]
        value[b] = weight[b] + max(ahead, default=0.0)
    return value
