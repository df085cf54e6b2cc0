"""What counts as equal: the roundings that bounds, plans and programs allow for.

None of them steers a search. Those of proofs lie above what sums of floats lose and far below one
reward; those of HiGHS are what its solutions keep.
"""

from __future__ import annotations

from typing import Final

SAME: Final = 1e-6
"""Relative, of rewards and bounds: nearer ones are equal, and a plan so near is optimal. Whole
rewards are recognized to it, and HiGHS keeps to it in sums of zeros and ones."""

ROUNDING: Final = 1e-9
"""Relative, of a sum of floats, of whole units, and of a recorder's or battery's capacity."""

WRITTEN: Final = 1e-8
"""Relative: how far a bound that was written down may be from what its multipliers prove."""

LEAST_BOUND: Final = 4e-9
"""Of a bound where nearly nothing can be earned."""

NOTHING: Final = 1e-15
"""Of the most that a target is worth: no step of an ascent, and no column of a program, is worth
less."""

ON_BOARD: Final = 3e-9
"""Of a recorder's capacity, that the referee forgives at its end."""

DOWN: Final = 2e-9
"""Of a recorder's capacity, by which an image may fall short of being down."""

DOWN_S: Final = 1e-5
"""What that makes of the instant when an image is down."""

EARLIER_S: Final = 0.02
"""By how much a guessed arrival is put too early, so that most guesses need no exact one."""

LEVEL: Final = 1e-6
"""Of a level: tasks of "the same" length differ by as much."""

CHAINED: Final = 1e-9
"""Of HiGHS, in a long chain of levels, where each row may be off by as much."""

TOUCHING: Final = -1e-9
"""How far beyond the limits plans of a program may be, so that its bound holds for those that touch
them."""

UNLIKE: Final = 1e-7
"""Relative: by how much the worths of a program are raised at most, each by another amount, so that
sums are no multiples. Where they are HiGHS rounds bounds to them, and allows for ``CHAINED`` alone
in that: a relaxation at 138.9999999991 came to be 138.9, where a plan has 139. It also finds its
way sooner among plans that are not alike: 24 missions of 60 to 150 targets take 21 s in all,
and 104 s without."""

NEARLY: Final = 0.5
"""Of a unit of worth: HiGHS need not tell plans apart that are nearer than that. What ``UNLIKE``
adds is less, up to plans of five million units. From there on a unit is less than ``SAME``."""

INSIDE: Final = 1e-7
"""How far a program stays within the limits, so that the referee accepts its plans."""

TAKEN: Final = 1e-3
"""What a relaxation takes of a task at least, if it takes it; and how deep a cut must be."""

WHOLE: Final = 1e-5
"""Nearer than this to 0 or 1 what a relaxation takes is no fraction."""

CLIQUE_BROKEN: Final = 1e-4
"""By how much a relaxation breaks a clique cut, if it does."""

ZERO_HALF_BROKEN: Final = 0.02
"""By how much the sum of a zero-half cut, before it is halved."""

SLIGHT: Final = 1e-5
"""Of a target's worth: what tells equal plans apart and must not outweigh any worth."""

STAYS: Final = 1e6
"""Typical targets: more than any window can earn."""
