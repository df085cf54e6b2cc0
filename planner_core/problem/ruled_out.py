"""Collects that are ruled out by pins, by outages or by a satellite's heading at the start."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from planner_core.problem.columns import Floats, Ints, Longs

Why = Literal["pin", "outage", "heading"]
PIN: Final = 0
OUTAGE: Final = 1
HEADING: Final = 2
_WHY: Final[tuple[Why, ...]] = ("pin", "outage", "heading")


@dataclass(frozen=True, slots=True, kw_only=True)
class RuledOut:
    """A collect that is ruled out.

    Attributes
    ----------
    row
        Row of the scenario's table; the problem no longer has it.
    kept
        Kept rows of the problem that exclude it; none if it is ruled out by itself.
    why
        A pin, an outage that it lies in, or a heading at the start from which its satellite
        cannot turn to it in time.
    """

    row: int
    satellite: int
    start_s: float
    end_s: float
    kept: tuple[int, ...] = ()
    why: Why = "pin"


@dataclass(frozen=True, kw_only=True, eq=False)
class RuledOutCollects(Mapping[int, tuple[RuledOut, ...]]):
    """All collects that are ruled out, by target; in columns, for a frozen half day has many.

    Attributes
    ----------
    target
        Ascending, as are the rows of each target. Shape ``(n,)``, as of all but ``kept``.
    why
        ``PIN``, ``OUTAGE`` or ``HEADING``.
    kept, first_kept
        Kept rows of the problem that exclude collect ``i``:
        ``kept[first_kept[i] : first_kept[i + 1]]``. Shape of the latter ``(n + 1,)``.
    """

    target: Ints
    row: Ints
    satellite: Ints
    start_s: Floats
    end_s: Floats
    why: npt.NDArray[np.int8]
    kept: Ints
    first_kept: Longs

    def __getitem__(self, target: int) -> tuple[RuledOut, ...]:
        """Return a target's ruled-out collects."""
        low, high = self.target.searchsorted([target, target + 1])
        if low == high:
            raise KeyError(target)
        return tuple(
            RuledOut(
                row=int(self.row[i]),
                satellite=int(self.satellite[i]),
                start_s=float(self.start_s[i]),
                end_s=float(self.end_s[i]),
                kept=tuple(self.kept[self.first_kept[i] : self.first_kept[i + 1]].tolist()),
                why=_WHY[self.why[i]],
            )
            for i in range(low, high)
        )

    def __iter__(self) -> Iterator[int]:
        """Return the targets."""
        return iter(np.unique(self.target).tolist())

    def __len__(self) -> int:
        """Return how many targets there are."""
        return len(np.unique(self.target))

    def placed(self, place: Longs) -> RuledOutCollects:
        """Return the same collects in terms of another problem.

        Parameters
        ----------
        place
            For each row of this problem its row in the other one; -1 if it has none.
        """
        moved = place[self.kept]
        num_left = np.concatenate([[0], np.cumsum(moved >= 0)])
        return replace(
            self,
            kept=moved[moved >= 0].astype(np.int32),
            first_kept=num_left[self.first_kept],
        )


def nothing_ruled_out() -> RuledOutCollects:
    """Return an empty table: nothing is ruled out."""
    ints, floats = np.empty(0, dtype=np.int32), np.empty(0)
    return RuledOutCollects(
        target=ints, row=ints, satellite=ints, start_s=floats, end_s=floats,
        why=np.empty(0, dtype=np.int8), kept=ints, first_kept=np.zeros(1, dtype=np.int64),
    )  # fmt: skip
