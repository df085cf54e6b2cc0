from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.domain import OrbitElements
from planner_core.errors import InvalidElements
from planner_core.orbits.omm import REQUIRED_KEYS, elements_from_omm, omm_from_elements
from tests.planner_core.orbits.element_sets import ELEMENTS, omm, omm_elements


def fault_of(**changes: object) -> tuple[str, str | None]:
    with pytest.raises(InvalidElements) as refused:
        elements_from_omm(omm(**changes))
    return refused.value.code, refused.value.fault.pointer


def test_every_keyword_is_read() -> None:
    assert elements_from_omm(omm()) == replace(ELEMENTS, name="MADE UP")


def test_numbers_may_be_text() -> None:
    assert elements_from_omm({key: str(value) for key, value in omm().items()}) == replace(
        ELEMENTS, name="MADE UP"
    )


@given(omm_elements)
def test_written_and_read_again_an_element_set_is_the_same(elements: OrbitElements) -> None:
    through_json = json.loads(json.dumps(omm_from_elements(elements)))
    assert elements_from_omm(through_json) == elements


def test_the_message_has_the_keywords_that_catalogues_serve() -> None:
    assert omm_from_elements(replace(ELEMENTS, name="MADE UP")) == omm()


@pytest.mark.parametrize("key", REQUIRED_KEYS)
@pytest.mark.parametrize("value", [None, "", "  "])
def test_a_missing_keyword_is_named(key: str, value: object) -> None:
    assert fault_of(**{key: value}) == ("omm_missing_key", f"/omm/{key}")


def test_other_keywords_may_be_missing() -> None:
    elements = elements_from_omm({key: omm()[key] for key in REQUIRED_KEYS})
    assert (elements.name, elements.object_id, elements.classification) == (None, "", "U")
    assert (elements.element_set_no, elements.rev_at_epoch, elements.mean_motion_dot) == (999, 0, 0)


def test_a_semi_major_axis_cannot_stand_for_the_mean_motion() -> None:
    with pytest.raises(InvalidElements, match="SEMI_MAJOR_AXIS"):
        elements_from_omm(omm(MEAN_MOTION=None, SEMI_MAJOR_AXIS=7000.0))


@pytest.mark.parametrize(
    ("text", "instant"),
    [
        ("2022-08-15T06:00:00", datetime(2022, 8, 15, 6, tzinfo=UTC)),
        ("2022-08-15 06:00:00", datetime(2022, 8, 15, 6, tzinfo=UTC)),
        ("2022-08-15T06:00:00Z", datetime(2022, 8, 15, 6, tzinfo=UTC)),
        ("2022-08-15T06:00:00.", datetime(2022, 8, 15, 6, tzinfo=UTC)),
        ("2022-08-15T06:00:00.5", datetime(2022, 8, 15, 6, 0, 0, 500_000, tzinfo=UTC)),
        ("2022-08-15T06:00:00.123456Z", datetime(2022, 8, 15, 6, 0, 0, 123_456, tzinfo=UTC)),
        ("2022-08-15T06:00:00.123456789", datetime(2022, 8, 15, 6, 0, 0, 123_457, tzinfo=UTC)),
        ("2022-08-15T06:00:00.999999999", datetime(2022, 8, 15, 6, 0, 1, tzinfo=UTC)),
        ("2022-12-31T23:59:59.9999999", datetime(2023, 1, 1, tzinfo=UTC)),
        ("2022-227T06:00:00", datetime(2022, 8, 15, 6, tzinfo=UTC)),
        ("2020-366T00:00:00.25", datetime(2020, 12, 31, 0, 0, 0, 250_000, tzinfo=UTC)),
        ("2022-365T23:59:59.9999999", datetime(2023, 1, 1, tzinfo=UTC)),
    ],
)
def test_epochs_are_read_in_every_form(text: str, instant: datetime) -> None:
    assert elements_from_omm(omm(EPOCH=text)).epoch == instant


