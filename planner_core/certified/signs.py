"""Numbers with a special meaning, for kernels that have no other way to express it."""

from __future__ import annotations

from typing import Final

UNASSIGNED: Final = -1
"""No task images the target."""
ELSEWHERE: Final = -2
"""Another satellite images the target."""
FIXED: Final = -3
"""Another satellite images the target, and must keep it."""

NO_TASK: Final = -1
AT_START: Final = -1
"""A path that has no task yet."""
NOWHERE: Final = -2
"""There is no path, or none as good."""

UNREACHED: Final = -1
"""No path reaches the goal."""
STOPPED: Final = -2
"""The search was stopped before it was known whether a path reaches the goal."""

FROM_START: Final = -1
"""The instant before all others."""

NEVER: Final = float("-inf")
"""Gain of a task that cannot be taken, or has been passed."""

ANY_LEVEL: Final = 2.0
"""A limit of twice the capacity: none."""

ANYWHERE: Final = -2
"""Instead of the contact that a path took last: any contact, or none."""

UNREACHED_UNITS: Final = -(2**30)
"""Worth where there is no path: below 0 even with ``sizes.MAX_UNITS`` added."""

PLENTY_UNITS: Final = 2**30
"""More units than any path gains."""

UNKNOWN_UNITS: Final = -2
"""Units that have not been computed."""
