"""Ephemerides made from SGP4's own states must give SGP4's positions and accesses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skyfield.api import load
from skyfield.sgp4lib import TEME

from benchmarks.missions import ORBIT, paper_scenario
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import Horizon, OrbitEphemeris, Satellite
from planner_core.errors import InvalidElements, InvalidScenario
from planner_core.orbits import frames
from planner_core.orbits.checks import check_element_age, check_propagation
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.ingest import read_elements
from planner_core.orbits.oem import MOST_LINES, Outline, outline_of, read_oem, tidy_lines
from planner_core.orbits.oem_states import interpolated_km
from planner_core.orbits.sgp4_record import satrec
from tests.examples import examples

Floats = npt.NDArray[np.float64]

SCENARIO = paper_scenario(20, 0, use_resources=True)
HORIZON = Horizon(start=SCENARIO.horizon.start, end=SCENARIO.horizon.start + timedelta(hours=3))
OFFSETS_S = np.arange(-600.0, HORIZON.duration_s + 601.0, 60.0)


def states() -> tuple[Floats, Floats]:
    """Return SGP4's positions and velocities each minute, in km and km/s."""
    jd, start = frames.julian_date(HORIZON.start)
    fraction = start + OFFSETS_S / 86400.0
    _, position, velocity = satrec(ORBIT).sgp4_array(np.full_like(fraction, jd), fraction)
    return position, velocity


def lines(
    position: Floats,
    velocity: Floats,
    shift_s: float = 0.0,
    offsets_s: Floats = OFFSETS_S,
    **changes: str,
) -> list[str]:
    """Return a message in KVN."""
    epochs = [
        (HORIZON.start + timedelta(seconds=float(offset_s) + shift_s)).replace(tzinfo=None)
        .isoformat(timespec="microseconds") for offset_s in offsets_s
    ]  # fmt: skip
    meta = {
        "OBJECT_NAME": "PAPER", "OBJECT_ID": "2019-001A", "CENTER_NAME": "EARTH",
        "REF_FRAME": "TEME", "TIME_SYSTEM": "UTC", "START_TIME": epochs[0],
        "STOP_TIME": epochs[-1], "INTERPOLATION": "HERMITE", "INTERPOLATION_DEGREE": "7",
    } | changes  # fmt: skip
    numbers = np.hstack([position, velocity]).tolist()
    return [
        "CCSDS_OEM_VERS = 2.0", "CREATION_DATE = 2019-01-01T00:00:00", "ORIGINATOR = TEST",
        "META_START", *(f"{key} = {value}" for key, value in meta.items() if value), "META_STOP",
        *(" ".join([epoch, *(f"{number:.9f}" for number in row)])
          for epoch, row in zip(epochs, numbers, strict=True)),
    ]  # fmt: skip


def path_of(message: Sequence[str], horizon: Horizon = HORIZON) -> Floats:
    """Return the Earth-fixed positions of a message at the nodes of a horizon, in metres."""
    return propagate(satellite(read_oem(message)), horizon).position_itrf_m


def satellite(orbit: OrbitEphemeris) -> Satellite:
    return replace(SCENARIO.satellites[0], orbit=orbit)


def apart_m(message: Sequence[str], horizon: Horizon = HORIZON) -> float:
    """Return the largest distance between a message and SGP4."""
    own = propagate(SCENARIO.satellites[0], horizon).position_itrf_m
    return float(np.linalg.norm(path_of(message, horizon) - own, axis=1).max())


@pytest.mark.parametrize(
    ("interpolation", "degree", "limit_m"),
    # SGP4's velocity is not quite the derivative of its position, but HERMITE relies on it.
    [("HERMITE", "7", 0.5), ("HERMITE", "3", 1.0), ("LAGRANGE", "9", 1e-3), ("", "", 0.5)],
)
def test_between_states_positions_are_those_of_sgp4(
    interpolation: str, degree: str, limit_m: float
) -> None:
    between = Horizon(start=HORIZON.start + timedelta(seconds=29.3), end=HORIZON.end)
    message = lines(*states(), INTERPOLATION=interpolation, INTERPOLATION_DEGREE=degree)
    assert apart_m(message, between) < limit_m


