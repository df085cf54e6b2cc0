from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import Fault
from planner_core.orbits.ingest import Ingested, read_elements
from tests.planner_core.orbits.element_sets import (
    ELEMENTS,
    LINE_1,
    LINE_2,
    PAPER_LINE_1,
    PAPER_LINE_2,
    omm,
    put,
)

NAMED = replace(ELEMENTS, name="MADE UP")
OTHER_1, OTHER_2 = put(LINE_1, 3, "41002"), put(LINE_2, 3, "41002")
MEDIA_TYPES = ("text/plain", "application/json", "text/csv", "application/xml", "text/xml")


def read_text(*lines: str, end: str = "\n") -> Ingested:
    return read_elements(end.join(lines).encode(), "text/plain")


def codes(ingested: Ingested) -> list[tuple[str, int | None]]:
    return [(fault.code, fault.row) for fault in ingested.faults]


def rows(ingested: Ingested) -> list[int | None]:
    return [entry.row for entry in ingested.entries]


def csv_file(*records: dict[str, object]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(records[0]))
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue().encode()


STATED = {
    "CENTER_NAME": "EARTH",
    "REF_FRAME": "TEME",
    "TIME_SYSTEM": "UTC",
    "MEAN_ELEMENT_THEORY": "SGP4",
}


def kvn(**changes: object) -> list[str]:
    fields = {"CCSDS_OMM_VERS": "3.0"} | STATED | omm(**changes)
    return [f"{key} = {value}" for key, value in fields.items() if value is not None]


def xml(*, version: str = "2.0", **changes: object) -> str:
    fields = STATED | omm(**changes)
    leaves = "".join(f"<{key}>{value}</{key}>" for key, value in fields.items())
    return (
        f'<omm id="CCSDS_OMM_VERS" version="{version}"><header><CREATION_DATE/></header><body>'
        f"<segment><data><meanElements>{leaves}</meanElements></data></segment></body></omm>"
    )


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_line_ends_and_byte_order_mark_make_no_difference(end: str, mark: str) -> None:
    ingested = read_text(mark + "MADE UP", LINE_1, LINE_2, "", "0 OTHER", OTHER_1, OTHER_2, end=end)
    assert ingested.faults == ()
    assert [entry.elements.name for entry in ingested.entries] == ["MADE UP", "OTHER"]
    assert rows(ingested) == [2, 6]
    assert ingested.entries[0].elements == NAMED
    assert ingested.entries[0].orbit == {"tle": [LINE_1, LINE_2]}


def test_sets_without_names_have_none() -> None:
    ingested = read_text(LINE_1, LINE_2, OTHER_1, OTHER_2, "")
    assert [entry.elements.name for entry in ingested.entries] == [None, None]


def test_comments_are_skipped() -> None:
    assert rows(read_text("# from a catalogue", LINE_1, LINE_2)) == [2]


def test_what_was_put_right_is_reported_with_its_line() -> None:
    ingested = read_text("PAPER", PAPER_LINE_1, PAPER_LINE_2)
    (entry,) = ingested.entries
    assert [(w.code, w.row) for w in entry.warnings] == [
        ("tle_normalised", 2),
        ("tle_normalised", 3),
    ]
    assert entry.orbit["tle"][0].startswith("1 00007U          19001.00000000")


