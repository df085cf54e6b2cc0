"""Opportunities follow the plan model: the position of collects and contacts in accesses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.opportunities import MOST_OPPORTUNITIES, place_collects, place_contacts
from planner_core.access.windows import Accesses
from planner_core.domain import GroundStation, Target
from planner_core.errors import InvalidScenario


def accesses(*windows_ms: tuple[int, int]) -> Accesses:
    start, end = np.array(windows_ms, dtype=np.float64).reshape(-1, 2).T / 1000.0
    none = np.zeros(len(start), dtype=np.bool_)
    site = np.zeros(len(start), dtype=np.int32)
    return Accesses(site=site, start_s=start, end_s=end, starts_cut=none, ends_cut=none)


def target(collect_s: float = 30.0) -> list[Target]:
    return [Target(id="t", lat_deg=0.0, lon_deg=0.0, collect_s=collect_s)]


def test_a_collect_is_centred_in_an_access_that_lasts_as_long() -> None:
    row, start, end = place_collects(
        accesses((0, 29_999), (100_000, 130_000), (200_000, 260_001)), target(), None
    )
    assert row.tolist() == [1, 2]
    assert start.tolist() == [100_000, 215_000]
    assert end.tolist() == [130_000, 245_000]


@pytest.mark.parametrize(
    ("access", "spacing_s", "starts_s"),
    [
        ((0, 60_000), 10.0, [0, 10, 20, 30]),
        ((0, 65_000), 10.0, [0, 10, 20, 30, 35]),
        ((0, 60_001), 10.0, [0, 10, 20, 30]),
        ((0, 60_002), 10.0, [0, 10, 20, 30, 30.002]),
        ((0, 30_000), 10.0, [0]),
        ((0, 30_500), 10.0, [0, 0.5]),
        ((500, 60_500), 7.5, [0.5, 8, 15.5, 23, 30.5]),
        ((0, 60_000), 1000.0, [0, 30]),
    ],
)
def test_spaced_collects_cover_the_access_with_both_ends(
    access: tuple[int, int], spacing_s: float, starts_s: list[float]
) -> None:
    _, start, end = place_collects(accesses(access), target(), spacing_s)
    assert (start / 1000.0).tolist() == starts_s
    assert (end - start == 30_000).all()


@given(
    start_ms=st.integers(0, 10**8),
    length_ms=st.integers(1, 600_000),
    # In whole milliseconds: a multiple halfway between two may be rounded either way.
    spacing_s=st.integers(500, 400_000).map(lambda spacing_ms: spacing_ms / 1000.0),
)
def test_starts_aligned_to_the_horizon_are_all_its_multiples_that_fit(
    start_ms: int, length_ms: int, spacing_s: float
) -> None:
    access = accesses((start_ms, start_ms + length_ms))
    _, start, end = place_collects(access, target(), spacing_s, "horizon")
    first = int(start_ms / 1000.0 / spacing_s) - 1
    last = int((start_ms + length_ms) / 1000.0 / spacing_s) + 1
    multiples = [round(k * spacing_s * 1000.0) for k in range(first, last + 1)]
    fitting = [m for m in multiples if start_ms <= m <= start_ms + length_ms - 30_000]
    assert start.tolist() == fitting
    assert (end - start == 30_000).all()


@given(
    st.integers(0, 10**8),
    st.integers(1, 2_000_000),
    st.floats(0.001, 500.0),
    st.floats(0.01, 1e6),
)
def test_spaced_collects_lie_inside_and_no_gap_exceeds_the_spacing(
    begin: int, length: int, collect_s: float, spacing_s: float
) -> None:
    spacing_s = max(spacing_s, length / 1000.0 / 500.0)
    row, start, end = place_collects(
        accesses((begin, begin + length)), target(collect_s), spacing_s
    )
    if len(row) == 0:
        assert length < collect_s * 1000.0 + 1.0
        return
    assert start[0] == begin
    assert begin + length - end[-1] in (0, 1)
    assert (np.diff(start) > 0).all()
    assert np.diff(start).max(initial=0) <= spacing_s * 1000.0 + 1.0
    assert (end - start == end[0] - start[0]).all()
    assert -1e-6 <= (end[0] - start[0]) - collect_s * 1000.0 < 1.0 + 1e-6


def test_each_target_has_its_own_collect_length() -> None:
    windows = accesses((0, 20_000), (0, 20_000))
    both = Accesses(
        site=np.array([0, 1], dtype=np.int32),
        start_s=windows.start_s,
        end_s=windows.end_s,
        starts_cut=windows.starts_cut,
        ends_cut=windows.ends_cut,
    )
    row, start, end = place_collects(both, target(30.0) + target(10.0), None)
    assert (row.tolist(), start.tolist(), end.tolist()) == ([1], [5_000], [15_000])


def test_a_contact_is_the_whole_access_if_it_lasts_long_enough() -> None:
    station = GroundStation(id="s", name="s", lat_deg=0.0, lon_deg=0.0, min_contact_s=60.0)
    row, start, end = place_contacts(accesses((0, 59_999), (70_000, 130_000)), [station])
    assert (row.tolist(), start.tolist(), end.tolist()) == ([1], [70_000], [130_000])


def test_more_collects_than_memory_holds_are_refused_before_they_are_made() -> None:
    month = accesses((0, 31 * 86_400_000))
    with pytest.raises(InvalidScenario, match=f"more than {MOST_OPPORTUNITIES}") as refused:
        place_collects(month, target(), 0.001)
    assert refused.value.code == "too_many_opportunities"
