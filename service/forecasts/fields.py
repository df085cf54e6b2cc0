"""The content of an uploaded forecast: probabilities of a clear sky on a grid, or by target.

Instants are milliseconds since 1970, in UTC; probabilities are whole multiples of 1/10,000.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Final

import numpy as np
import numpy.typing as npt

Longs = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Shares = npt.NDArray[np.uint16]

WHOLE: Final = 10_000
"""Units per probability of 1."""
MISSING: Final = 65_535
"""Marks a missing value in a file."""
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_LEAST_DEG: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Skies:
    """Probabilities of clear skies over some targets at shared instants.

    Attributes
    ----------
    target
        Indices into the targets asked for. Shape ``(m,)``.
    time_ms
        Ascending. Shape ``(k,)``.
    clear_probability
        Shape ``(m, k)``.
    """

    target: Longs
    time_ms: Longs
    clear_probability: Floats


class _Timed:
    """Something with values at some instants."""

    __slots__ = ()
    time_ms: Longs

    @property
    def first_ms(self) -> int:
        """Return the first instant."""
        return int(self.time_ms.min())

    @property
    def last_ms(self) -> int:
        """Return the last instant."""
        return int(self.time_ms.max())


@dataclass(frozen=True, slots=True, eq=False)
class Grid(_Timed):
    """Values at every instant, latitude and longitude of a grid.

    Attributes
    ----------
    time_ms, lat_deg, lon_deg
        Ascending; longitudes span less than 360 degrees, with any first value.
    value
        In 1/``WHOLE`` or ``MISSING``. Shape ``(len(time_ms), len(lat_deg), len(lon_deg))``.
    """

    time_ms: Longs
    lat_deg: Floats
    lon_deg: Floats
    value: Shares

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return its content as arrays."""
        return {
            "time_ms": self.time_ms,
            "lat_deg": self.lat_deg,
            "lon_deg": self.lon_deg,
            "value": self.value,
        }

    def describe(self) -> dict[str, Any]:
        """Return its size and corners."""
        lat_deg, lon_deg = self.lat_deg, self.lon_deg
        return {
            "kind": "grid",
            "num_times": len(self.time_ms),
            "num_values": int(self.value.size),
            "lat_deg": [float(lat_deg[0]), float(lat_deg[-1])],
            "lon_deg": [float(lon_deg[0]), float(lon_deg[-1])],
        }

    def over(
        self, ids: Sequence[str], lat_deg: Floats, lon_deg: Floats, start_ms: int, end_ms: int
    ) -> list[Skies]:
        """Return the skies over targets, with bilinear interpolation between grid points."""
        span = within(self.time_ms, start_ms, end_ms)
        clear = self.at(lat_deg, lon_deg, span)
        known = np.flatnonzero(~np.isnan(clear).any(axis=1))
        time_ms = self.time_ms[span]
        return [Skies(known, time_ms, clear[known])] if len(known) and len(time_ms) else []

    def at(self, lat_deg: Floats, lon_deg: Floats, span: slice) -> Floats:
        """Return the probabilities over points, at the instants of a slice.

        A grid around the globe has no edge in longitude; if its last row is at most one step from a
        pole, that row's value holds up to the pole.

        Returns
        -------
        Shape ``(len(lat_deg), len(span))``; NaN outside the grid and next to missing values.
        """
        row, row_share = _cells(self.lat_deg, _up_to_the_poles(self.lat_deg, lat_deg))
        lon_axis, last = self.lon_deg, len(self.lon_deg)
        if goes_round(lon_axis):
            lon_axis = np.append(lon_axis, lon_axis[0] + 360.0)
        east_deg = lon_axis[0] + np.mod(lon_deg - lon_axis[0], 360.0)
        column, column_share = _cells(lon_axis, east_deg)
        clear = np.zeros((len(lat_deg), len(self.time_ms[span])))
        for down in (0, 1):
            for right in (0, 1):
                weight = np.abs(1 - down - row_share) * np.abs(1 - right - column_share)
                i = np.minimum(row + down, len(self.lat_deg) - 1)
                part = self.value[span][:, i, (column + right) % last].T
                value = np.where(part == MISSING, np.nan, part / WHOLE)
                clear += np.where(weight[:, np.newaxis] == 0.0, 0.0, weight[:, np.newaxis] * value)
        return np.clip(clear, 0.0, 1.0)


def goes_round(lon_deg: Floats) -> bool:
    """Return whether the grid's last column is adjacent to its first."""
    if len(lon_deg) < 2:
        return False
    step_deg = (lon_deg[-1] - lon_deg[0]) / (len(lon_deg) - 1)
    return bool(lon_deg[-1] - lon_deg[0] + 1.01 * step_deg >= 360.0)


