"""The verification set of "Revisiting Spacetrack Report #3" (Vallado, AIAA 2006-6753).

Its element sets are read like a user's file; its output is the reference.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner_core.domain import mean_elements
from planner_core.orbits.ingest import read_elements
from planner_core.orbits.sgp4_record import satrec
from planner_core.orbits.tle import checksum

# The reference prints 1e-8 km; only its last digit and another compiler may cause differences.
TOLERANCE_KM = 1e-6
WRONG_CHECKSUMS = {"33333", "33334", "33335"}  # invented by the authors to provoke errors
ALREADY_FAILED = {"33334"}  # its one printed line repeats the last state of the set before


@pytest.fixture(scope="module")
def lines(shared_data: Path) -> list[str]:
    """Return the element lines, cut to the 69 columns of the format (times to print follow)."""
    text = (shared_data / "sgp4" / "SGP4-VER.TLE").read_text(encoding="ascii")
    return [line.rstrip()[:69] for line in text.splitlines() if not line.startswith("#")]


@pytest.fixture(scope="module")
def output(shared_data: Path) -> list[tuple[str, np.ndarray]]:
    """Return number and rows of (minutes, x, y, z) for each element set, in order."""
    blocks: list[tuple[str, list[list[float]]]] = []
    for line in (shared_data / "sgp4" / "tcppver.out").read_text(encoding="ascii").splitlines():
        if line.endswith("xx"):
            blocks.append((line.split()[0], []))
        else:
            blocks[-1][1].append([float(word) for word in line.split()[:4]])
    return [(number, np.array(rows)) for number, rows in blocks]


def test_positions_equal_the_reference(
    lines: list[str], output: list[tuple[str, np.ndarray]]
) -> None:
    assert len(lines) == 2 * len(output) == 66
    compared = 0
    for at, (number, rows) in enumerate(output):
        pair = [line[:68] + str(checksum(line)) for line in lines[2 * at : 2 * at + 2]]
        (entry,) = read_elements("\n".join(pair).encode(), "text/plain").entries
        assert entry.elements.norad_cat_id == int(number)
        record = satrec(mean_elements(entry.elements))
        if number in ALREADY_FAILED:
            assert record.sgp4_tsince(0.0)[0] != 0
            continue
        for minutes, *expected_km in rows:
            code, position_km, _ = record.sgp4_tsince(minutes)
            assert code == 0
            np.testing.assert_allclose(position_km, expected_km, rtol=0, atol=TOLERANCE_KM)
            compared += 1
    assert compared == 666


def test_the_file_as_it_is_loses_only_its_wrong_checksums_and_its_repeated_set(
    lines: list[str],
) -> None:
    ingested = read_elements("\n".join(lines).encode(), "text/plain")
    refused = [(fault.code, lines[(fault.row or 0) - 1][2:7]) for fault in ingested.faults]
    assert refused == [("tle_checksum", number) for number in sorted(WRONG_CHECKSUMS)] + [
        ("duplicate_element_set", "20413")
    ]
    assert len(ingested.entries) == 33 - len(refused)
    assert not any(entry.warnings for entry in ingested.entries)
