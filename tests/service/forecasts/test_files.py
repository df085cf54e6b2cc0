"""Forecast files: what is read, and what is refused, with the position of the fault."""

from __future__ import annotations

import io
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
import pytest

from service.forecasts.csv_file import read_csv
from service.forecasts.fields import WHOLE, ByTarget, Grid
from service.forecasts.netcdf_file import read_netcdf
from service.problems.kinds import ServiceError

HEADER = "time,lat_deg,lon_deg,clear_probability"
TIMES = ["2026-03-01T00:00:00Z", "2026-03-01T05:00:00+02:00"]
START_MS = int(datetime(2026, 3, 1, tzinfo=UTC).timestamp() * 1000)
HOUR_MS = 3_600_000
VALUES = np.round(np.random.default_rng(1).random((2, 3, 4)), 4)


def lines(values: Any = VALUES) -> list[str]:
    return [
        f"{time},{lat},{lon},{values[i, j, k]}"
        for k, lon in enumerate((170, 175, 180, 185))
        for j, lat in enumerate((40, 39, 38))
        for i, time in enumerate(TIMES)
    ]


def text(*rows: str, header: str = HEADER) -> bytes:
    return "\n".join((header, *rows)).encode()


def test_a_grid_may_stand_in_any_order() -> None:
    field, notes = read_csv(text(*lines()))
    assert isinstance(field, Grid)
    assert (field.time_ms - START_MS).tolist() == [0, 3 * HOUR_MS]
    assert field.lat_deg.tolist() == [38.0, 39.0, 40.0]
    assert field.lon_deg.tolist() == [170.0, 175.0, 180.0, 185.0]
    assert field.value.tolist() == np.rint(VALUES[:, ::-1] * WHOLE).tolist()
    assert notes == ["Probabilities are rounded to 1/10,000."]
    other = text(
        *(",".join(reversed(line.split(","))) for line in reversed(lines())),
        header="clear_probability,lng,LAT,time",
    )
    assert np.array_equal(read_csv(other)[0].columns()["value"], field.value)


def test_tables_of_spreadsheets_are_read_as_they_come() -> None:
    plain, _ = read_csv(text(*lines()))
    turned = [line.replace(",", ";").replace(".", ",") for line in (HEADER, *lines())]
    semicolons, _ = read_csv("\r\n".join(turned).encode("utf-16"))
    assert np.array_equal(semicolons.columns()["value"], plain.columns()["value"])


def test_values_by_target_are_sorted_in_time() -> None:
    header = "target_id,time,clear_probability"
    rows = ["b,2026-03-01T02:00:00Z,1", "a,2026-03-01T01:00:00Z,0.5", "b,2026-03-01T00:00:00Z,0"]
    field, _ = read_csv(text(*rows, header=header))
    assert isinstance(field, ByTarget)
    assert field.ids == ("a", "b")
    assert field.first.tolist() == [0, 1, 3]
    assert (field.time_ms - START_MS).tolist() == [HOUR_MS, 0, 2 * HOUR_MS]
    assert field.value.tolist() == [5000, 0, 10000]


def test_a_globe_that_ends_where_it_begins_has_one_column_less() -> None:
    rows = [f"{TIMES[0]},{lat},{lon},0.5" for lat in (0, 1) for lon in range(0, 361, 90)]
    field, _ = read_csv(text(*rows))
    assert isinstance(field, Grid)
    assert field.lon_deg.tolist() == [0.0, 90.0, 180.0, 270.0]
    assert field.value.shape == (1, 2, 4)