@pytest.mark.parametrize(
    ("lines", "faults", "kept"),
    [
        (["A", LINE_1, "B", OTHER_1, OTHER_2], [("tle_missing_line", 2)], [4]),
        (["A", LINE_2, "B", OTHER_1, OTHER_2], [("tle_missing_line", 2)], [4]),
        (["A", "B", OTHER_1, OTHER_2], [("tle_missing_line", 1)], [3]),
        ([OTHER_1, OTHER_2, "B"], [("tle_missing_line", 3)], [1]),
        ([LINE_1, OTHER_1, OTHER_2], [("tle_missing_line", 1)], [2]),
        ([LINE_2, OTHER_1, OTHER_2], [("tle_missing_line", 1)], [2]),
        ([OTHER_2, OTHER_1, OTHER_2], [("tle_missing_line", 1)], [2]),
        (["A", LINE_2, LINE_1, "B", OTHER_1, OTHER_2], [("tle_line_order", 2)], [5]),
        ([LINE_2, LINE_1, OTHER_1, OTHER_2], [("tle_line_order", 1)], [3]),
        (["A", LINE_1, "2 41001  98.2", OTHER_1, OTHER_2], [("tle_line_length", 3)], [4]),
        ([LINE_1, OTHER_2, OTHER_1, OTHER_2], [("tle_number_mismatch", 2)], [3]),
        (["A\0", LINE_1, LINE_2, OTHER_1, OTHER_2], [("tle_name", 1)], [4]),
    ],
)
def test_reading_goes_on_after_a_bad_set(
    lines: list[str], faults: list[tuple[str, int]], kept: list[int]
) -> None:
    ingested = read_text(*lines)
    assert codes(ingested) == faults
    assert rows(ingested) == kept


def test_a_set_that_comes_twice_is_kept_once_and_both_rows_are_named() -> None:
    ingested = read_text("A", LINE_1, LINE_2, "B", LINE_1, LINE_2)
    assert rows(ingested) == [2]
    assert codes(ingested) == [("duplicate_element_set", 5)]
    assert "Row 5" in ingested.faults[0].detail
    assert "row 2" in ingested.faults[0].detail


def test_a_newer_set_of_the_same_satellite_is_no_duplicate() -> None:
    assert rows(read_text(LINE_1, LINE_2, put(LINE_1, 21, "228"), LINE_2)) == [1, 3]


def test_uncatalogued_satellites_are_told_apart_by_name() -> None:
    lines = put(LINE_1, 3, "00000"), put(LINE_2, 3, "00000")
    assert rows(read_text("A", *lines, "B", *lines)) == [2, 5]


