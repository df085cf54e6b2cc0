"""Real files of element sets, in every form, against python-sgp4's own reading of them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from sgp4.api import Satrec

from planner_core.domain import OrbitElements, mean_elements
from planner_core.orbits.ingest import Ingested, read_elements
from planner_core.orbits.sgp4_record import satrec
from planner_core.orbits.tle import format_tle, read_tle

MEDIA_TYPES = {
    ".tle": "text/plain",
    ".txt": "text/plain",
    ".kvn": "text/plain",
    ".json": "application/json",
    ".csv": "text/csv",
    ".xml": "application/xml",
}
MINUTES = np.linspace(0.0, 1440.0, 9)


def ingest(path: Path) -> Ingested:
    return read_elements(path.read_bytes(), MEDIA_TYPES[path.suffix])


def positions_km(record: Satrec, jd: float, fraction: float) -> np.ndarray:
    """Return positions over a day from an instant, shape ``(9, 3)``."""
    states = [record.sgp4(jd, fraction + minutes / 1440.0) for minutes in MINUTES]
    assert [state[0] for state in states] == [0] * len(MINUTES)
    return np.array([state[1] for state in states])


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("resource_2022-08-15.tle", 180),
        ("planet_2022-08-15.tle", 202),
        ("spire_2022-08-15.tle", 117),
        ("science_2026-05-30_crlf.tle", 49),
    ],
)
def test_catalogues_import_completely_and_fly_as_python_sgp4_has_them(
    shared_data: Path, name: str, count: int
) -> None:
    ingested = ingest(shared_data / "elements" / name)
    assert ingested.faults == ()
    assert len(ingested.entries) == count
    for entry in ingested.entries:
        assert entry.warnings == ()
        theirs = Satrec.twoline2rv(*entry.orbit["tle"])
        instant = theirs.jdsatepoch, theirs.jdsatepochF
        ours_km = positions_km(satrec(mean_elements(entry.elements)), *instant)
        # The same numbers go through the same code, so the results must be identical.
        np.testing.assert_array_equal(ours_km, positions_km(theirs, *instant))


def test_catalogue_lines_are_written_as_they_were_read(shared_data: Path) -> None:
    for name in ("resource_2022-08-15.tle", "science_2026-05-30_crlf.tle"):
        for entry in ingest(shared_data / "elements" / name).entries:
            assert list(format_tle(mean_elements(entry.elements))) == entry.orbit["tle"]


@pytest.mark.parametrize("suffix", [".csv", ".json", ".xml", ".kvn"])
def test_all_forms_of_the_same_orbits_agree_within_a_centimetre(
    shared_data: Path, suffix: str
) -> None:
    """These messages give epochs cut to the microsecond: 1 microsecond is 7.5 mm of flight."""
    stem = "derived_one_2022-08-15" if suffix == ".kvn" else "derived_eo_2022-08-15"
    ingested = ingest(shared_data / "omm" / f"{stem}{suffix}")
    lines = ingest(shared_data / "omm" / "derived_eo_2022-08-15.tle").entries
    assert ingested.faults == ()
    assert len(ingested.entries) == (1 if suffix == ".kvn" else len(lines))
    for entry, reference in zip(ingested.entries, lines, strict=False):
        assert entry.elements.name == reference.elements.name
        record = satrec(mean_elements(reference.elements))
        instant = record.jdsatepoch, record.jdsatepochF
        apart_km = positions_km(satrec(mean_elements(entry.elements)), *instant) - positions_km(
            record, *instant
        )
        assert np.linalg.norm(apart_km, axis=1).max() < 1e-5


def expectations(folder: Path) -> list[dict[str, str]]:
    with (folder / "EXPECTED.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


BAD_FILES = {
    "bad_checksum_line1.tle": ("tle_checksum", 2),
    "swapped_lines.tle": ("tle_line_order", 2),
    "missing_line2.tle": ("tle_missing_line", 2),
    "mismatched_number.tle": ("tle_number_mismatch", 3),
    "truncated_line.tle": ("tle_line_length", 3),
    "letters_in_number.tle": ("tle_number_format", 3),
    "tabs_for_spaces.tle": ("tle_tabs", 2),
    "duplicate_number.tle": ("duplicate_element_set", 5),
    "empty.tle": ("empty_file", None),
}


def test_each_bad_file_gets_what_is_expected_of_it(shared_data: Path) -> None:
    folder = shared_data / "elements" / "bad"
    accepted = {"no": 0, "first no; second yes": 1, "policy": 1, "yes (2)": 2, "yes (3)": 3}
    expected = expectations(folder)
    assert {row["file"] for row in expected} == {path.name for path in folder.glob("*.tle")}
    for row in expected:
        ingested = ingest(folder / row["file"])
        assert len(ingested.entries) == accepted[row["valid"]], row["file"]
        fault = BAD_FILES.get(row["file"])
        assert [(f.code, f.row) for f in ingested.faults] == ([fault] if fault else []), row["file"]


def test_names_and_numbers_of_odd_but_valid_files(shared_data: Path) -> None:
    folder = shared_data / "elements" / "bad"
    names = [e.elements.name for e in ingest(folder / "zero_prefixed_names.tle").entries]
    assert names == ["LANDSAT 9", "SENTINEL-2A"]
    numbers = [e.elements.norad_cat_id for e in ingest(folder / "alpha5.tle").entries]
    assert numbers == [100_001, 270_025, 339_999]


def test_examples_of_other_projects_are_read_or_refused(shared_data: Path) -> None:
    folder = shared_data / "omm"
    for name in ("OMMExample1.txt", "OMMExample4.txt", "sample_omm.csv", "sample_omm.json"):
        assert len(ingest(folder / name).entries) == 1, name
    (as_xml,) = ingest(folder / "OMMExample4.xml").entries
    (as_kvn,) = ingest(folder / "OMMExample4.txt").entries
    assert as_xml.elements == as_kvn.elements
    assert len(ingest(folder / "sample_omm.xml").entries) == 1
    bad = {"OMM-number-format-error.txt": ("omm_number_format", 15)}
    bad["OMM-wrong-keyword.txt"] = ("omm_unknown_keyword", 9)
    for name, fault in bad.items():
        ingested = ingest(folder / "bad" / name)
        assert ingested.entries == ()
        assert [(f.code, f.row) for f in ingested.faults] == [fault], name


def test_the_benchmark_spacecraft_with_blanks_for_zeros_are_read(shared_data: Path) -> None:
    text = (shared_data / "spacecraft" / "mis_spacecraft_4.json").read_text(encoding="utf-8")
    read: list[OrbitElements] = []
    for craft in json.loads(text):
        reading = read_tle([craft["line1"], craft["line2"]])
        assert [warning.code for warning in reading.warnings] == ["tle_normalised"] * 2
        theirs = Satrec.twoline2rv(craft["line1"], craft["line2"])
        instant = theirs.jdsatepoch, theirs.jdsatepochF
        ours_km = positions_km(satrec(reading.elements), *instant)
        np.testing.assert_array_equal(ours_km, positions_km(theirs, *instant))
        read.append(reading.elements)
    assert [elements.raan_deg for elements in read] == [0.0, 90.0, 180.0, 270.0]
