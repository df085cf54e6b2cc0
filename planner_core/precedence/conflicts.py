"""Which tasks of a plan leave no room for another."""

from __future__ import annotations

from collections.abc import Collection

from planner_core.precedence.relation import excluded_by
from planner_core.problem import CONTACT, Problem
from planner_core.problem.slew import TIME_TOLERANCE_S


def conflicts(problem: Problem, row: int, taken: Collection[int]) -> list[int]:
    """Return which of these rows cannot stand beside ``row``: no time to turn, or no antenna."""
    table, local = problem.opportunities, problem.local_row
    satellite = int(table.satellite[row])
    excluded = excluded_by(problem.satellites[satellite], int(local[row]))
    found = [
        other
        for other in taken
        if other != row and table.satellite[other] == satellite and excluded[local[other]]
    ]
    if table.kind[row] == CONTACT:
        station = table.place[row]
        there = [
            other
            for other in taken
            if other != row
            and table.kind[other] == CONTACT
            and table.place[other] == station
            and table.start_s[other] < table.end_s[row] - TIME_TOLERANCE_S
            and table.end_s[other] > table.start_s[row] + TIME_TOLERANCE_S
        ]
        if len(there) >= problem.station_antennas[station]:
            found += [other for other in there if other not in found]
    return found
