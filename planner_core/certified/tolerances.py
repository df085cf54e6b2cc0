"""What counts as equal: the rounding errors that bounds, plans and programs allow for.

None of them steers a search. Those of proofs lie above the errors of floating-point sums and far
below one reward; those of HiGHS are tolerances that its solutions keep to.
"""

from __future__ import annotations

from typing import Final

SAME: Final = 1e-6
"""Relative: rewards and bounds closer than this are equal, and a plan so close is optimal. Whole
rewards are recognized to this, and it is the tolerance of HiGHS in sums of zeros and ones."""

ROUNDING: Final = 1e-9
"""Relative: error of a sum of floats, of whole units, and of a recorder's or battery's capacity."""

WRITTEN: Final = 1e-8
"""Relative: how far a stored bound may be from what its multipliers prove."""

LEAST_BOUND: Final = 4e-9
"""Absolute tolerance of a bound if nearly nothing can be earned."""

NOTHING: Final = 1e-15
"""As a share of the largest worth: smaller steps of an ascent and worths of a program's columns
count as 0."""

ON_BOARD: Final = 3e-9
"""Share of a recorder's capacity that the referee forgives at the end."""

DOWN: Final = 2e-9
"""Share of a recorder's capacity by which an image may fall short of being down."""

DOWN_S: Final = 1e-5
"""How much earlier that may make the instant when an image is down."""

ROUNDED_S: Final = 1e-3
"""Starts are whole milliseconds."""

EARLIER_S: Final = 0.02
"""How much too early a guessed start is put, so that for most guesses no exact one is needed."""

LEVEL: Final = 1e-6
"""Share of a level by which tasks of "the same" length may differ."""

CHAINED: Final = 1e-9
"""Tolerance of HiGHS in a long chain of levels, where each row may be off by as much."""

TOUCHING: Final = -1e-9
"""How far beyond the limits plans of a program may be, so that its bound holds for those that touch
them."""

UNLIKE: Final = 1e-7
"""Relative: by how much the worths of a program are raised at most, each by a different amount, so
that their sums are not multiples of a unit. If they are, HiGHS rounds bounds to them, allowing only
for ``CHAINED``: a relaxation at 138.9999999991 became 138.9, though a plan has 139. HiGHS is also
faster if plans differ in worth: 24 missions of 60 to 150 targets take 21 s in all, and 104 s
without."""

NEARLY: Final = 0.5
"""Share of a unit of worth: HiGHS need not distinguish plans that are closer. ``UNLIKE`` adds less
for plans of up to five million units. Beyond that a unit is less than ``SAME``."""

INSIDE: Final = 1e-7
"""How far a program stays within the limits, so that the referee accepts its plans."""

TAKEN: Final = 1e-3
"""A relaxation takes a task if it takes more than this part of it; cuts must be as deep."""

WHOLE: Final = 1e-5
"""A relaxation's values closer than this to 0 or 1 count as whole."""

CLIQUE_BROKEN: Final = 1e-4
"""How far a relaxation must exceed a clique cut to violate it."""

ZERO_HALF_BROKEN: Final = 0.02
"""How far it must exceed a zero-half cut before the sum is halved."""

SLIGHT: Final = 1e-5
"""Share of a target's worth that tells equal plans apart and must not outweigh any worth."""

STAYS: Final = 1e6
"""Worth in typical targets: more than any window can earn."""
