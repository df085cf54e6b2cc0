from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from planner_core.orbits.sgp4_record import epoch_jd, satrec
from tests.planner_core.orbits.element_sets import ELEMENTS


def test_the_fraction_of_a_tle_epoch_is_the_number_the_tle_printed() -> None:
    epoch = datetime(2022, 8, 15, tzinfo=UTC) + timedelta(microseconds=864 * 81_297_314)
    assert epoch_jd(epoch) == (2459806.5, 0.81297314)


def test_an_epoch_between_those_of_tles_keeps_its_microseconds() -> None:
    epoch = datetime(2022, 8, 15, 6, 0, 0, 100, tzinfo=UTC)
    record = satrec(replace(ELEMENTS, epoch=epoch))
    assert record.jdsatepoch == 2459806.5
    assert record.jdsatepochF * 86400 == pytest.approx(21600.0001, abs=1e-9)


def test_catalogue_numbers_that_sgp4_refuses_do_not_reach_it() -> None:
    nine_digits = satrec(replace(ELEMENTS, norad_cat_id=999_999_999))
    state = nine_digits.sgp4_tsince(60.0)
    assert state == satrec(ELEMENTS).sgp4_tsince(60.0)
    assert state[0] == 0
