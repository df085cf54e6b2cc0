"""Forecasts as CSV: a full grid, or values by target."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime
from functools import cache
from itertools import islice
from typing import Any, Final, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import TypeAdapter, ValidationError

from planner_core.errors import Fault
from service.files.records import NoTable, faults_of_header, open_table
from service.files.tables import Table
from service.forecasts.axes import fault_of_axes, unwrapped
from service.forecasts.fields import WHOLE, ByTarget, Field, Grid, time_ms_of
from service.problems.faults import refuse, refuse_one, require_none
from service.wire.base import Id, Instant

T = TypeVar("T")

_GRID: Final = ("time", "lat_deg", "lon_deg", "clear_probability")
_BY_TARGET: Final = ("target_id", "time", "clear_probability")
_IN_BOTH: Final = ("time", "clear_probability")
_MOST_FAULTS: Final = 100
_INSTANT: Final[TypeAdapter[datetime]] = TypeAdapter(Instant)
_ID: Final[TypeAdapter[str]] = TypeAdapter(Id)


def read_csv(data: bytes) -> tuple[Field, list[str]]:
    """Return the forecast in a file, and notes on how it was read.

    Raises
    ------
    ServiceError
        With the faults of the file, up to a hundred of them.
    """
    try:
        form, line, columns = open_table(data, _IN_BOTH)
    except NoTable as error:
        raise refuse([error.fault]) from None
    wanted = _BY_TARGET if "target_id" in columns else _GRID
    require_none(faults_of_header(line, columns, wanted, wanted))
    table = _Table(wanted, [columns.index(name) for name in wanted], form)
    for row in islice(form.rows, 1, None):
        table.add(row)
    if not table.faults and not table.lines:
        table.faults.append(
            Fault(code="empty_file", detail="The file has a header and no records.")
        )
    require_none(table.faults)
    field = _grid(table) if wanted is _GRID else _by_target(table)
    return field, [f"Probabilities are rounded to 1/{WHOLE:,}."]


class _Table:
    """The wanted cells, column by column, and the faults of the others."""

    def __init__(self, wanted: tuple[str, ...], positions: list[int], form: Table):
        self.columns: dict[str, list[Any]] = {name: [] for name in wanted}
        self.lines: list[int] = []
        self.faults: list[Fault] = []
        self._places = list(zip(wanted, positions, strict=True))
        self._read: dict[str, Callable[[str], Any]] = {
            # Many lines share few instants and targets.
            "time": cache(lambda cell: time_ms_of(_valid(_INSTANT, cell))),
            "target_id": cache(lambda cell: _valid(_ID, cell)),
            "lat_deg": lambda cell: _number(form.number(cell), -90.0, 90.0),
            "lon_deg": lambda cell: _number(form.number(cell), -180.0, 360.0),
            "clear_probability": lambda cell: _number(form.number(cell), 0.0, 1.0),
        }

    def add(self, row: tuple[int, list[str]] | Fault) -> None:
        if isinstance(row, Fault):
            self._blame(row)
            return
        line, cells = row
        values = []
        for name, position in self._places:
            try:
                values.append(self._read[name](cells[position].strip()))
            except IndexError:
                detail = f"The line has {len(cells)} cells: {name} is missing."
                self._blame(Fault(code="malformed_csv", detail=detail, row=line))
                return
            except ValueError as error:
                self._blame(Fault(code="invalid_value", detail=f"{name}: {error}", row=line))
                return
        self.lines.append(line)
        for (name, _), value in zip(self._places, values, strict=True):
            self.columns[name].append(value)

    def _blame(self, fault: Fault) -> None:
        self.faults.append(fault)
        if len(self.faults) == _MOST_FAULTS:
            raise refuse(self.faults)


def _valid(kind: TypeAdapter[T], cell: str) -> T:
    try:
        return kind.validate_python(cell)
    except ValidationError as error:
        raise ValueError(f"{error.errors()[0]['msg']}.") from None


def _number(cell: str, least: float, most: float) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise ValueError(f"{cell[:40]!r} is not a number.") from None
    if not (math.isfinite(value) and least <= value <= most):
        raise ValueError(f"{value:g} is not between {least:g} and {most:g}.")
    return value


def _shares(probabilities: npt.ArrayLike) -> npt.NDArray[np.uint16]:
    shares: npt.NDArray[np.uint16] = np.rint(np.asarray(probabilities) * WHOLE).astype(np.uint16)
    return shares


def _grid(table: _Table) -> Grid:
    names = ("time", "lat_deg", "lon_deg")
    axes, places = zip(
        *(np.unique(table.columns[name], return_inverse=True) for name in names), strict=True
    )
    shape = tuple(len(axis) for axis in axes)
    number = math.prod(shape)
    if (twice := _first_twice(places, shape)) is not None:
        detail = "This instant and position are given twice."
        raise refuse_one("invalid_value", detail, row=table.lines[twice])
    if number > len(table.lines):
        raise refuse_one(
            "invalid_value",
            f"The grid is not full: {shape[0]} instants, {shape[1]} latitudes and {shape[2]} "
            f"longitudes make {number} values, but there are {len(table.lines)}.",
        )
    if (fault := fault_of_axes(axes[1], axes[2])) is not None:
        raise refuse([fault])
    value = np.empty(shape, dtype=np.uint16)
    value[places] = _shares(table.columns["clear_probability"])
    lon_deg, value = unwrapped(axes[2], value)
    return Grid(axes[0].astype(np.int64), axes[1], lon_deg, value)


def _first_twice(places: tuple[Any, ...], shape: tuple[int, ...]) -> int | None:
    """Return which record repeats a grid point of an earlier one."""
    flat = np.ravel_multi_index(places, shape)
    _, first = np.unique(flat, return_index=True)
    if len(first) == len(flat):
        return None
    return int(np.setdiff1d(np.arange(len(flat)), first)[0])


def _by_target(table: _Table) -> ByTarget:
    ids, own = np.unique(np.array(table.columns["target_id"], dtype=object), return_inverse=True)
    time_ms = np.array(table.columns["time"], dtype=np.int64)
    order = np.lexsort((time_ms, own))
    own, time_ms = own[order], time_ms[order]
    again = np.flatnonzero((np.diff(own) == 0) & (np.diff(time_ms) == 0))
    if len(again):
        row = max(table.lines[order[again[0]]], table.lines[order[again[0] + 1]])
        detail = f"Target {ids[own[again[0]]]!r} has this instant twice."
        raise refuse_one("invalid_value", detail, row=row)
    return ByTarget(
        ids=tuple(ids.tolist()),
        first=np.searchsorted(own, np.arange(len(ids) + 1)).astype(np.int64),
        time_ms=time_ms,
        value=_shares(table.columns["clear_probability"])[order],
    )