@pytest.mark.parametrize(
    ("data", "code", "row", "words"),
    [
        (b"", "empty_file", None, "empty"),
        (text(), "empty_file", None, "no records"),
        (b"\xff\xff", "not_utf8", None, "UTF-8"),
        (text("x", header="time,lat_deg,lon_deg"), "missing_field", 1, "clear_probability"),
        (text(header="time,lat_deg,lon_deg,clear_probabilty"), "unknown_field", 1, "did you mean"),
        (text("2026-03-01T00:00:00,1,2,0.5"), "invalid_value", 2, "time"),
        (text("yesterday,1,2,0.5"), "invalid_value", 2, "time"),
        (text(f"{TIMES[0]},91,2,0.5"), "invalid_value", 2, "lat_deg"),
        (text(f"{TIMES[0]},1,361,0.5"), "invalid_value", 2, "lon_deg"),
        (text(f"{TIMES[0]},1,2,1.5"), "invalid_value", 2, "clear_probability"),
        (text(f"{TIMES[0]},1,2,nan"), "invalid_value", 2, "clear_probability"),
        (text(f"{TIMES[0]},1,2,"), "invalid_value", 2, "not a number"),
        (text(f"{TIMES[0]},1,2"), "malformed_csv", 2, "clear_probability is missing"),
        (text(*lines(), lines()[3]), "invalid_value", 26, "twice"),
        (text(*lines()[1:]), "invalid_value", None, "not full"),
        (text(*(f"{TIMES[0]},0,{lon},1" for lon in (0, 1, 3))), "invalid_value", None, "evenly"),
        (text(*(f"{TIMES[0]},{lat},0,1" for lat in (0, 1, 8))), "invalid_value", None, "evenly"),
        (
            text(*["a,2026-03-01T00:00:00Z,1"] * 2, header="target_id,time,clear_probability"),
            "invalid_value",
            3,
            "twice",
        ),
    ],
)
def test_what_is_wrong_with_a_table_is_named(
    data: bytes, code: str, row: int | None, words: str
) -> None:
    with pytest.raises(ServiceError) as caught:
        read_csv(data)
    fault = caught.value.faults[0]
    assert (fault.code, fault.row) == (code, row)
    assert words in fault.detail


def test_faults_are_not_listed_without_end() -> None:
    with pytest.raises(ServiceError) as caught:
        read_csv(text(*["?,0,0,0"] * 5000))
    assert len(caught.value.faults) == 100


def test_far_fewer_values_than_places_are_refused_before_the_grid_is_made() -> None:
    rows = [f"{TIMES[0]},{i / 1000},{i / 1000},0.5" for i in range(20_000)]
    with pytest.raises(ServiceError, match="make 400000000 values"):
        read_csv(text(*rows))


def netcdf(
    name: str = "tcc",
    values: Any = 1.0 - VALUES,
    axes: tuple[str, ...] = ("time", "latitude", "longitude"),
    time_units: str = "hours since 2026-03-01",
    calendar: str | None = None,
    **attributes: Any,
) -> bytes:
    """Return a file; latitudes descend as in weather services' files."""
    values = np.asarray(values)
    own: dict[str, Any] = {
        "time": [0.0, 3.0],
        "latitude": [40.0, 39.0, 38.0],
        "longitude": [170, 175, 180, 185],
    }
    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        file.dimensions = dict(zip(axes, values.shape, strict=True))
        for axis, size in zip(axes, values.shape, strict=True):
            numbers = own.get(axis, list(range(size)))
            file.create_variable(axis, (axis,), data=np.array(numbers[:size], dtype=np.float64))
        if "time" in axes:
            file.variables["time"].attrs["units"] = time_units
            if calendar:
                file.variables["time"].attrs["calendar"] = calendar
        variable = file.create_variable(name, axes, data=values)
        variable.attrs.update(attributes)
    return buffer.getvalue()


def shares(clear: Any) -> Any:
    return np.rint(np.asarray(clear)[:, ::-1] * WHOLE).tolist()


@pytest.mark.parametrize(
    ("name", "values", "attributes"),
    [
        ("tcc", 1.0 - VALUES, {}),
        ("tcc", 100.0 * (1.0 - VALUES), {"units": "%"}),
        ("clear_probability", VALUES, {}),
        ("clear_probability", VALUES.astype(np.float64) * 100.0, {"units": "percent"}),
        ("clouds", 1.0 - VALUES, {"standard_name": "cloud_area_fraction"}),
        (
            "tcc",
            np.rint((1.0 - VALUES) * WHOLE).astype(np.int16),
            {"scale_factor": 1.0 / WHOLE, "add_offset": 0.0},
        ),
    ],
)
def test_cover_becomes_the_probability_of_a_clear_sky(
    name: str, values: Any, attributes: dict[str, Any]
) -> None:
    grid, notes = read_netcdf(netcdf(name, values, **attributes))
    assert (grid.time_ms - START_MS).tolist() == [0, 3 * HOUR_MS]
    assert grid.lat_deg.tolist() == [38.0, 39.0, 40.0]
    assert grid.lon_deg.tolist() == [170.0, 175.0, 180.0, 185.0]
    assert grid.value.tolist() == shares(VALUES)
    assert ("1 minus the total cloud cover" in notes[0]) == (name != "clear_probability")