def test_straight_lines_are_as_far_off_as_they_must_be() -> None:
    between = Horizon(start=HORIZON.start + timedelta(seconds=30.0), end=HORIZON.end)
    message = lines(*states(), INTERPOLATION="LINEAR", INTERPOLATION_DEGREE="")
    assert 3_000.0 < apart_m(message, between) < 5_000.0  # the sagitta of a minute's arc


@pytest.mark.parametrize(("frame", "limit_m"), [("GCRF", 0.01), ("EME2000", 0.01)])
def test_inertial_frames_agree_with_skyfield(frame: str, limit_m: float) -> None:
    instants = [HORIZON.start + timedelta(seconds=s) for s in OFFSETS_S.tolist()]
    rotation = TEME.rotation_at(load.timescale(builtin=True).from_datetimes(instants))
    # Skyfield's TEME is rotated from the ICRS; J2000's frame bias is from Chapront (2002).
    position, velocity = (np.einsum("jin,nj->ni", rotation, v) for v in states())
    if frame == "EME2000":
        eta, xi, alpha = np.array([-6.8192, -16.617, -14.6]) * 1e-3 * frames.ARCSEC_RAD
        bias = np.array([[1.0, alpha, -xi], [-alpha, 1.0, -eta], [xi, eta, 1.0]])
        position, velocity = position @ bias.T, velocity @ bias.T
    assert apart_m(lines(position, velocity, REF_FRAME=frame)) < limit_m


def test_earth_fixed_states_and_days_of_the_year_are_read() -> None:
    path = propagate(SCENARIO.satellites[0], HORIZON)
    position, velocity = path.position_itrf_m / 1e3, path.velocity_itrf_m_s / 1e3
    message = lines(position, velocity, offsets_s=path.node_s, REF_FRAME="ITRF2014")
    by_day = [line.replace("2019-01-01T", "2019-001T") for line in message]
    assert apart_m(by_day) < 1e-3
    assert read_oem(message).period_s == pytest.approx(ORBIT.period_s, rel=3e-3)
    assert read_oem(message).eccentricity == pytest.approx(ORBIT.eccentricity, abs=2e-3)


@pytest.mark.parametrize(("system", "ahead_s"), [("TAI", 37.0), ("TT", 69.184), ("GPS", 18.0)])
def test_time_systems_are_those_of_2019(system: str, ahead_s: float) -> None:
    assert apart_m(lines(*states(), shift_s=ahead_s, TIME_SYSTEM=system)) < 1e-3


def test_accesses_are_those_of_sgp4_to_milliseconds() -> None:
    mission = replace(SCENARIO, horizon=HORIZON)
    flown = satellite(read_oem(lines(*states())))
    ours = compute_opportunities(replace(mission, satellites=(flown,)), Budget())
    theirs = compute_opportunities(mission, Budget())
    assert len(ours.opportunities) == len(theirs.opportunities) > 10
    for name in ("access_start_s", "access_end_s"):
        np.testing.assert_allclose(
            getattr(ours.opportunities, name), getattr(theirs.opportunities, name), atol=2e-3
        )


@examples(20)
@given(degree=st.integers(1, 12), seed=st.integers(0, 1000), is_hermite=st.booleans())
def test_polynomials_are_found_again(degree: int, seed: int, is_hermite: bool) -> None:
    degree = degree // 2 * 2 + 1 if is_hermite else degree
    rng = np.random.default_rng(seed)
    t_s = np.cumsum(rng.uniform(20.0, 90.0, 30))
    polynomials = [np.polynomial.Polynomial(rng.uniform(-1, 1, degree + 1), (0.0, t_s[-1]))
                   for _ in range(3)]  # fmt: skip
    orbit = read_oem(lines(*states()))
    segment = replace(
        orbit.segments[0],
        interpolation="HERMITE" if is_hermite else "LAGRANGE",
        degree=degree,
        t_s=t_s,
        position_km=np.stack([p(t_s) for p in polynomials], axis=1),
        velocity_km_s=np.stack([p.deriv()(t_s) for p in polynomials], axis=1),
    )
    asked_s = rng.uniform(t_s[0], t_s[-1], 40)
    expected = np.stack([p(asked_s) for p in polynomials], axis=1)
    np.testing.assert_allclose(interpolated_km(segment, asked_s), expected, atol=1e-7)


