"""Grids between their points, compared with a point-by-point interpolation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.forecasts.fields import (
    MISSING,
    WHOLE,
    ByTarget,
    Grid,
    from_bytes,
    sha256_of,
    to_bytes,
    within,
)
from tests.examples import examples

HOUR_MS = 3_600_000


def drawn_grid(
    seed: int, *, goes_round: bool = True, lat_deg: tuple[float, float] = (-90, 90)
) -> Grid:
    draw = np.random.default_rng(seed)
    lon_deg = np.arange(0.0, 360.0, 30.0) - 180.0 if goes_round else np.arange(150.0, 211.0, 15.0)
    rows = np.linspace(*lat_deg, 7)
    value = draw.integers(0, WHOLE + 1, (4, len(rows), len(lon_deg))).astype(np.uint16)
    return Grid(np.arange(4, dtype=np.int64) * 3 * HOUR_MS, rows, lon_deg, value)


def slowly(grid: Grid, time: int, lat_deg: float, lon_deg: float) -> float:
    """Return the bilinear interpolation of the four corners around a point."""
    columns = [*grid.lon_deg.tolist()]
    values = grid.value[time].astype(float) / WHOLE
    if columns[-1] + (columns[1] - columns[0]) - columns[0] >= 359.999:
        columns.append(columns[0] + 360.0)
        values = np.hstack([values, values[:, :1]])
    while lon_deg < columns[0]:
        lon_deg += 360.0
    while lon_deg >= columns[0] + 360.0:
        lon_deg -= 360.0
    along = [float(np.interp(lon_deg, columns, row)) for row in values]
    return float(np.interp(lat_deg, grid.lat_deg, along))


@examples(100)
@given(
    st.integers(0, 10_000),
    st.lists(st.tuples(st.floats(-90, 90), st.floats(-180, 360)), min_size=1, max_size=20),
)
def test_values_are_bilinear_round_the_globe(seed: int, places: list[tuple[float, float]]) -> None:
    grid = drawn_grid(seed)
    lat_deg, lon_deg = np.array(places).T
    found = grid.at(lat_deg, lon_deg, slice(0, 4))
    for (lat, lon), values in zip(places, found, strict=True):
        expected = [slowly(grid, time, lat, lon) for time in range(4)]
        assert values.tolist() == pytest.approx(expected, abs=1e-9)


@examples(100)
@given(st.integers(0, 10_000), st.floats(0.0, 60.0), st.floats(150.0, 210.0))
def test_regions_may_lie_across_the_antimeridian(seed: int, lat: float, lon: float) -> None:
    grid = drawn_grid(seed, goes_round=False, lat_deg=(0.0, 60.0))
    for same in (lon, lon - 360.0):
        if same < -180.0:
            continue
        (values,) = grid.at(np.array([lat]), np.array([same]), slice(1, 3))
        assert values.tolist() == pytest.approx(
            [slowly(grid, time, lat, lon) for time in (1, 2)], abs=1e-9
        )


@pytest.mark.parametrize(
    ("lat", "lon"), [(-0.1, 160), (60.1, 160), (30, 149.9), (30, 210.1), (30, 0)]
)
def test_nothing_is_known_outside_a_region(lat: float, lon: float) -> None:
    grid = drawn_grid(0, goes_round=False, lat_deg=(0.0, 60.0))
    assert np.all(np.isnan(grid.at(np.array([lat]), np.array([float(lon)]), slice(0, 4))))
    assert grid.over(["t"], np.array([lat]), np.array([float(lon)]), 0, HOUR_MS) == []


def test_rows_next_to_a_pole_hold_up_to_it() -> None:
    grid = drawn_grid(3, lat_deg=(-75.0, 75.0))
    beyond, edge = (grid.at(np.array([lat]), np.array([12.0]), slice(0, 4)) for lat in (89.0, 75.0))
    assert beyond.tolist() == edge.tolist()
    far = drawn_grid(3, lat_deg=(-60.0, 60.0))
    assert np.isnan(far.at(np.array([89.0]), np.array([12.0]), slice(0, 4))).all()


def test_missing_values_spoil_what_lies_beside_them_alone() -> None:
    grid = drawn_grid(5)
    grid.value[1, 3, 4] = MISSING
    lat, lon = grid.lat_deg[3], grid.lon_deg[4]
    lat_deg = np.array([lat, lat + 1.0, lat, lat + 30.0, lat])
    lon_deg = np.array([lon, lon, lon - 1.0, lon, lon + 30.0])
    known = ~np.isnan(grid.at(lat_deg, lon_deg, slice(0, 4)))
    assert known.all(axis=1).tolist() == [False, False, False, True, True]
    (skies,) = grid.over(list("abcde"), lat_deg, lon_deg, 0, HOUR_MS)
    assert skies.target.tolist() == [3, 4]


@examples(100)
@given(st.lists(st.integers(0, 50), min_size=1, unique=True), st.integers(0, 50), st.integers(0, 9))
def test_a_span_keeps_what_interpolation_in_it_needs(
    times: list[int], start: int, length: int
) -> None:
    time_ms = np.array(sorted(times), dtype=np.int64)
    values = np.random.default_rng(0).random(len(time_ms))
    span = within(time_ms, start, start + length)
    kept, own = time_ms[span], values[span]
    for at in np.linspace(start, start + length, 20):
        if time_ms[0] <= at <= time_ms[-1]:
            assert np.interp(at, kept, own) == pytest.approx(np.interp(at, time_ms, values))
        else:
            assert not len(kept) or not kept[0] <= at <= kept[-1]
    assert len(kept) <= 2 + sum(start < time < start + length for time in times)


def test_targets_with_the_same_instants_make_one_series() -> None:
    times = [0, HOUR_MS, 0, HOUR_MS, HOUR_MS, 2 * HOUR_MS]
    field = ByTarget(
        ("a", "b", "c"),
        np.array([0, 2, 4, 6]),
        np.array(times),
        np.array([0, 1000, 2000, 3000, 4000, 5000], dtype=np.uint16),
    )
    nowhere = np.zeros(4)
    found = field.over(["c", "x", "b", "a"], nowhere, nowhere, 0, 3 * HOUR_MS)
    told: dict[Any, Any] = {
        tuple(one.target.tolist()): (one.time_ms.tolist(), one.clear_probability.tolist())
        for one in found
    }
    assert told == {
        (0,): ([HOUR_MS, 2 * HOUR_MS], [[0.4, 0.5]]),
        (2, 3): ([0, HOUR_MS], [[0.2, 0.3], [0.0, 0.1]]),
    }
    assert field.over(["a"], nowhere, nowhere, 9 * HOUR_MS, 10 * HOUR_MS) == []


def test_fields_survive_being_stored() -> None:
    by_target = ByTarget(("ü/1",), np.array([0, 1]), np.array([5]), np.array([7], dtype=np.uint16))
    for field in (drawn_grid(1), by_target):
        again = from_bytes(to_bytes(field))
        assert type(again) is type(field)
        assert sha256_of(again) == sha256_of(field)
        assert again.describe() == field.describe()
    assert sha256_of(drawn_grid(1)) != sha256_of(drawn_grid(2))
