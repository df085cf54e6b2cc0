"""A mixed-integer linear program as plain arrays, gathered block by block."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from planner_core.certified.tolerances import UNLIKE
from planner_core.problem import Bools, Floats, Ints


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Constraints ``lower <= sum of value * column <= upper``, with entries in order of row.

    Attributes
    ----------
    first
        Where each row's entries begin. Shape ``(num_rows,)``.
    column, value
        Shape ``(num_entries,)``.
    lower, upper
        Shape ``(num_rows,)``.
    """

    first: Ints
    column: Ints
    value: Floats
    lower: Floats
    upper: Floats

    @classmethod
    def of(
        cls,
        offsets: npt.NDArray[np.int64],
        column: npt.NDArray[np.integer],
        value: Floats | float = 1.0,
        *,
        lower: Floats | float = -np.inf,
        upper: Floats | float = np.inf,
    ) -> Rows:
        """Return rows from offsets of shape ``(num_rows + 1,)``; scalars hold for all of them."""
        num_rows = len(offsets) - 1
        return cls(
            first=offsets[:-1].astype(np.int32),
            column=column.astype(np.int32),
            value=np.broadcast_to(np.asarray(value, dtype=np.float64), column.shape).copy(),
            lower=np.broadcast_to(np.asarray(lower, dtype=np.float64), (num_rows,)).copy(),
            upper=np.broadcast_to(np.asarray(upper, dtype=np.float64), (num_rows,)).copy(),
        )

    @classmethod
    def aligned(
        cls,
        *terms: tuple[npt.NDArray[np.integer], Floats | float],
        lower: Floats | float = -np.inf,
        upper: Floats | float = np.inf,
    ) -> Rows:
        """Return one row for each column of a term: row i sums the i-th column of every term."""
        num_rows = len(terms[0][0])
        column = np.column_stack([columns for columns, _ in terms]).ravel()
        values = [np.broadcast_to(np.asarray(v, dtype=np.float64), (num_rows,)) for _, v in terms]
        value = np.column_stack(values).ravel()
        offsets = np.arange(num_rows + 1, dtype=np.int64) * len(terms)
        return cls.of(offsets, column, value, lower=lower, upper=upper)

    @classmethod
    def at_most(cls, groups: Sequence[Iterable[int]], limits: Sequence[float]) -> Rows:
        """Return one row for each group of columns, which limits their sum."""
        members = [np.fromiter(group, dtype=np.int32) for group in groups]
        offsets = np.concatenate([[0], np.cumsum([len(group) for group in members])])
        column = np.concatenate([np.empty(0, dtype=np.int32), *members])
        return cls.of(offsets.astype(np.int64), column, upper=np.array(limits, dtype=np.float64))

    @classmethod
    def no_more_than(cls, columns: Ints, others: Ints, offsets: npt.NDArray[np.int64]) -> Rows:
        """Return rows that limit each column to the sum of its group of others."""
        column = np.insert(others, offsets[1:], columns)
        value = np.insert(np.full(len(others), -1.0), offsets[1:], 1.0)
        return cls.of(offsets + np.arange(len(offsets)), column, value, upper=0.0)

    @classmethod
    def limited(cls, columns: Ints, values: Floats, group: Ints, limit: Ints, most: Floats) -> Rows:
        """Return rows that limit each group's sum of ``value * column`` by a multiple of a column.

        Parameters
        ----------
        group
            Of each column. Shape ``(num_columns,)``.
        limit, most
            The column that limits each group, and its factor. Shape ``(num_groups,)``.
        """
        order = np.argsort(group, kind="stable")
        groups, counts = np.unique(group, return_counts=True)
        ends = np.cumsum(counts)
        return cls.of(
            np.concatenate([[0], np.cumsum(counts + 1)]).astype(np.int64),
            np.insert(columns[order], ends, limit[groups]),
            np.insert(values[order], ends, -most[groups]),
            upper=0.0,
        )

    def __len__(self) -> int:
        return len(self.first)


@dataclass(slots=True, eq=False)
class Program:
    """Maximise the sum of ``worth * column`` within bounds and rows.

    Attributes
    ----------
    most
        The upper limits, and instead of infinite ones those that rows imply: the dual function
        needs limits. Given to HiGHS they lead it to other corners, from which the paper's missions
        with a share on board come within 2 % a quarter later.
    """

    worth: list[Floats] = field(default_factory=list)
    lower: list[Floats] = field(default_factory=list)
    upper: list[Floats] = field(default_factory=list)
    most: list[Floats] = field(default_factory=list)
    is_integer: list[Bools] = field(default_factory=list)
    rows: list[Rows] = field(default_factory=list)
    num_columns: int = 0

    def add_columns(
        self,
        worth: Floats,
        *,
        lower: Floats | float = 0.0,
        upper: Floats | float = 1.0,
        most: Floats | float | None = None,
        is_integer: bool = True,
    ) -> Ints:
        """Add one column for each worth; return their numbers."""
        n = len(worth)
        self.worth.append(worth)
        self.lower.append(np.broadcast_to(np.asarray(lower, dtype=np.float64), (n,)))
        self.upper.append(np.broadcast_to(np.asarray(upper, dtype=np.float64), (n,)))
        self.most.append(np.broadcast_to(np.asarray(upper if most is None else most), (n,)))
        self.is_integer.append(np.full(n, is_integer))
        self.num_columns += n
        return np.arange(self.num_columns - n, self.num_columns, dtype=np.int32)

    @property
    def num_rows(self) -> int:
        """How many constraints there are."""
        return sum(map(len, self.rows))

    def tell_apart(self) -> None:
        """Raise each worth by a tiny amount of its own: bounds hold, and sums are no multiples."""
        worth = np.concatenate(self.worth)
        self.worth = [worth * (1.0 + UNLIKE * np.random.default_rng(0).random(len(worth)))]

    def dual_value(self, multipliers: Floats) -> float:
        """Return what no point is worth more than, by Lagrangian multipliers of all rows.

        One above 0 is that of its row's upper limit, one below 0 that of the lower limit. If there
        is no such limit, it counts as 0. Any multipliers give a bound (weak duality).

        Parameters
        ----------
        multipliers
            One for each row, in the order in which rows were added.
        """
        worth, lower, most = map(np.concatenate, (self.worth, self.lower, self.most))
        paid, total, at = np.zeros(len(worth)), 0.0, 0
        for rows in self.rows:
            own = multipliers[at : at + len(rows)]
            at += len(rows)
            limit = np.where(own > 0.0, rows.upper, rows.lower)
            own, limit = np.where(np.isfinite(limit), (own, limit), 0.0)
            total += float(own @ limit)
            num_entries = np.diff(np.append(rows.first, len(rows.column)))
            entries = np.repeat(own, num_entries) * rows.value
            paid += np.bincount(rows.column, weights=entries, minlength=len(paid))
        left = worth - paid
        is_used = left != 0.0
        return total + float((left * np.where(left > 0.0, most, lower))[is_used].sum())

    def add_rows(self, rows: Rows) -> None:
        """Add constraints, if there are any."""
        if len(rows):
            self.rows.append(rows)