def test_segments_that_touch_are_one_path_and_a_gap_is_refused() -> None:
    position, velocity = states()
    half = len(OFFSETS_S) // 2
    first = lines(position[: half + 1], velocity[: half + 1], offsets_s=OFFSETS_S[: half + 1])
    second = lines(position[half:], velocity[half:], offsets_s=OFFSETS_S[half:])[3:]
    assert apart_m([*first, *second]) < 0.5
    late = lines(position[half + 1 :], velocity[half + 1 :], offsets_s=OFFSETS_S[half + 1 :])[3:]
    with pytest.raises(InvalidScenario, match="PAPER") as caught:
        path_of([*first, *late])
    assert caught.value.code == "orbit_outside_span"


def test_a_horizon_outside_the_span_names_the_satellite() -> None:
    beyond = Horizon(start=HORIZON.start, end=HORIZON.end + timedelta(hours=1))
    flown = satellite(read_oem(lines(*states())))
    mission = replace(SCENARIO, horizon=beyond, satellites=(flown,))
    with pytest.raises(InvalidScenario, match="is usable from 2018-12-31T23:50:00Z to") as caught:
        check_propagation(mission)
    assert caught.value.fault.pointer == "/satellites/0"
    check_propagation(replace(mission, horizon=HORIZON))


def test_ephemerides_are_never_too_old() -> None:
    flown = satellite(read_oem(lines(*states())))
    later = Horizon(start=datetime(2020, 1, 1, tzinfo=UTC), end=datetime(2020, 1, 2, tzinfo=UTC))
    check_element_age(replace(SCENARIO, horizon=later, satellites=(flown,)))


def test_tidy_lines_give_the_same_orbit() -> None:
    orbit = read_oem(lines(*states(), shift_s=18.0, TIME_SYSTEM="GPS"))
    again = read_oem(tidy_lines(orbit))
    assert tidy_lines(again) == tidy_lines(orbit)
    np.testing.assert_array_equal(again.segments[0].position_km, orbit.segments[0].position_km)
    assert again.epoch == orbit.epoch


def test_the_outline_of_tidy_lines_is_that_of_their_orbit() -> None:
    position, velocity = states()
    half = len(OFFSETS_S) // 2
    first = lines(position[: half + 1], velocity[: half + 1], offsets_s=OFFSETS_S[: half + 1])
    second = lines(position[half:], velocity[half:], offsets_s=OFFSETS_S[half:])[3:]
    orbit = read_oem([*first, *second])
    assert outline_of(tidy_lines(orbit)) == Outline(
        object_name="PAPER",
        object_id="2019-001A",
        start=orbit.segments[0].start,
        stop=orbit.segments[1].stop,
        num_states=202,
    )