def _up_to_the_poles(axis_deg: Floats, lat_deg: Floats) -> Floats:
    """Return latitudes, with those beyond a last row next to a pole moved to that row."""
    if len(axis_deg) < 2:
        return lat_deg
    near_south = axis_deg[0] + 90.0 <= axis_deg[1] - axis_deg[0]
    near_north = 90.0 - axis_deg[-1] <= axis_deg[-1] - axis_deg[-2]
    lowest = axis_deg[0] if near_south else -np.inf
    return np.clip(lat_deg, lowest, axis_deg[-1] if near_north else np.inf)


def _cells(axis_deg: Floats, at_deg: Floats) -> tuple[Longs, Floats]:
    """Return the grid point before each point, and its share of the step (NaN outside)."""
    last = len(axis_deg) - 1
    left = np.clip(np.searchsorted(axis_deg, at_deg, side="right") - 1, 0, max(last - 1, 0))
    step_deg = axis_deg[np.minimum(left + 1, last)] - axis_deg[left]
    away_deg = at_deg - axis_deg[left]
    share = np.where(step_deg > 0.0, away_deg / np.where(step_deg > 0.0, step_deg, 1.0), 0.0)
    inside = (at_deg >= axis_deg[0] - _LEAST_DEG) & (at_deg <= axis_deg[-1] + _LEAST_DEG)
    return left, np.where(inside, np.clip(share, 0.0, 1.0), np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class ByTarget(_Timed):
    """Values of each target at its own instants.

    Attributes
    ----------
    ids
        Ids of the targets.
    first
        Where each target's values begin, then where the last end. Shape ``(len(ids) + 1,)``.
    time_ms, value
        For all targets; instants ascend for each of them.
    """

    ids: tuple[str, ...]
    first: Longs
    time_ms: Longs
    value: Shares

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return its content as arrays."""
        ids = np.frombuffer(json.dumps(self.ids).encode(), dtype=np.uint8)
        return {"ids": ids, "first": self.first, "time_ms": self.time_ms, "value": self.value}

    def describe(self) -> dict[str, Any]:
        """Return its size."""
        return {
            "kind": "targets",
            "num_times": len(np.unique(self.time_ms)),
            "num_values": len(self.value),
            "num_targets": len(self.ids),
        }

    def over(
        self, ids: Sequence[str], lat_deg: Floats, lon_deg: Floats, start_ms: int, end_ms: int
    ) -> list[Skies]:
        """Return the skies over targets, grouped by targets with the same instants."""
        own = {target_id: number for number, target_id in enumerate(self.ids)}
        groups: dict[bytes, list[tuple[int, Shares]]] = {}
        for position, target_id in enumerate(ids):
            number = own.get(target_id)
            if number is None:
                continue
            rows = slice(int(self.first[number]), int(self.first[number + 1]))
            span = within(self.time_ms[rows], start_ms, end_ms)
            if times := self.time_ms[rows][span].tobytes():
                groups.setdefault(times, []).append((position, self.value[rows][span]))
        return [
            Skies(
                np.array([position for position, _ in members]),
                np.frombuffer(times, dtype=np.int64),
                np.array([value for _, value in members]) / WHOLE,
            )
            for times, members in groups.items()
        ]


Field = Grid | ByTarget
"""Either kind of forecast."""


def within(time_ms: Longs, start_ms: int, end_ms: int) -> slice:
    """Return the ascending instants needed for a time span: those in it, and one on each side."""
    if time_ms[-1] < start_ms or time_ms[0] > end_ms:
        return slice(0, 0)
    first = max(int(np.searchsorted(time_ms, start_ms, side="right")) - 1, 0)
    return slice(first, int(np.searchsorted(time_ms, end_ms, side="left")) + 1)


def time_ms_of(instant: datetime) -> int:
    """Return the milliseconds since 1970."""
    since = instant - _EPOCH
    return since.days * 86_400_000 + since.seconds * 1000 + since.microseconds // 1000


def instant_of(time_ms: int) -> datetime:
    """Return the instant this many milliseconds after 1970."""
    return _EPOCH + timedelta(milliseconds=time_ms)


def to_bytes(field: Field) -> bytes:
    """Return a compressed form that ``from_bytes`` reads back."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **field.columns())
    return buffer.getvalue()


def from_bytes(stored: bytes) -> Field:
    """Return what ``to_bytes`` stored."""
    with np.load(io.BytesIO(stored), allow_pickle=False) as columns:
        found: Mapping[str, npt.NDArray[Any]] = dict(columns)
    if "ids" not in found:
        return Grid(**found)
    ids = tuple(json.loads(found["ids"].tobytes()))
    return ByTarget(ids, found["first"], found["time_ms"], found["value"])


def sha256_of(field: Field) -> str:
    """Return a hash of a forecast's content, whatever file format it came in."""
    digest = hashlib.sha256()
    for name, values in field.columns().items():
        digest.update(f"{name} {values.dtype.str} {values.shape}\n".encode())
        digest.update(np.ascontiguousarray(values).data)
    return digest.hexdigest()
