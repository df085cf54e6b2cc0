"""Forecasts as NetCDF 4 with CF axes.

Files come from outside, and HDF5 can refer to other files of the machine that reads it: whatever
is not plain data of the file itself is refused before anything is read.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any, Final

import h5netcdf
import h5py
import numpy as np
import numpy.typing as npt

from service.forecasts.axes import fault_of_axes, unwrapped
from service.forecasts.fields import MISSING, WHOLE, Floats, Grid, Longs, time_ms_of
from service.problems.faults import refuse, refuse_one
from service.problems.kinds import ServiceError

MOST_VALUES: Final = 20_000_000
"""Of a grid that is kept, and of one field at one instant."""
_MOST_READ: Final = 400_000_000
"""Values of all members together."""
_MOST_CHUNK_BYTES: Final = 256_000_000
_ROUNDING: Final = 0.01
"""By how much packed values may lie outside 0 to 1."""

_AXES: Final = {
    "time": ("time", "valid_time"),
    "lat": ("latitude", "lat"),
    "lon": ("longitude", "lon"),
    "member": ("realization", "member", "number", "ensemble", "ensemble_member"),
}
_CLEAR: Final = ("clear_probability",)
_COVER: Final = ("tcc", "clt", "tcdc", "cloud_area_fraction", "total_cloud_cover")
_UNITS_S: Final = {"second": 1.0, "sec": 1.0, "s": 1.0, "minute": 60.0, "min": 60.0, "hour": 3600.0,
                   "hr": 3600.0, "h": 3600.0, "day": 86400.0, "d": 86400.0}  # fmt: skip
_SINCE: Final = re.compile(
    r"\s*(\w+)\s+since\s+(\d{4})-(\d{1,2})-(\d{1,2})"
    r"(?:[T ]\s*(\d{1,2}):(\d{1,2})(?::(\d{1,2})(?:\.0*)?)?)?\s*(?:UTC|GMT|Z|\+?00:?00)?\s*",
    re.IGNORECASE,
)
_BROKEN: Final = (
    ArithmeticError, AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError,
)  # fmt: skip
"""What libraries raise that meet a broken file."""
_CALENDARS: Final = ("standard", "gregorian", "proleptic_gregorian")


def read_netcdf(data: bytes) -> tuple[Grid, list[str]]:
    """Return what a file says, and notes on how it became probabilities.

    Raises
    ------
    ServiceError
        ``malformed_netcdf``, with what is wrong.
    """
    if data[:3] == b"CDF":
        raise _refused("This is a classic NetCDF file; convert it with nccopy -k nc4 in.nc out.nc.")
    try:
        with h5py.File(io.BytesIO(data), "r") as plain:
            _require_plain(plain)
        with h5netcdf.File(
            io.BytesIO(data), "r", decode_vlen_strings=True, rdcc_nbytes=_MOST_CHUNK_BYTES
        ) as file:
            return _Reading(file).grid()
    except ServiceError:
        raise
    except _BROKEN as error:
        raise _refused(f"The file cannot be read as NetCDF 4: {str(error)[:200]}") from None


def _refused(detail: str) -> ServiceError:
    return refuse_one("malformed_netcdf", detail)


def _require_plain(file: h5py.File) -> None:
    for name in file:
        if not isinstance(file.get(name, getlink=True), h5py.HardLink):
            raise _refused(f"{name[:100]!r} is a link; the file must contain its data itself.")
        item = file[name]
        if isinstance(item, h5py.Group):
            raise _refused(f"{name[:100]!r} is a group; variables must be at the top level.")
        if isinstance(item, h5py.Dataset) and (item.is_virtual or item.external):
            raise _refused(f"The data of {name[:100]!r} lie in another file.")
        chunk = getattr(item, "chunks", None)
        if chunk and math.prod(chunk) * item.dtype.itemsize > _MOST_CHUNK_BYTES:
            raise _refused(f"The chunks of {name[:100]!r} are too large; write it in smaller ones.")


class _Reading:
    """One open file."""

    def __init__(self, file: h5netcdf.File):
        self._file = file
        self._is_cover, self._name = self._find_values()
        self._variable = file.variables[self._name]
        self._axis_of = {what: self._find_axis(what) for what in _AXES}
        for what in ("time", "lat", "lon"):
            if self._axis_of[what] is None:
                words = {"lat": "latitude", "lon": "longitude"}.get(what, what)
                raise _refused(f"Variable {self._name!r} has no axis of {words}.")

    def grid(self) -> tuple[Grid, list[str]]:
        """Return the grid, its axes ascending."""
        shape = dict(zip(self._variable.dimensions, self._variable.shape, strict=True))
        self._check_size(shape)
        time_ms, by_time = self._ascending(self._times_ms())
        lat_deg, by_lat = self._ascending(self._coordinate("lat"))
        lon_deg, by_lon = self._ascending(self._coordinate("lon"))
        if (fault := fault_of_axes(lat_deg, lon_deg)) is not None:
            raise refuse([fault])
        value = np.empty((len(time_ms), len(lat_deg), len(lon_deg)), dtype=np.uint16)
        for number, at in enumerate(by_time.tolist()):
            value[number] = self._clear_at(at)[by_lat][:, by_lon]
        lon_deg, value = unwrapped(lon_deg, value)
        return Grid(time_ms, lat_deg, lon_deg, value), self._notes(shape)

    def _find_values(self) -> tuple[bool, str]:
        """Return whether the file has cloud cover, and which variable it is."""
        for is_cover, names in ((False, _CLEAR), (True, _COVER)):
            for name, variable in self._file.variables.items():
                words = (name.lower(), str(variable.attrs.get("standard_name", "")).lower())
                if any(word in names for word in words) and variable.ndim >= 3:
                    return is_cover, name
        known = ", ".join(self._file.variables)[:200]
        raise _refused(
            "There is no variable clear_probability, tcc or cloud_area_fraction over time, "
            f"latitude and longitude; there are {known or 'none'}."
        )

    def _find_axis(self, what: str) -> str | None:
        for name in self._variable.dimensions:
            variable = self._file.variables.get(name)
            told = "" if variable is None else str(variable.attrs.get("standard_name", ""))
            if name.lower() in _AXES[what] or told.lower() in _AXES[what]:
                return str(name)
        return None

    def _check_size(self, shape: Mapping[str, int]) -> None:
        for name, size in shape.items():
            if size == 0:
                raise _refused(f"The axis {name!r} is empty.")
            if name not in self._axis_of.values() and size > 1:
                raise _refused(f"It is not clear what the axis {name!r} means.")
        member = self._axis_of["member"]
        number = math.prod(shape.values())
        kept = number // (shape[member] if member else 1)
        if kept > MOST_VALUES or number > _MOST_READ:
            raise _refused(
                f"The file has {kept} values; the limit is {MOST_VALUES}. Cut it to the region and "
                "the days that are planned."
            )

    def _coordinate(self, what: str) -> Floats:
        name = self._axis_of[what]
        variable = self._file.variables.get(name)
        if variable is None or variable.ndim != 1:
            raise _refused(f"The axis {name!r} has no coordinates.")
        values = np.asarray(variable[...], dtype=np.float64)
        if not np.all(np.isfinite(values)):
            raise _refused(f"The axis {name!r} has values that are not numbers.")
        return values

    def _ascending(self, values: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], Longs]:
        order = np.argsort(values, kind="stable")
        if np.any(np.diff(values[order]) == 0):
            raise _refused("An axis names the same value twice.")
        return values[order], order

    def _times_ms(self) -> Longs:
        name = self._axis_of["time"]
        attributes = self._file.variables[name].attrs if name in self._file.variables else {}
        calendar = str(attributes.get("calendar", "standard")).lower()
        units = str(attributes.get("units", ""))
        found = _SINCE.fullmatch(units)
        unit = found.group(1).lower() if found else ""
        unit_s = _UNITS_S.get(unit) or _UNITS_S.get(unit.removesuffix("s"))
        if found is None or unit_s is None or calendar not in _CALENDARS:
            raise _refused(
                "The units of time must be like 'hours since 2026-01-31 00:00', in the standard "
                f"calendar; they are {units[:100]!r}, {calendar[:40]!r}."
            )
        try:
            origin = datetime(*(int(part or 0) for part in found.groups()[1:]), tzinfo=UTC)  # type: ignore[arg-type, misc]
            ends = self._coordinate("time") * unit_s
            for offset_s in (float(ends.min()), float(ends.max())):
                origin + timedelta(seconds=offset_s)
        except (ValueError, OverflowError):
            raise _refused("There are no such instants.") from None
        return time_ms_of(origin) + np.rint(ends * 1000.0).astype(np.int64)

    def _clear_at(self, time: int) -> npt.NDArray[np.uint16]:
        """Return the shares of one instant: latitudes by longitudes, the mean of all members."""
        missing, scale, offset = self._packing()
        dimensions = self._variable.dimensions
        member = self._axis_of["member"]
        number = self._variable.shape[dimensions.index(member)] if member else 1
        total: Floats | float = 0.0
        for one in range(number):
            own = {self._axis_of["time"]: time, member: one}
            kept = (self._axis_of["lat"], self._axis_of["lon"])
            where = tuple(slice(None) if d in kept else own.get(d, 0) for d in dimensions)
            stored = np.asarray(self._variable[where])
            values = stored.astype(np.float64)
            for code in missing:
                values[stored == code] = np.nan
            total = total + (values * scale + offset)
        mean = np.asarray(total) / number
        if dimensions.index(self._axis_of["lat"]) > dimensions.index(self._axis_of["lon"]):
            mean = mean.T
        return self._shares(mean)

    def _packing(self) -> tuple[tuple[float, ...], float, float]:
        """Return what stands for missing values, scale and offset of stored ones (CF)."""
        attributes = self._variable.attrs
        missing = [attributes[n] for n in ("_FillValue", "missing_value") if n in attributes]
        codes = tuple(float(code) for part in missing for code in np.ravel(part))
        scale, offset = (
            float(np.ravel(attributes.get(name, default))[0])
            for name, default in (("scale_factor", 1.0), ("add_offset", 0.0))
        )
        return codes, scale, offset

    def _shares(self, mean: Floats) -> npt.NDArray[np.uint16]:
        part = mean * (0.01 if self._is_percent() else 1.0)
        known = ~np.isnan(part)
        if np.any(known & ~((part >= -_ROUNDING) & (part <= 1.0 + _ROUNDING))):
            worst = float(mean[known][np.argmax(np.abs(part[known] - 0.5))])
            raise _refused(
                f"Variable {self._name!r} must be from 0 to 1, or in %: it has {worst:g}."
            )
        clear = np.clip(1.0 - part if self._is_cover else part, 0.0, 1.0)
        return np.where(known, np.rint(np.where(known, clear, 0.0) * WHOLE), MISSING).astype(
            np.uint16
        )

    def _is_percent(self) -> bool:
        return str(self._variable.attrs.get("units", "1")).strip().lower() in ("%", "percent")

    def _notes(self, shape: Mapping[str, int]) -> list[str]:
        member = self._axis_of["member"]
        mean = f", the mean of {shape[member]} members" if member else ""
        units = "in %" if self._is_percent() else "from 0 to 1"
        if not self._is_cover:
            how = f"Variable {self._name!r} ({units}) is used as it is{mean}."
        else:
            how = (
                f"A clear sky's probability is 1 minus the total cloud cover, variable "
                f"{self._name!r} ({units}){mean}: the share of the sky that is clear."
            )
        return [how, f"Probabilities are rounded to 1/{WHOLE:,}."]
