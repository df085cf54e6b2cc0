"""Element sets made up for tests, as values and as lines."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

from hypothesis import strategies as st

from planner_core.domain import OrbitElements

LINE_1 = "1 41001U 16001A   22227.25000000  .00000123 -12345-6  54321-4 0  9993"
LINE_2 = "2 41001  98.2000 296.6000 0012000  96.6000 263.4000 14.57000000 12346"
ELEMENTS = OrbitElements(
    name=None,
    norad_cat_id=41001,
    object_id="2016-001A",
    epoch=datetime(2022, 8, 15, 6, tzinfo=UTC),
    mean_motion_rev_day=14.57,
    eccentricity=0.0012,
    inclination_deg=98.2,
    raan_deg=296.6,
    arg_perigee_deg=96.6,
    mean_anomaly_deg=263.4,
    bstar=5.4321e-05,
    mean_motion_dot=1.23e-06,
    mean_motion_ddot=-1.2345e-07,
    element_set_no=999,
    rev_at_epoch=1234,
)
# The style of the planning paper: blanks where the format has zeros.
PAPER_LINE_1 = "1     7U          19  1.00000000  .00000000  00000-0  00000-0 0    01"
PAPER_LINE_2 = "2     7  90.0000   0.0000 0010000   0.0000   0.0000 15.24000000    02"


def omm(**changes: object) -> dict[str, object]:
    """Return a message as a catalogue serves it, with some values changed."""
    fields: dict[str, object] = {
        "OBJECT_NAME": "MADE UP",
        "OBJECT_ID": "2016-001A",
        "EPOCH": "2022-08-15T06:00:00.000000",
        "MEAN_MOTION": 14.57,
        "ECCENTRICITY": 0.0012,
        "INCLINATION": 98.2,
        "RA_OF_ASC_NODE": 296.6,
        "ARG_OF_PERICENTER": 96.6,
        "MEAN_ANOMALY": 263.4,
        "EPHEMERIS_TYPE": 0,
        "CLASSIFICATION_TYPE": "U",
        "NORAD_CAT_ID": 41001,
        "ELEMENT_SET_NO": 999,
        "REV_AT_EPOCH": 1234,
        "BSTAR": 5.4321e-05,
        "MEAN_MOTION_DOT": 1.23e-06,
        "MEAN_MOTION_DDOT": -1.2345e-07,
    }
    return fields | changes


def with_checksum(line: str) -> str:
    """Return the first 68 columns with their checksum, computed independently."""
    minus_as_one = line[:68].replace("-", "1")
    return line[:68] + str(sum(int(c) for c in minus_as_one if c in "0123456789") % 10)


def put(line: str, column: int, text: str) -> str:
    """Return the line with ``text`` put at a column (counted from 1) and a new checksum."""
    at = column - 1
    return with_checksum(line[:at] + text + line[at + len(text) :])


def _digits(largest: int, per_unit: int) -> st.SearchStrategy[float]:
    return st.integers(0, largest).map(lambda n: n / per_unit)


def _power(sign: int, digits: int, exponent: int) -> float:
    return sign * float(f".{digits}") * 10.0**exponent


_ANGLES = _digits(3_600_000, 10_000)
_POWERS = st.just(0.0) | st.builds(
    _power, st.sampled_from((-1, 1)), st.integers(10_000, 99_999), st.integers(-9, 8)
)
_EPOCHS = st.integers(0, 99 * 365 * 10**8).map(
    lambda ticks: datetime(1957, 1, 1, tzinfo=UTC) + timedelta(microseconds=864 * ticks)
)
_OBJECT_IDS = st.just("") | st.builds(
    "{}-{:03d}{}".format,
    st.integers(1957, 2056),
    st.integers(0, 999),
    st.text("ABCDEFGHJK", min_size=1, max_size=3),
)
# Every element set that a TLE can carry.
tle_elements = st.builds(
    OrbitElements,
    name=st.none(),
    norad_cat_id=st.integers(0, 339_999),
    object_id=_OBJECT_IDS,
    epoch=_EPOCHS,
    mean_motion_rev_day=_digits(1_999_999_999, 10**8).filter(lambda n: n > 0),
    eccentricity=_digits(9_999_999, 10**7),
    inclination_deg=_digits(1_800_000, 10_000),
    raan_deg=_ANGLES,
    arg_perigee_deg=_ANGLES,
    mean_anomaly_deg=_ANGLES,
    bstar=_POWERS,
    mean_motion_dot=st.integers(-99_999_999, 99_999_999).map(lambda n: n / 10**8),
    mean_motion_ddot=_POWERS,
    element_set_no=st.integers(0, 9999),
    rev_at_epoch=st.integers(0, 99_999),
    classification=st.sampled_from("UCS"),
)


def _beyond_tle(elements: OrbitElements, number: int, tick_us: int, bstar: float) -> OrbitElements:
    return replace(
        elements,
        name="MADE UP",
        norad_cat_id=number,
        epoch=elements.epoch + timedelta(microseconds=tick_us),
        bstar=bstar,
    )


# Every element set that an OMM can carry and a TLE need not.
omm_elements = st.builds(
    _beyond_tle,
    tle_elements,
    st.integers(0, 999_999_999),
    st.integers(0, 863),
    st.floats(-1.0, 1.0),
)
