"""Lines cut at the antimeridian: nothing is lost, nothing jumps across the map."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.exports.antimeridian import Piece, pieces_of_line

steps = st.lists(st.tuples(st.floats(-89.0, 89.0), st.floats(-10.0, 10.0)), min_size=1, max_size=40)


def line(start_deg: float, moves: list[tuple[float, float]]) -> Piece:
    lon = start_deg + np.cumsum([0.0, *(d for d, _ in moves)])
    lat = np.clip(np.cumsum([0.0, *(d for _, d in moves)]), -89.0, 89.0)
    wrapped = (lon + 180.0) % 360.0 - 180.0
    return Piece(lon_deg=wrapped, lat_deg=lat, t_s=np.arange(0.0, len(lon)) * 30.0)


def cut(whole: Piece) -> list[Piece]:
    return list(pieces_of_line(whole.lon_deg, whole.lat_deg, whole.t_s))


@given(st.floats(-180.0, 180.0), steps)
def test_pieces_hold_every_point_and_meet_at_the_edge(
    start_deg: float, moves: list[tuple[float, float]]
) -> None:
    whole = line(start_deg, moves)
    pieces = cut(whole)
    seen = {point for p in pieces for point in zip(p.lon_deg, p.lat_deg, p.t_s, strict=True)}
    assert seen >= set(zip(whole.lon_deg, whole.lat_deg, whole.t_s, strict=True))
    for piece in pieces:
        assert len(piece.t_s) >= 2
        assert np.all(np.diff(piece.t_s) >= 0.0)
        assert np.all(np.abs(piece.lon_deg) <= 180.0)
        assert np.all(np.abs(np.diff(piece.lon_deg)) <= 90.0)
    for before, after in itertools.pairwise(pieces):
        assert abs(before.lon_deg[-1]) == 180.0
        assert after.lon_deg[0] == -before.lon_deg[-1]
        assert after.lat_deg[0] == before.lat_deg[-1]
        assert after.t_s[0] == before.t_s[-1]


@given(st.floats(-180.0, 180.0), steps)
def test_no_turn_is_lost_in_the_cut(start_deg: float, moves: list[tuple[float, float]]) -> None:
    whole = line(start_deg, moves)
    turned = sum(float(np.sum(np.diff(piece.lon_deg))) for piece in cut(whole))
    assert turned == pytest.approx(sum(d for d, _ in moves), abs=1e-6)


def two_points(lon_deg: list[float], lat_deg: list[float]) -> list[Piece]:
    return cut(Piece(lon_deg=np.array(lon_deg), lat_deg=np.array(lat_deg), t_s=np.array([0, 30.0])))


def test_the_crossing_lies_where_the_line_does() -> None:
    pieces = two_points([170.0, -170.0], [0.0, 10.0])
    assert [p.lon_deg.tolist() for p in pieces] == [[170.0, 180.0], [-180.0, -170.0]]
    assert [p.lat_deg.tolist() for p in pieces] == [[0.0, 5.0], [5.0, 10.0]]
    assert [p.t_s.tolist() for p in pieces] == [[0.0, 15.0], [15.0, 30.0]]


def test_a_line_over_a_pole_leaves_the_map_at_the_top() -> None:
    pieces = two_points([10.0, -170.0], [89.0, 88.0])
    assert [p.lon_deg.tolist() for p in pieces] == [[10.0, 10.0], [-170.0, -170.0]]
    assert [p.lat_deg.tolist() for p in pieces] == [[89.0, 90.0], [90.0, 88.0]]


def test_the_two_names_of_the_antimeridian_are_one_place() -> None:
    for piece in two_points([180.0, -180.0], [0.0, 0.0]):
        assert np.isfinite(piece.lat_deg).all()
        assert np.isfinite(piece.t_s).all()