@pytest.mark.parametrize(
    "text",
    [
        "2022-08-15",
        "2022-13-01T00:00:00",
        "2022-02-30T00:00:00",
        "2022-366T00:00:00",
        "2022-000T00:00:00",
        "2022-08-15T24:00:00",
        "2022-08-15T06:00:60",
        "0000-01-01T00:00:00",
        "2022-08-15T06:00:00+02:00",
        "15.08.2022",
        "٢٠٢٢-08-15T06:00:00",
        20220815,
    ],
)
def test_an_epoch_that_is_none_is_refused(text: object) -> None:
    assert fault_of(EPOCH=text) == ("omm_epoch", "/omm/EPOCH")


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"ECCENTRICITY": 1.0}, "value_out_of_range"),
        ({"ECCENTRICITY": -1e-9}, "value_out_of_range"),
        ({"INCLINATION": 180.1}, "value_out_of_range"),
        ({"INCLINATION": -0.1}, "value_out_of_range"),
        ({"MEAN_MOTION": 0}, "value_out_of_range"),
        ({"MEAN_MOTION": 20}, "value_out_of_range"),
        ({"MEAN_MOTION": float("nan")}, "value_out_of_range"),
        ({"MEAN_MOTION": float("inf")}, "value_out_of_range"),
        ({"MEAN_MOTION": "1e999"}, "value_out_of_range"),
        ({"MEAN_ANOMALY": 10**400}, "value_out_of_range"),
        ({"MEAN_ANOMALY": 1e308}, "value_out_of_range"),
        ({"BSTAR": 1e308}, "value_out_of_range"),
        ({"NORAD_CAT_ID": 10**9}, "value_out_of_range"),
        ({"NORAD_CAT_ID": -1}, "value_out_of_range"),
        ({"EPOCH": "1956-12-31T00:00:00"}, "value_out_of_range"),
        ({"EPOCH": "9999-12-31T23:59:59.9999999"}, "omm_epoch"),
        ({"MEAN_MOTION": "nan"}, "omm_number_format"),
        ({"MEAN_MOTION": "1_4.5"}, "omm_number_format"),
        ({"MEAN_MOTION": "1" * 5000}, "omm_number_format"),
        ({"MEAN_MOTION": True}, "omm_number_format"),
        ({"MEAN_MOTION": [14.5]}, "omm_number_format"),
        ({"NORAD_CAT_ID": "A0001"}, "omm_number_format"),
        ({"NORAD_CAT_ID": 1.5}, "omm_number_format"),
        ({"OBJECT_NAME": "\ud800"}, "omm_text"),
        ({"OBJECT_NAME": "A\0B"}, "omm_text"),
        ({"OBJECT_NAME": "A" * 201}, "omm_text"),
        ({"OBJECT_NAME": {"en": "A"}}, "omm_text"),
        ({"CCSDS_OMM_VERS": "4.0"}, "unsupported_version"),
        ({"MEAN_ELEMENT_THEORY": "SGP4-XP"}, "unsupported_theory"),
        ({"MEAN_ELEMENT_THEORY": "DSST"}, "unsupported_theory"),
        ({"MEAN_ELEMENT_THEORY": "USM"}, "unsupported_theory"),
        ({"EPHEMERIS_TYPE": 4}, "unsupported_theory"),
        ({"EPHEMERIS_TYPE": "4"}, "unsupported_theory"),
        ({"EPHEMERIS_TYPE": 2}, "unsupported_theory"),
        ({"BTERM": 0.02, "BSTAR": None}, "unsupported_theory"),
        ({"REF_FRAME": "ICRF"}, "unsupported_frame"),
        ({"TIME_SYSTEM": "TAI"}, "unsupported_time_system"),
        ({"CENTER_NAME": "MARS"}, "unsupported_center"),
    ],
)
def test_each_refusal_names_code_and_keyword(changes: dict[str, object], code: str) -> None:
    assert fault_of(**changes) == (code, f"/omm/{next(iter(changes))}")


def test_the_theory_refused_is_named() -> None:
    with pytest.raises(InvalidElements, match="'DSST'"):
        elements_from_omm(omm(MEAN_ELEMENT_THEORY="DSST"))


@pytest.mark.parametrize("theory", ["SGP4", "sgp4", "SGP/SGP4", " SGP4 "])
def test_sgp4_is_accepted_under_both_its_names(theory: str) -> None:
    said = omm(
        CCSDS_OMM_VERS="3.0",
        MEAN_ELEMENT_THEORY=theory,
        REF_FRAME="TEME",
        TIME_SYSTEM="UTC",
        CENTER_NAME="EARTH",
    )
    assert elements_from_omm(said) == elements_from_omm(omm())


def test_keywords_that_say_nothing_of_the_orbit_are_ignored() -> None:
    more = omm(GM=398600.8, CREATION_DATE="", COMMENT="GENERATED", GP_ID=1, DECAY_DATE=None)
    assert elements_from_omm(more) == elements_from_omm(omm())


def test_catalogue_numbers_have_up_to_nine_digits() -> None:
    assert elements_from_omm(omm(NORAD_CAT_ID="999999999")).norad_cat_id == 999_999_999


_values = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=30)
    | st.lists(st.integers(), max_size=2)
)


@given(st.dictionaries(st.sampled_from([*omm(), "REF_FRAME", "BTERM"]), _values, max_size=4))
def test_any_values_are_read_or_refused(changes: dict[str, object]) -> None:
    pointer: str | None = "/omm/"
    try:
        elements_from_omm(omm(**changes))
    except InvalidElements as error:
        pointer = error.fault.pointer
    assert pointer is not None
    assert pointer.startswith("/omm/")