@pytest.mark.parametrize(
    ("changes", "code", "row"),
    [
        ({"REF_FRAME": "TOD"}, "oem_unsupported", 8),
        ({"CENTER_NAME": "MOON"}, "oem_unsupported", 7),
        ({"TIME_SYSTEM": "UT1"}, "oem_unsupported", 9),
        ({"INTERPOLATION": "SPLINE"}, "oem_unsupported", 12),
        ({"INTERPOLATION_DEGREE": "8"}, "value_out_of_range", 13),
        ({"INTERPOLATION_DEGREE": "seven"}, "value_out_of_range", 13),
        ({"INTERPOLATION_DEGREE": "9" * 5000}, "value_out_of_range", 13),
        ({"INTERPOLATION_DEGREE": ""}, "oem_missing_key", 12),
        ({"OBJECT_ID": ""}, "oem_missing_key", 5),
        ({"STOP_TIME": "tomorrow"}, "oem_epoch", 11),
        ({"STOP_TIME": "2018-12-31T00:00:00"}, "oem_times", 11),
    ],
)
def test_headers_are_refused_by_their_line(changes: dict[str, Any], code: str, row: int) -> None:
    with pytest.raises(InvalidElements) as caught:
        read_oem(lines(*states(), **changes))
    assert (caught.value.code, caught.value.fault.row) == (code, row)


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("2019-01-01T00:06:00 1 2 3", "oem_syntax"),
        ("2019-01-01T00:06:00 7000 0 0 0 seven 0", "oem_number_format"),
        ("2019-01-01T00:06:00 7000 0 0 0 nan 0", "value_out_of_range"),
        ("2019-01-01T00:06:00 7000000 0 0 0 7.5 0", "value_out_of_range"),
        ("2019-01-01T00:06:00 7000 0 0 0 7500 0", "value_out_of_range"),
        ("9999-999T00:00:00 7000 0 0 0 7.5 0", "oem_epoch"),
        ("2018-12-31T00:00:00 7000 0 0 0 7.5 0", "oem_times"),
        ("2019-13-01T00:00:00 7000 0 0 0 7.5 0", "oem_epoch"),
    ],
)
def test_states_are_refused_by_their_line(line: str, code: str) -> None:
    message = lines(*states())
    message[30] = line
    with pytest.raises(InvalidElements) as caught:
        read_oem(message)
    assert (caught.value.code, caught.value.fault.row) == (code, 31)


def test_too_few_states_and_no_segments_are_refused() -> None:
    position, velocity = states()
    for message, code in (
        (lines(position[:3], velocity[:3], offsets_s=OFFSETS_S[:3]), "oem_too_few_states"),
        (["CCSDS_OEM_VERS = 2.0"], "oem_syntax"),
        (["META_STOP", "2019-01-01T00:06:00 7000 0 0 0 7.5 0"], "oem_syntax"),
        (["COVARIANCE_STOP", "A = 1"], "oem_syntax"),
        ([], "oem_syntax"),
        (["CCSDS_OEM_VERS = 2.0", *(["ORIGINATOR = X"] * MOST_LINES)], "too_many_rows"),
    ):
        with pytest.raises(InvalidElements) as caught:
            read_oem(message)
        assert caught.value.code == code


def xml_of(message: Sequence[str]) -> str:
    """Return a message with one segment in XML."""
    at = message.index("META_STOP")
    meta = "".join("<{0}>{1}</{0}>".format(*line.split(" = ")) for line in message[4:at])
    keys = ("EPOCH", "X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
    vectors = "".join(
        "<stateVector>"
        + "".join(f"<{k}>{v}</{k}>" for k, v in zip(keys, line.split(), strict=True))
        + "</stateVector>"
        for line in message[at + 1 :]
    )
    segment = f"<segment><metadata>{meta}</metadata><data>{vectors}</data></segment>"
    return f'<oem id="CCSDS_OEM_VERS" version="2.0"><header/><body>{segment}</body></oem>'


def test_files_in_kvn_and_xml_hold_the_same_orbit(tmp_path: Path) -> None:
    message = lines(*states())
    kvn = read_elements("\n".join(["COMMENT made by hand", *message]).encode(), "text/plain")
    xml = read_elements(xml_of(message).encode(), "application/xml")
    for found in (kvn, xml):
        assert found.faults == ()
        assert found.entries[0].orbit == {"oem": tidy_lines(read_oem(message))}
    assert kvn.entries[0].row == 2


def test_of_two_messages_a_bad_one_is_named_and_the_other_kept() -> None:
    good = lines(*states())
    bad = [line.replace("EARTH", "MARS") for line in lines(*states(), OBJECT_NAME="OTHER")]
    found = read_elements("\n".join([*good, *bad]).encode(), "text/plain")
    assert [entry.elements.name for entry in found.entries] == ["PAPER"]
    assert [(fault.code, fault.row) for fault in found.faults] == [
        ("oem_unsupported", len(good) + 7)
    ]
    xml = xml_of(good).replace("<Y>", "<W>").replace("</Y>", "</W>")
    (fault,) = read_elements(xml.encode(), "application/xml").faults
    assert (fault.code, fault.pointer) == ("oem_missing_key", "/0")
