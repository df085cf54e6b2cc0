from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.domain import OrbitElements
from planner_core.errors import InvalidElements
from planner_core.orbits.tle import format_tle, parse_tle, read_tle
from tests.planner_core.orbits.element_sets import (
    ELEMENTS,
    LINE_1,
    LINE_2,
    PAPER_LINE_1,
    PAPER_LINE_2,
    put,
    tle_elements,
    with_checksum,
)


def fault_of(line_1: str, line_2: str) -> tuple[str, str | None]:
    with pytest.raises(InvalidElements) as refused:
        parse_tle([line_1, line_2])
    return refused.value.code, refused.value.fault.pointer


def both(column: int, text: str) -> tuple[str, str]:
    return put(LINE_1, column, text), put(LINE_2, column, text)


def test_every_column_is_read() -> None:
    assert parse_tle([LINE_1, LINE_2]) == ELEMENTS


def test_well_formed_lines_are_kept_as_they_came() -> None:
    reading = read_tle([LINE_1 + "  ", LINE_2 + "\n"])
    assert reading.lines == (LINE_1, LINE_2)
    assert reading.warnings == ()


@given(tle_elements)
def test_written_and_read_again_an_element_set_is_the_same(elements: OrbitElements) -> None:
    assert parse_tle(format_tle(elements)) == elements


def test_a_normal_element_set_is_written_as_catalogues_write_it() -> None:
    assert format_tle(ELEMENTS) == (LINE_1, LINE_2)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("00005", 5),
        ("99999", 99_999),
        ("A0000", 100_000),
        ("A0001", 100_001),
        ("H9999", 179_999),
        ("J0000", 180_000),
        ("N0000", 220_000),
        ("P0000", 230_000),
        ("T0025", 270_025),
        ("Z9999", 339_999),
    ],
)
def test_alpha5_skips_the_letters_i_and_o(text: str, number: int) -> None:
    lines = both(3, text)
    assert parse_tle(lines).norad_cat_id == number
    assert format_tle(parse_tle(lines)) == lines


@pytest.mark.parametrize("text", ["I0000", "O0000", "a0001", "AA001", "1 234", "     ", "1    "])
def test_other_catalogue_numbers_are_refused(text: str) -> None:
    assert fault_of(*both(3, text)) == ("tle_number_format", "/tle/0")


@pytest.mark.parametrize(
    ("text", "year"), [("57001.00000000", 1957), ("99001.00000000", 1999), ("56001.0000000", 2056)]
)
def test_two_digit_years_turn_over_at_57(text: str, year: int) -> None:
    assert parse_tle([put(LINE_1, 19, text), LINE_2]).epoch == datetime(year, 1, 1, tzinfo=UTC)


@pytest.mark.parametrize("day", ["000", "367", "999"])
def test_a_day_that_no_year_has_is_refused(day: str) -> None:
    assert fault_of(put(LINE_1, 21, day), LINE_2) == ("tle_epoch", "/tle/0")


def test_blanks_for_zeros_are_read_as_zeros_and_reported() -> None:
    """The planning paper's own spacecraft is written this way."""
    reading = read_tle([PAPER_LINE_1, PAPER_LINE_2])
    assert reading.lines == (
        with_checksum("1 00007U          19001.00000000  .00000000  00000-0  00000-0 0    0"),
        with_checksum("2 00007  90.0000   0.0000 0010000   0.0000   0.0000 15.24000000    0"),
    )
    assert reading.elements.epoch == datetime(2019, 1, 1, tzinfo=UTC)
    assert reading.elements == parse_tle(reading.lines)
    assert [(w.code, w.pointer) for w in reading.warnings] == [
        ("tle_normalised", "/tle/0"),
        ("tle_normalised", "/tle/1"),
    ]


@pytest.mark.parametrize("ending", ["0", "5", "X", ""])
def test_a_line_with_blanks_for_zeros_may_have_any_checksum(ending: str) -> None:
    reading = read_tle([PAPER_LINE_1[:68] + ending, PAPER_LINE_2[:68] + ending])
    assert [line[68] for line in reading.lines] == ["1", "1"]


