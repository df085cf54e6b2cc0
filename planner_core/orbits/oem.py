"""Orbit Ephemeris Messages (CCSDS 502.0-B, section 5), read from KVN or XML, written as tidy KVN.

States may be in TEME, EME2000, GCRF or an ITRF, about the Earth, in UTC, TAI, TT or GPS time.
Accelerations and covariances are ignored: nothing here needs them.

Codes: ``oem_syntax``, ``oem_missing_key``, ``oem_unsupported``, ``oem_epoch``,
``oem_number_format``, ``oem_times``, ``oem_too_few_states``, ``omm_text``,
``value_out_of_range``, ``too_many_rows``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Final, get_args

import numpy as np

from planner_core.domain import EphemerisSegment, Frame, OrbitEphemeris
from planner_core.errors import InvalidElements
from planner_core.orbits import frames
from planner_core.orbits.earth_orientation import shipped
from planner_core.orbits.element_ranges import is_plain_text
from planner_core.orbits.omm_files import Lines, kvn_messages

MOST_STATES: Final = 100_000
"""In one message: ten weeks at one state a minute."""

MOST_LINES: Final = 2 * MOST_STATES
"""In one message, covariances included."""

_GM_KM3_S2: Final = 398_600.4418
_LOWEST_KM, _HIGHEST_KM = 6_400.0, 500_000.0
_FASTEST_KM_S: Final = 20.0
_TT_TAI_S, _TAI_GPS_S = 32.184, 19.0
_FRAMES: Final[Mapping[str, Frame]] = {
    **{name: name for name in get_args(Frame)}, "J2000": "EME2000", "GCRS": "GCRF", "ICRF": "GCRF",
}  # fmt: skip
_MUST_STAND: Final = (
    "OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME", "TIME_SYSTEM", "START_TIME", "STOP_TIME"
)  # fmt: skip
_DEFAULT_DEGREE: Final = 7
"""If a header does not say how to interpolate: by HERMITE, from the four states around."""
_MOST_DEGREE: Final = 31
_COLUMNS: Final = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")


@dataclass(frozen=True, slots=True, kw_only=True)
class OemSegment:
    """A segment as read from a file.

    Attributes
    ----------
    meta, rows
        Keywords with their values, and their line numbers if the format has lines.
    states
        Epoch and the six numbers of each state, as text, and its line number.
    """

    meta: dict[str, str] = field(default_factory=dict)
    rows: dict[str, int] = field(default_factory=dict)
    states: list[tuple[str, Sequence[str], int | None]] = field(default_factory=list)


def ephemeris_of(segments: Sequence[OemSegment]) -> OrbitEphemeris:
    """Return the orbit of one message.

    Raises
    ------
    InvalidElements
        With the line at fault, if the format has lines.
    """
    if not segments:
        raise _refused("oem_syntax", "The message holds no segment")
    if sum(len(segment.states) for segment in segments) > MOST_STATES:
        detail = f"The message has more than {MOST_STATES} states; split it"
        raise _refused("too_many_rows", detail)
    read = [_segment(segment) for segment in segments]
    names = {(one.meta["OBJECT_NAME"], one.meta["OBJECT_ID"]) for one in segments}
    if len(names) > 1:
        raise _refused(
            "oem_unsupported", "The segments are of several objects: give each its own message"
        )
    for before, after in itertools.pairwise(read):
        if after.start < before.stop:
            detail = (
                f"The segment that is usable from {_text(after.start)} begins before the "
                "previous one ends"
            )
            raise _refused("oem_times", detail)
    name, object_id = names.pop()
    for text in (name, object_id):
        if not is_plain_text(text):
            raise _refused("omm_text", "OBJECT_NAME or OBJECT_ID is too long or not printable text")
    axis_km, eccentricity = _shape(read[0])
    return OrbitEphemeris(
        name=name or None,
        object_id=object_id,
        segments=tuple(read),
        semi_major_axis_km=axis_km,
        eccentricity=eccentricity,
        period_s=2.0 * math.pi * math.sqrt(axis_km**3 / _GM_KM3_S2),
    )


def read_oem(lines: Iterable[str]) -> OrbitEphemeris:
    """Return the orbit of one message in KVN.

    Raises
    ------
    InvalidElements
        If it cannot be read.
    """
    messages = list(kvn_messages(lines, MOST_LINES))
    if len(messages) != 1:
        raise _refused("oem_syntax", f"Expected one message, got {len(messages)}")
    return ephemeris_of(kvn_segments(messages[0]))


def kvn_segments(lines: Lines) -> list[OemSegment]:
    """Return the segments of one message in KVN.

    Raises
    ------
    InvalidElements
        ``oem_syntax`` for a line that does not belong where it stands, ``too_many_rows``.
    """
    segments: list[OemSegment] = []
    part = "header"
    if len(lines) > MOST_LINES:
        raise _refused("too_many_rows", f"The message has more than {MOST_LINES} lines; split it")
    for row, line in lines:
        if line == "META_START":
            segments.append(OemSegment())
            part = "meta"
        elif not segments and "=" not in line:
            raise _refused("oem_syntax", f"Expected META_START, got {_shown(line)}", row)
        elif line in {"META_STOP", "COVARIANCE_STOP"}:
            part = "data"
        elif line == "COVARIANCE_START":
            part = "covariance"
        elif part == "meta":
            key, equals, value = (piece.strip() for piece in line.partition("="))
            if not equals:
                raise _refused("oem_syntax", f"Expected KEYWORD = value, got {_shown(line)}", row)
            segments[-1].meta[key], segments[-1].rows[key] = value, row
        elif part == "data":
            epoch, *numbers = line.split()
            if len(numbers) not in (6, 9):
                detail = f"Expected an epoch and 6 numbers, got {_shown(line)}"
                raise _refused("oem_syntax", detail, row)
            segments[-1].states.append((epoch, numbers[:6], row))
    return segments


def tidy_lines(orbit: OrbitEphemeris) -> list[str]:
    """Return the lines of the message in KVN as stored: everything that is used, in UTC.

    Reading them back gives the same states to the last bit.
    """
    lines = [
        "CCSDS_OEM_VERS = 2.0",
        f"CREATION_DATE = {_text(orbit.epoch)}",
        "ORIGINATOR = SLEWLINE",
    ]
    for segment in orbit.segments:
        lines += [
            "META_START",
            f"OBJECT_NAME = {orbit.name or ''}",
            f"OBJECT_ID = {orbit.object_id}",
            "CENTER_NAME = EARTH",
            f"REF_FRAME = {segment.frame}",
            "TIME_SYSTEM = UTC",
            f"START_TIME = {_text(segment.first)}",
            f"USEABLE_START_TIME = {_text(segment.start)}",
            f"USEABLE_STOP_TIME = {_text(segment.stop)}",
            f"STOP_TIME = {_text(segment.first + timedelta(seconds=float(segment.t_s[-1])))}",
            f"INTERPOLATION = {segment.interpolation}",
            f"INTERPOLATION_DEGREE = {segment.degree}",
            "META_STOP",
        ]
        states = np.hstack([segment.position_km, segment.velocity_km_s]).tolist()
        for t_s, state in zip(segment.t_s.tolist(), states, strict=True):
            epoch = _text(segment.first + timedelta(seconds=t_s))
            lines.append(" ".join([epoch, *map(repr, state)]))
    return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """The object of an ephemeris, when it may be used, and how many states it has."""

    object_name: str
    object_id: str
    start: datetime
    stop: datetime
    num_states: int


def outline_of(tidy: Sequence[str]) -> Outline:
    """Return the outline of tidy lines, without reading their states."""
    header: dict[str, str] = {}
    num_headers = 0
    for line in tidy:
        key, equals, value = line.partition("=")
        if equals or line.startswith("META_"):
            num_headers += 1
        # The start is that of the first segment, the stop that of the last.
        if equals and not (key == "USEABLE_START_TIME " and key in header):
            header[key] = value.strip()
    return Outline(
        object_name=header["OBJECT_NAME "],
        object_id=header["OBJECT_ID "],
        start=_instant(header["USEABLE_START_TIME "], None),
        stop=_instant(header["USEABLE_STOP_TIME "], None),
        num_states=len(tidy) - num_headers,
    )


def _segment(read: OemSegment) -> EphemerisSegment:
    meta, rows = read.meta, read.rows
    missing = [key for key in _MUST_STAND if key not in meta]
    if missing:
        raise _refused(
            "oem_missing_key", f"{missing[0]} is missing", min(rows.values(), default=None)
        )
    frame = _frame(meta["REF_FRAME"], rows.get("REF_FRAME"))
    if meta["CENTER_NAME"].upper() != "EARTH":
        detail = f"CENTER_NAME is {_shown(meta['CENTER_NAME'])}, must be EARTH"
        raise _refused("oem_unsupported", detail, rows.get("CENTER_NAME"))
    interpolation, degree = _rule(meta, rows)
    times = [_instant(epoch, row) for epoch, _, row in read.states]
    num_needed = (degree + 1) // 2 if interpolation == "HERMITE" else degree + 1
    if len(times) < max(2, num_needed):
        detail = f"{interpolation} of degree {degree} needs {max(2, num_needed)} states"
        raise _refused("oem_too_few_states", f"{detail}, the segment has {len(times)}",
                       rows.get("START_TIME"))  # fmt: skip
    for earlier, later, (_, _, row) in zip(times, times[1:], read.states[1:], strict=False):
        if later <= earlier:
            raise _refused("oem_times", "The states are not in time order", row)
    numbers = np.array([_numbers(texts, row) for _, texts, row in read.states])
    shift = timedelta(seconds=_to_utc_s(meta["TIME_SYSTEM"], times[0], rows.get("TIME_SYSTEM")))
    start, stop = (
        _instant(meta.get(key) or meta[default], rows.get(key) or rows.get(default))
        for key, default in (
            ("USEABLE_START_TIME", "START_TIME"), ("USEABLE_STOP_TIME", "STOP_TIME"),
        )
    )  # fmt: skip
    start, stop = max(start, times[0]), min(stop, times[-1])
    if stop <= start:
        raise _refused("oem_times", "The usable span of a segment has no length",
                       rows.get("USEABLE_STOP_TIME") or rows.get("STOP_TIME"))  # fmt: skip
    return EphemerisSegment(
        frame=frame,
        interpolation="HERMITE" if interpolation == "HERMITE" else "LAGRANGE",
        degree=degree,
        first=times[0] + shift,
        start=start + shift,
        stop=stop + shift,
        t_s=np.array([(time - times[0]).total_seconds() for time in times]),
        position_km=np.ascontiguousarray(numbers[:, :3]),
        velocity_km_s=np.ascontiguousarray(numbers[:, 3:]),
    )


def _frame(name: str, row: int | None) -> Frame:
    known = "ITRF" if name.upper().startswith("ITRF") else name.upper()
    if known not in _FRAMES:
        offered = ", ".join(get_args(Frame))
        raise _refused(
            "oem_unsupported", f"REF_FRAME is {_shown(name)}, must be one of {offered}", row
        )
    return _FRAMES[known]


def _rule(meta: Mapping[str, str], rows: Mapping[str, int]) -> tuple[str, int]:
    """Return how a segment is interpolated, and the degree."""
    name = meta.get("INTERPOLATION", "").upper()
    if not name:
        return "HERMITE", _DEFAULT_DEGREE
    row = rows.get("INTERPOLATION")
    if name == "LINEAR":
        return "LAGRANGE", 1
    if name not in ("LAGRANGE", "HERMITE"):
        detail = f"INTERPOLATION is {_shown(name)}, must be HERMITE, LAGRANGE or LINEAR"
        raise _refused("oem_unsupported", detail, row)
    text = meta.get("INTERPOLATION_DEGREE", "")
    if not text:
        raise _refused("oem_missing_key", "INTERPOLATION_DEGREE is missing", row)
    degree = int(text) if text.isascii() and text.isdigit() and len(text) < 4 else 0
    row = rows.get("INTERPOLATION_DEGREE")
    if not 1 <= degree <= _MOST_DEGREE:
        detail = f"INTERPOLATION_DEGREE is {_shown(text)}, must be from 1 to {_MOST_DEGREE}"
        raise _refused("value_out_of_range", detail, row)
    if name == "HERMITE" and degree % 2 == 0:
        detail = (
            f"INTERPOLATION_DEGREE is {degree}: HERMITE, with a velocity at each state, needs "
            "an odd one"
        )
        raise _refused("value_out_of_range", detail, row)
    return name, degree


def _instant(text: str, row: int | None) -> datetime:
    tidy = text.removesuffix("Z")
    try:
        if len(tidy) > 8 and tidy[8] == "T":  # 2019-001T00:00:00, by day of the year
            first = datetime.fromisoformat(f"{tidy[:4]}-01-01{tidy[8:]}")
            instant = first + timedelta(days=int(tidy[5:8]) - 1)
        else:
            instant = datetime.fromisoformat(tidy)
    except (ValueError, OverflowError):
        instant = None
    if instant is None or instant.tzinfo is not None or "T" not in tidy:
        detail = f"{_shown(text)} is not an instant: write 2026-01-31T12:00:00.000"
        raise _refused("oem_epoch", detail, row)
    if not 1957 <= instant.year <= 2199:
        raise _refused(
            "value_out_of_range", f"The year is {instant.year}, must be 1957 to 2199", row
        )
    return instant.replace(tzinfo=UTC)


def _to_utc_s(system: str, first: datetime, row: int | None) -> float:
    """Return the seconds to add to reach UTC; leap seconds after ``first`` are ignored."""
    if system == "UTC":
        return 0.0
    jd, day = frames.julian_date(first)
    tai_utc_s = float(shipped().tai_utc_at(jd, np.array([day]))[0])
    after_utc_s = {
        "TAI": tai_utc_s, "TT": tai_utc_s + _TT_TAI_S, "GPS": tai_utc_s - _TAI_GPS_S,
    }  # fmt: skip
    if system not in after_utc_s:
        detail = f"TIME_SYSTEM is {_shown(system)}, must be UTC, TAI, TT or GPS"
        raise _refused("oem_unsupported", detail, row)
    return -after_utc_s[system]


def _numbers(texts: Sequence[str], row: int | None) -> list[float]:
    numbers = []
    for name, text in zip(_COLUMNS, texts, strict=True):
        try:
            numbers.append(float(text))
        except ValueError:
            raise _refused(
                "oem_number_format", f"{name} is {_shown(text)}, not a number", row
            ) from None
    radius_km = math.sqrt(sum(x * x for x in numbers[:3]))
    if not _LOWEST_KM <= radius_km <= _HIGHEST_KM:
        detail = f"The state is {radius_km:.0f} km from the Earth's centre: positions must be in km"
        raise _refused("value_out_of_range", detail, row)
    if not all(abs(rate) <= _FASTEST_KM_S for rate in numbers[3:]):
        detail = f"A velocity exceeds {_FASTEST_KM_S:.0f} km/s: velocities must be in km/s"
        raise _refused("value_out_of_range", detail, row)
    return numbers


def _shape(segment: EphemerisSegment) -> tuple[float, float]:
    """Return semi-major axis (km) and eccentricity at a segment's first state."""
    position, velocity = segment.position_km[0], segment.velocity_km_s[0]
    if segment.frame == "ITRF":
        spin = np.array([0.0, 0.0, frames.EARTH_ROTATION_RAD_S])
        velocity = velocity + np.cross(spin, position)
    radius_km, square = float(np.linalg.norm(position)), float(velocity @ velocity)
    energy = 0.5 * square - _GM_KM3_S2 / radius_km
    if energy >= 0.0:
        raise _refused(
            "value_out_of_range", "The first state escapes the Earth: velocities must be in km/s"
        )
    momentum = np.cross(position, velocity)
    square = 1.0 + 2.0 * energy * float(momentum @ momentum) / _GM_KM3_S2**2
    return -0.5 * _GM_KM3_S2 / energy, math.sqrt(max(0.0, square))


def _refused(code: str, detail: str, row: int | None = None) -> InvalidElements:
    return InvalidElements(code, detail, pointer="/oem", row=row)


def _text(instant: datetime) -> str:
    return instant.replace(tzinfo=None).isoformat(timespec="microseconds")


def _shown(text: str) -> str:
    return ascii(text[:40])