@pytest.mark.parametrize(
    ("data", "media_type", "code"),
    [
        (b"", "text/plain", "empty_file"),
        (b"\xef\xbb\xbf \r\n", "application/json", "empty_file"),
        (b"\xff\xfe1 2", "text/plain", "not_utf8"),
        (b"no elements here\nat all", "text/plain", "no_elements"),
        (b"[1", "application/json", "not_json"),
        (b"[" * 100_000, "application/json", "not_json"),
        (b"9" * 5000, "application/json", "not_json"),
        (b"[]", "application/json", "no_elements"),
        (b"3", "application/json", "omm_syntax"),
        (b"a,b\n1,2", "text/csv", "omm_missing_key"),
        (b'"', "text/csv", "not_csv"),
        (b"<omm>", "application/xml", "not_xml"),
        (b"<ndm/>", "text/xml", "no_elements"),
        (b"<opm/>", "text/xml", "unsupported_message"),
        (b'<?xml version="1.0" encoding="no-such"?><ndm/>', "text/xml", "not_xml"),
        (b"{}", "application/zip", "unsupported_media_type"),
        (b"{}", "", "unsupported_media_type"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_fault(data: bytes, media_type: str, code: str) -> None:
    ingested = read_elements(data, media_type)
    assert ingested.entries == ()
    assert [fault.code for fault in ingested.faults] == [code]


def test_parameters_of_the_media_type_are_ignored() -> None:
    data = json.dumps(omm()).encode()
    assert len(read_elements(data, "Application/JSON; charset=utf-8").entries) == 1


@given(st.binary(max_size=200), st.sampled_from(MEDIA_TYPES))
def test_any_bytes_give_faults_and_no_error(data: bytes, media_type: str) -> None:
    ingested = read_elements(data, media_type)
    assert ingested.faults
    assert not ingested.entries


_pieces = st.lists(
    st.sampled_from((LINE_1, LINE_2, OTHER_1, OTHER_2, LINE_1[:40], "NAME", "", "\t", "1 ", "2"))
    | st.text(max_size=70),
    min_size=1,
    max_size=8,
)


@given(_pieces, st.sampled_from(("\n", "\r\n", "\r")))
def test_any_lines_are_accepted_or_named(pieces: list[str], end: str) -> None:
    ingested = read_elements(end.join(pieces).encode("utf-8", "replace"), "text/plain")
    assert ingested.entries or ingested.faults
    assert all(fault.row is None or fault.row >= 1 for fault in ingested.faults)


@given(st.recursive(st.none() | st.floats() | st.text(), st.lists))
def test_any_json_gives_faults_and_no_error(value: object) -> None:
    assert read_elements(json.dumps(value).encode(), "application/json").faults


@given(st.text())
def test_any_csv_record_gives_faults_and_no_error(record: str) -> None:
    header = ",".join(omm())
    ingested = read_elements(f"{header}\n{record},\n".encode("utf-8", "replace"), "text/csv")
    assert ingested.entries == ()
    assert ingested.faults


@given(st.lists(st.text("ABT_=[] \t19.#", max_size=30), max_size=6))
def test_any_keyword_lines_give_faults_and_no_error(lines: list[str]) -> None:
    assert read_text("CCSDS_OMM_VERS = 3.0", *lines).faults


@given(st.text("<>/&![]\"'= \nomdxENTITY0", max_size=80))
def test_any_markup_gives_faults_and_no_error(text: str) -> None:
    assert read_elements(f"<omm>{text}</omm>".encode(), "application/xml").faults


@pytest.mark.parametrize(
    ("data", "media_type", "row"),
    [
        (json.dumps(omm()), "application/json", None),
        (json.dumps([omm()]), "application/json", None),
        (csv_file(omm()).decode(), "text/csv", 2),
        ("\n".join(kvn()), "text/plain", 1),
        (xml(), "application/xml", None),
        (f"<ndm><COMMENT>two</COMMENT>{xml(version='3.0')}</ndm>", "text/xml", None),
    ],
)
def test_every_form_of_message_gives_the_same_elements(
    data: str, media_type: str, row: int | None
) -> None:
    ingested = read_elements(data.encode(), media_type)
    assert ingested.faults == ()
    (entry,) = ingested.entries
    assert entry.elements == NAMED
    assert entry.orbit == {"omm": omm()}
    assert entry.row == row


def test_a_bad_item_of_a_json_array_is_named_by_pointer() -> None:
    items: list[object] = [omm(), 7, omm(NORAD_CAT_ID=2, EPOCH="now"), omm(NORAD_CAT_ID=3)]
    ingested = read_elements(json.dumps(items).encode(), "application/json")
    assert [entry.elements.norad_cat_id for entry in ingested.entries] == [41001, 3]
    assert [(fault.code, fault.pointer) for fault in ingested.faults] == [
        ("omm_syntax", "/1"),
        ("omm_epoch", "/2/EPOCH"),
    ]


def test_the_second_of_two_equal_items_is_named_by_pointer() -> None:
    ingested = read_elements(json.dumps([omm(), omm()]).encode(), "application/json")
    (fault,) = ingested.faults
    assert (fault.code, fault.pointer) == ("duplicate_element_set", "/1")
    assert "/0" in fault.detail


def test_json_with_not_a_number_is_refused_at_its_place() -> None:
    data = json.dumps(omm(BSTAR=float("nan"))).encode()
    (fault,) = read_elements(data, "application/json").faults
    assert (fault.code, fault.pointer) == ("value_out_of_range", "/BSTAR")


def test_csv_columns_come_in_any_order_with_others_between() -> None:
    record = {"EXTRA": "x"} | dict(reversed(omm().items())) | {"GP_ID": 1}
    (entry,) = read_elements(csv_file(record), "text/csv").entries
    assert entry.elements == NAMED


def test_csv_faults_name_the_line_of_the_file() -> None:
    text = csv_file(
        omm(OBJECT_NAME="TWO\nLINES"),
        omm(NORAD_CAT_ID=2, ECCENTRICITY=2),
        omm(NORAD_CAT_ID=3),
    ).decode()
    ingested = read_elements((text + "1,2,3\r\n").encode(), "text/csv")
    assert codes(ingested) == [("omm_text", 2), ("value_out_of_range", 4), ("csv_columns", 6)]
    assert rows(ingested) == [5]


def test_a_csv_header_must_name_what_is_needed_once() -> None:
    data = b"EPOCH,EPOCH\n1,2\n"
    assert codes(read_elements(data, "text/csv")) == [("omm_duplicate_key", 1)]
    (fault,) = read_elements(b"EPOCH\n1\n", "text/csv").faults
    assert fault.code == "omm_missing_key"
    assert "BSTAR" in fault.detail


def test_kvn_holds_several_messages_with_comments_and_units() -> None:
    first = ["COMMENT made up", *kvn(MEAN_MOTION="14.57 [rev/day]", BSTAR="5.4321E-05[1/ER]")]
    second = ["", *kvn(NORAD_CAT_ID=41002, OBJECT_NAME="DEBRIS [1]"), "USER_DEFINED_A = b = c"]
    ingested = read_text(*first, *second, end="\r\n")
    assert ingested.faults == ()
    assert ingested.entries[0].elements == NAMED
    assert ingested.entries[1].elements.name == "DEBRIS [1]"
    assert rows(ingested) == [2, len(first) + 2]


@pytest.mark.parametrize(
    ("lines", "code", "row"),
    [
        ([*kvn(), "WRONG_KEYWORD = 1"], "omm_unknown_keyword", 23),
        ([*kvn(), "BSTAR = 1"], "omm_duplicate_key", 23),
        ([*kvn(), "and so on"], "omm_syntax", 23),
        (kvn(INCLINATION="1.7 [rad]"), "omm_unit", 11),
        (kvn(INCLINATION="98,2"), "omm_number_format", 11),
        (kvn(BSTAR=None), "omm_missing_key", 1),
        (kvn(REF_FRAME="GCRF"), "unsupported_frame", 3),
        ([line for line in kvn() if "REF_FRAME" not in line], "omm_missing_key", 1),
        (kvn()[1:], "omm_missing_key", 1),
        (["CCSDS_OPM_VERS = 2.0", "ORIGINATOR = X"], "unsupported_message", 1),
    ],
)
def test_a_bad_line_refuses_its_message_only(lines: list[str], code: str, row: int) -> None:
    after = kvn(NORAD_CAT_ID=5)
    ingested = read_text(*lines, *after)
    assert codes(ingested) == [(code, row)]
    assert rows(ingested) == [len(lines) + 1]


def test_xml_faults_name_message_and_keyword() -> None:
    bad = xml().replace("<BSTAR>", "<BSTAR/><BSTAR>")
    radians = xml().replace("<INCLINATION>", '<INCLINATION units="rad">')
    unknown = xml().replace("<BSTAR>", "<NOVEL>1</NOVEL><BSTAR>")
    named = '<userDefinedParameters><USER_DEFINED parameter="A">b</USER_DEFINED>'
    fine = xml().replace("</data>", named + "</userDefinedParameters></data>")
    text = f"<ndm>{bad}{radians}{unknown}<oem/>{xml(EPOCH='')}{xml(version='1.0')}{fine}</ndm>"
    ingested = read_elements(text.encode(), "application/xml")
    assert [(fault.code, fault.pointer) for fault in ingested.faults] == [
        ("omm_duplicate_key", "/0/BSTAR"),
        ("omm_unit", "/1/INCLINATION"),
        ("omm_unknown_keyword", "/2/NOVEL"),
        ("unsupported_message", "/3"),
        ("omm_missing_key", "/4/EPOCH"),
        ("unsupported_version", "/5/CCSDS_OMM_VERS"),
    ]
    assert len(ingested.entries) == 1


@pytest.mark.parametrize(
    "prolog",
    [
        '<!DOCTYPE omm [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>',
        '<!DOCTYPE omm [<!ENTITY a SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE omm SYSTEM "http://localhost/omm.dtd">',
    ],
)
def test_entities_and_document_types_are_refused(prolog: str) -> None:
    ingested = read_elements((prolog + xml()).encode(), "application/xml")
    assert ingested == Ingested(
        faults=(Fault("xml_forbidden", "The XML declares a document type or an entity"),)
    )


def test_deeply_nested_xml_is_no_danger() -> None:
    deep = b"<omm>" + b"<data>" * 50_000 + b"</data>" * 50_000 + b"</omm>"
    assert read_elements(deep, "application/xml").faults[0].code == "not_xml"