def test_members_are_averaged() -> None:
    members = np.random.default_rng(2).random((2, 5, 3, 4))
    axes = ("time", "number", "latitude", "longitude")
    grid, notes = read_netcdf(netcdf(values=members, axes=axes))
    assert grid.value.tolist() == shares(1.0 - members.mean(axis=1))
    assert "the mean of 5 members" in notes[0]


def test_axes_may_come_in_another_order() -> None:
    axes = ("longitude", "time", "latitude")
    grid, _ = read_netcdf(netcdf(values=(1.0 - VALUES).transpose(2, 0, 1), axes=axes))
    assert grid.value.tolist() == shares(VALUES)


def test_missing_values_are_missing() -> None:
    values = 1.0 - VALUES
    values[0, 1, 2] = -999.0
    values[1, 0, 0] = np.nan
    grid, _ = read_netcdf(netcdf(values=values, missing_value=-999.0))
    found = grid.at(grid.lat_deg[::-1].copy(), np.full(3, 180.0), slice(0, 2))
    assert np.isnan(found).tolist() == [[False, False], [True, False], [False, False]]
    assert np.count_nonzero(grid.value > WHOLE) == 2


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "cannot be read"),
        (b"CDF\x01" + bytes(100), "nccopy"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "cannot be read"),
        (netcdf()[:3000], "cannot be read"),
        (netcdf("rain"), "no variable"),
        (netcdf(axes=("step", "latitude", "longitude")), "no axis of time"),
        (netcdf(axes=("time", "y", "longitude")), "no axis of latitude"),
        (netcdf(values=VALUES + 0.5), "from 0 to 1"),
        (netcdf(time_units="fortnights since 2026-03-01"), "units of time"),
        (netcdf(time_units="hours since 2026-13-01"), "no such instants"),
        (netcdf(time_units="days since 9999-12-31"), "no such instants"),
        (netcdf(calendar="noleap"), "standard calendar"),
        (
            netcdf(values=np.ones((2, 3, 3, 4)), axes=("time", "level", "latitude", "longitude")),
            "'level'",
        ),
    ],
)
def test_what_is_wrong_with_a_netcdf_file_is_told(data: bytes, words: str) -> None:
    with pytest.raises(ServiceError) as caught:
        read_netcdf(data)
    assert caught.value.faults[0].code == "malformed_netcdf"
    assert words in caught.value.faults[0].detail


def with_hdf5(change: Any) -> bytes:
    buffer = io.BytesIO(netcdf())
    with h5py.File(buffer, "r+") as file:
        change(file)
    return buffer.getvalue()


def test_files_cannot_name_other_files(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(np.ones(24).tobytes())

    def external(file: h5py.File) -> None:
        file.create_dataset("s", (24,), "f8", external=[(str(secret), 0, 192)])

    def linked(file: h5py.File) -> None:
        file["s"] = h5py.ExternalLink(str(secret), "/")

    def soft(file: h5py.File) -> None:
        file["s"] = h5py.SoftLink("/tcc")

    def virtual(file: h5py.File) -> None:
        layout = h5py.VirtualLayout((24,), "f8")
        layout[:] = h5py.VirtualSource(str(secret), "d", (24,))
        file.create_virtual_dataset("s", layout)

    def group(file: h5py.File) -> None:
        file.create_group("s")

    for change in (external, linked, soft, virtual, group):
        with pytest.raises(ServiceError) as caught:
            read_netcdf(with_hdf5(change))
        assert "'s'" in caught.value.faults[0].detail, change


def test_a_small_file_of_a_huge_grid_is_refused_before_it_is_read() -> None:
    buffer = io.BytesIO()
    shape = {"time": 20, "latitude": 2001, "longitude": 4000}
    with h5netcdf.File(buffer, "w") as file:
        file.dimensions = shape
        file.create_variable(
            "tcc", tuple(shape), dtype="f4", chunks=(1, 500, 500), compression="gzip"
        )
    assert len(buffer.getvalue()) < 100_000
    with pytest.raises(ServiceError, match="the limit is 20000000"):
        read_netcdf(buffer.getvalue())