@pytest.mark.parametrize(
    ("column", "text"), [(19, " 9"), (21, "  1.0       "), (21, "001.5       ")]
)
def test_blanks_in_the_epoch_alone_forgive_a_checksum(column: int, text: str) -> None:
    line = put(LINE_1, column, text)[:68] + "X"
    assert read_tle([line, LINE_2]).warnings[0].code == "tle_normalised"


def test_blanks_in_one_line_forgive_nothing_in_the_other() -> None:
    line_1 = put(LINE_1, 21, "  1.00000000")
    assert fault_of(line_1, LINE_2[:68] + "9") == ("tle_checksum", "/tle/1")


def test_blanks_that_the_format_has_forgive_nothing() -> None:
    """All catalogues pad angles, revolution and element set numbers with blanks."""
    line_2 = put(LINE_2, 9, "  8.2000")
    assert fault_of(LINE_1, line_2[:68] + "X") == ("tle_checksum", "/tle/1")


@given(st.integers(0, 67), st.sampled_from("0123456789"))
def test_no_single_wrong_digit_passes(at: int, digit: str) -> None:
    for index, line in enumerate((LINE_1, LINE_2)):
        if line[at].isdigit() and line[at] != digit:
            lines = [LINE_1, LINE_2]
            lines[index] = line[:at] + digit + line[at + 1 :]
            with pytest.raises(InvalidElements):
                parse_tle(lines)


@pytest.mark.parametrize(
    ("line_1", "line_2", "fault"),
    [
        (LINE_2, LINE_1, ("tle_line_order", "/tle/0")),
        (LINE_1, LINE_1, ("tle_line_number", "/tle/1")),
        (LINE_1, "", ("tle_line_number", "/tle/1")),
        (LINE_1, LINE_2[:60], ("tle_line_length", "/tle/1")),
        (LINE_1[:68], LINE_2, ("tle_line_length", "/tle/0")),
        (LINE_1 + "0", LINE_2, ("tle_line_length", "/tle/0")),
        (LINE_1.replace("  ", "\t"), LINE_2, ("tle_tabs", "/tle/0")),
        (LINE_1.replace("U", "Ü"), LINE_2, ("tle_not_ascii", "/tle/0")),
        (LINE_1.replace("U", "\0"), LINE_2, ("tle_not_ascii", "/tle/0")),
        (put(LINE_1, 9, "X"), LINE_2, ("tle_columns", "/tle/0")),
        (LINE_1, put(LINE_2, 17, "1"), ("tle_columns", "/tle/1")),
        (put(LINE_1, 54, "+123X5-4"), LINE_2, ("tle_number_format", "/tle/0")),
        (LINE_1, put(LINE_2, 9, " 982.000"), ("tle_number_format", "/tle/1")),
        (LINE_1, put(LINE_2, 27, "0O12000"), ("tle_number_format", "/tle/1")),
        (LINE_1, put(LINE_2, 27, "00 2000"), ("tle_number_format", "/tle/1")),
        (LINE_1, put(LINE_2, 27, "       "), ("tle_number_format", "/tle/1")),
        (LINE_1, put(LINE_2, 3, "41002"), ("tle_number_mismatch", "/tle/1")),
        (put(LINE_1, 63, "4"), LINE_2, ("unsupported_theory", "/tle/0")),
        (LINE_1, put(LINE_2, 9, "180.0001"), ("value_out_of_range", "/tle/1")),
        (LINE_1, put(LINE_2, 18, "360.0001"), ("value_out_of_range", "/tle/1")),
        (LINE_1, put(LINE_2, 53, " 0.00000000"), ("value_out_of_range", "/tle/1")),
        (LINE_1, put(LINE_2, 53, "20.00000000"), ("value_out_of_range", "/tle/1")),
    ],
)
def test_each_fault_has_its_own_name(
    line_1: str, line_2: str, fault: tuple[str, str | None]
) -> None:
    assert fault_of(line_1, line_2) == fault


