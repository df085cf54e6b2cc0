"""What the opportunities of a scenario are worth.

This is kept apart from geometry: weather and rewards change, stored opportunities do not.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from planner_core.domain import Scenario
from planner_core.problem import COLLECT, Opportunities
from planner_core.worth import (
    clear_probability_of,
    quality_of,
    urgency_of,
    worth_of_collects,
)

Longs = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


def worth_of_opportunities(scenario: Scenario, table: Opportunities) -> Floats:
    """Return what each opportunity earns alone; contacts earn nothing.

    With continuous starts the sky is that of the opportunity, wherever in its access the collect
    begins: it hardly changes within minutes, and bounds stay valid.
    """
    target_reward = np.array([target.reward for target in scenario.targets], dtype=np.float64)
    collects = np.flatnonzero(table.kind == COLLECT)
    target = table.site[collects]
    worth = np.zeros(len(table))
    worth[collects] = worth_of_collects(
        target_reward,
        target,
        _urgency(scenario, target, table.start_s[collects]),
        quality_of(
            scenario.quality, table.off_nadir_deg[collects], table.sun_elevation_deg[collects]
        ),
        clear_probabilities(scenario, table, collects),
    )
    return worth


def clear_probabilities(scenario: Scenario, table: Opportunities, collects: Longs) -> Floats:
    """Return the probability of a clear sky at the middle of some collects of a table."""
    middle_s = 0.5 * (table.start_s[collects] + table.end_s[collects])
    return clear_probability_of(
        scenario.forecast, table.site[collects], middle_s, len(scenario.targets)
    )


def _urgency(scenario: Scenario, target: npt.NDArray[np.integer], start_s: Floats) -> Floats:
    """Return what is left of each collect's reward when it starts."""
    half_life_s = np.array([one.reward_half_life_s or np.inf for one in scenario.targets])
    asked_s = np.array(
        [
            0.0 if one.release is None else scenario.horizon.offset_s(one.release)
            for one in scenario.targets
        ]
    )
    return urgency_of(np.maximum(start_s - asked_s[target], 0.0), half_life_s[target])
