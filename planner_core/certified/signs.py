"""Numbers that stand for something, where kernels have no other way to say it."""

from __future__ import annotations

from typing import Final

UNASSIGNED: Final = -1
"""No task images the target."""
ELSEWHERE: Final = -2
"""Another satellite images the target."""
FIXED: Final = -3
"""Another satellite must keep it."""

NO_TASK: Final = -1
AT_START: Final = -1
"""A path that has no task yet."""
NOWHERE: Final = -2
"""There is no path, or none as good."""

UNREACHED: Final = -1
"""No path is worth the goal."""
STOPPED: Final = -2
"""The budget was spent before that was known."""

FROM_START: Final = -1
"""The instant before all others."""

NEVER: Final = float("-inf")
"""Gain of what cannot be taken, or has been passed."""

ANY_LEVEL: Final = 2.0
"""Of capacity: no limit."""

ANYWHERE: Final = -2
"""In place of the contact that a path has taken last: any of them, or none."""

UNREACHED_UNITS: Final = -(2**30)
"""Instead of units that add up to fewer than ``sizes.MAX_UNITS``: below 0 with those too."""

PLENTY_UNITS: Final = 2**30
"""Units that suffice for anything: more than any path gains."""

UNKNOWN_UNITS: Final = -2
"""Units that were not worked out."""
