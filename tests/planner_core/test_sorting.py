"""Sorting and searching in kernels, compared with NumPy's."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from hypothesis import given
from hypothesis import strategies as st

from planner_core.jit import kernel
from planner_core.sorting import first_not_below, stable_order

Floats = npt.NDArray[np.float64]

# Few values, so that many are equal.
KEYS = st.lists(st.integers(-3, 3) | st.just(np.inf), max_size=40)


@kernel
def _order(keys: Floats) -> npt.NDArray[np.int64]:
    return stable_order(keys)


@kernel
def _place(values: Floats, least: float) -> int:
    return first_not_below(values, least)


@given(KEYS)
def test_order_is_numpys_stable_one(keys: list[float]) -> None:
    own = np.array(keys, dtype=np.float64)
    expected = np.argsort(own, kind="stable").tolist()
    assert _order(own).tolist() == expected
    assert stable_order(own).tolist() == expected  # as Python runs it


@given(KEYS, st.integers(-4, 4))
def test_place_is_numpys(keys: list[float], least: int) -> None:
    values = np.sort(np.array(keys, dtype=np.float64))
    assert _place(values, float(least)) == np.searchsorted(values, least)