def test_sgp4_xp_is_refused_by_name() -> None:
    with pytest.raises(InvalidElements, match="SGP4-XP"):
        parse_tle([put(LINE_1, 63, "4"), LINE_2])


def test_a_wrong_checksum_is_told_with_both_digits() -> None:
    with pytest.raises(InvalidElements, match=r"^Line 2: expected 6, got 3$"):
        parse_tle([LINE_1, LINE_2[:68] + "3"])


@pytest.mark.parametrize("lines", [[], [LINE_1], [LINE_1, LINE_2, LINE_2]])
def test_other_than_two_lines_are_refused(lines: list[str]) -> None:
    with pytest.raises(InvalidElements) as refused:
        parse_tle(lines)
    assert refused.value.code == "tle_missing_line"


def test_blank_optional_fields_take_their_defaults() -> None:
    line_1 = put(put(LINE_1, 8, "           "), 63, "      ")
    line_1 = put(line_1, 19, LINE_1[18:32])
    elements = parse_tle([line_1, put(LINE_2, 64, "     ")])
    expected = replace(ELEMENTS, object_id="", element_set_no=0, rev_at_epoch=0)
    assert elements == expected


@pytest.mark.parametrize(
    "changed",
    [
        replace(ELEMENTS, norad_cat_id=340_000),
        replace(ELEMENTS, norad_cat_id=-1),
        replace(ELEMENTS, epoch=ELEMENTS.epoch + timedelta(microseconds=100)),
        replace(ELEMENTS, epoch=datetime(2057, 1, 1, tzinfo=UTC)),
        replace(ELEMENTS, inclination_deg=98.20001),
        replace(ELEMENTS, raan_deg=-1.0),
        replace(ELEMENTS, eccentricity=0.00120001),
        replace(ELEMENTS, eccentricity=1.0 - 1e-14),
        replace(ELEMENTS, mean_motion_rev_day=float("inf")),
        replace(ELEMENTS, mean_motion_dot=1.5),
        replace(ELEMENTS, bstar=1.234567e-5),
        replace(ELEMENTS, bstar=1e-20),
        replace(ELEMENTS, bstar=float("nan")),
        replace(ELEMENTS, element_set_no=10_000),
        replace(ELEMENTS, rev_at_epoch=-1),
        replace(ELEMENTS, object_id="2057-001A"),
        replace(ELEMENTS, object_id="NOT ANNOUNCED"),
        replace(ELEMENTS, classification="UU"),
    ],
)
def test_what_a_tle_cannot_say_is_not_written(changed: OrbitElements) -> None:
    with pytest.raises(ValueError, match=r"TLE|round|must be|letter"):
        format_tle(changed)


def test_an_epoch_cut_by_a_microsecond_is_written_as_the_tle_epoch_it_was() -> None:
    cut = replace(ELEMENTS, epoch=ELEMENTS.epoch - timedelta(microseconds=1))
    assert format_tle(cut) == (LINE_1, LINE_2)
    last = replace(ELEMENTS, epoch=datetime(2023, 12, 31, 23, 59, 59, 999_999, tzinfo=UTC))
    assert format_tle(last)[0][18:32] == "24001.00000000"


@given(st.lists(st.text(max_size=80), max_size=3))
def test_any_other_text_is_refused(lines: list[str]) -> None:
    with pytest.raises(InvalidElements) as refused:
        parse_tle(lines)
    assert refused.value.fault.pointer in ("/tle", "/tle/0", "/tle/1")


@given(st.integers(0, 1), st.integers(0, 68), st.characters(max_codepoint=0x2FF))
def test_any_changed_column_is_read_or_refused(index: int, at: int, character: str) -> None:
    lines = [LINE_1, LINE_2]
    line = lines[index]
    lines[index] = put(line, at + 1, character) if at < 68 else line[:68] + character
    try:
        reading = read_tle(lines)
    except InvalidElements:
        return
    assert read_tle(reading.lines) == replace(reading, warnings=())
