"""The walk of the rule-based planner (Alg. 4), compiled: the next task that resources allow.

The rule runs it from the start; other solvers let it finish what a spent budget cut short.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.jit import inlined, kernel
from planner_core.mdp.actions import next_action
from planner_core.mdp.resource_columns import take
from planner_core.mdp.track import NO_TASK, Track
from planner_core.problem import Bytes, Ints

CONTACT_ABOVE: Final = 0.45
"""The recorder level from which on a contact is worth its power. The paper's mission yields the
most images between 0.2 and 0.45, two satellites over cities with 36 stations from 0.4 on."""


def contact_above_metadata(note: str) -> dict[str, object]:
    """Return the API's metadata of a solver's ``contact_above_fraction``, with a note."""
    return {
        "minimum": 0,
        "maximum": 1,
        "description": "Take a contact only when the recorder is at least this full, or would "
        f"be full before the next contact. {note}",
    }


CODE_COLLECTS_BELOW: Final = 0.5
"""How full the recorder may be for a collect in the rule of the authors' code."""

NOTHING_TAKEN: Final[Ints] = np.empty(0, dtype=np.int32)


@inlined
def naive_select_action(
    track: Track,
    collected: Bytes,
    is_hard: bool,
    unimaged_only: bool,
    contact_above: float,
    cursor: int,
    last: int,
    battery: float,
    recorder: float,
    follows_code: bool = False,
) -> int:
    """Return the row that NAIVESELECTACTION takes next, or ``m`` when none is left.

    It sun-points through tasks that it refuses. The limits are those of the text (battery above its
    minimum, recorder not above its maximum) or, with ``follows_code``, of the authors' code
    (battery not empty, recorder not full, no collects from half full on). With ``is_hard`` the
    limits of the plan model apply as well.
    """
    m = len(track.start_s)
    row = cursor
    while row < m:
        row = next_action(
            track, last, row + 1, battery, recorder, is_hard, collected, unimaged_only,
            contact_above,
        )  # fmt: skip
        if row == m or not track.use_resources or row == track.next_kept[last + 1]:
            break
        battery_after, recorder_after, _ = take(track.resources, last, row, battery, recorder)
        if follows_code:
            if battery_after <= 0.0 or recorder_after >= 1.0:
                continue
            if not track.is_contact[row] and recorder >= CODE_COLLECTS_BELOW:
                continue
        elif (
            battery_after <= track.resources.battery_min
            or recorder_after > track.resources.recorder_max
        ):
            continue
        break
    return row


@kernel
def rule_plan(
    track: Track,
    collected: Bytes,
    is_hard: bool,
    unimaged_only: bool,
    contact_above: float,
    taken: Ints,
    follows_code: bool,
) -> Ints:
    """Return the rows that RULEBASEDPLANNER takes from the end of ``taken`` to the horizon's.

    Marks the targets it takes, and those of ``taken``, in ``collected``.
    """
    m = len(track.start_s)
    rows = np.empty(m, dtype=np.int32)
    count = 0
    last = NO_TASK
    battery, recorder = track.resources.battery_start, track.resources.recorder_start
    for row in taken:
        if track.use_resources:
            battery, recorder, _ = take(track.resources, last, row, battery, recorder)
        if not track.is_contact[row]:
            collected[track.site[row]] = 1
        last = row
    while True:
        row = naive_select_action(
            track, collected, is_hard, unimaged_only, contact_above,
            last, last, battery, recorder, follows_code,
        )  # fmt: skip
        if row == m:
            return rows[:count]
        if track.use_resources:
            battery, recorder, _ = take(track.resources, last, row, battery, recorder)
        if not track.is_contact[row]:
            collected[track.site[row]] = 1
        rows[count] = row
        count += 1
        last = row
