"""Positions in TEME between the states of an Orbit Ephemeris Message, as its header says."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Final

import erfa
import numpy as np
import numpy.typing as npt

from planner_core.domain import EphemerisSegment, Frame, Horizon, OrbitEphemeris
from planner_core.errors import InvalidScenario
from planner_core.orbits import frames
from planner_core.orbits.earth_orientation import EarthOrientation

Floats = npt.NDArray[np.float64]

_TT_TAI_S: Final = 32.184
_SLACK_S: Final = 1e-3  # between segments that touch, and at the ends
_AT_ONCE: Final = 4096  # instants in a batch, to bound the memory


def positions_teme_km(
    orbit: OrbitEphemeris,
    horizon: Horizon,
    t_s: Floats,
    orientation: EarthOrientation,
    turned: tuple[Floats, Floats, Floats],
) -> Floats:
    """Return positions at instants of a horizon that the message covers. Shape ``(n, 3)``.

    Parameters
    ----------
    t_s
        Seconds since the horizon's start, ascending. Shape ``(n,)``.
    turned
        Sidereal time and the pole at these instants, which relate TEME to the ITRF.

    Raises
    ------
    InvalidScenario
        ``orbit_outside_span``.
    """
    require_covered(orbit, horizon)
    position = np.empty((len(t_s), 3))
    for segment in orbit.segments:
        # At an instant where two segments meet, the later one is used.
        since_s = (segment.start - horizon.start).total_seconds() - _SLACK_S
        until_s = (segment.stop - horizon.start).total_seconds() + _SLACK_S
        rows = np.flatnonzero((t_s >= since_s) & (t_s <= until_s))
        shift_s = (horizon.start - segment.first).total_seconds()
        for first in range(0, len(rows), _AT_ONCE):
            some = rows[first : first + _AT_ONCE]
            local = interpolated_km(segment, t_s[some] + shift_s)
            angles = tuple(angle[some] for angle in turned)
            position[some] = _in_teme(local, segment.frame, horizon.start, t_s[some], orientation,
                                      (angles[0], angles[1], angles[2]))  # fmt: skip
    return position


def require_covered(orbit: OrbitEphemeris, horizon: Horizon) -> None:
    """Refuse a horizon that the message does not cover without a gap.

    Raises
    ------
    InvalidScenario
        ``orbit_outside_span``.
    """
    slack = timedelta(seconds=_SLACK_S)
    covered = horizon.start
    for segment in orbit.segments:
        if segment.start <= covered + slack:
            covered = max(covered, segment.stop)
    if covered + slack >= horizon.end:
        return
    spans = ", ".join(f"{_text(one.start)} to {_text(one.stop)}" for one in orbit.segments[:3])
    more = ", ..." if len(orbit.segments) > 3 else ""
    raise InvalidScenario(
        "orbit_outside_span",
        f"The ephemeris of {orbit.name!r} is usable from {spans}{more}, but the plan needs it from "
        f"{_text(horizon.start)} to {_text(horizon.end)}.",
    )


def interpolated_km(segment: EphemerisSegment, t_s: Floats) -> Floats:
    """Return positions in the segment's own frame. Shape ``(n, 3)``.

    Parameters
    ----------
    t_s
        Seconds since the segment's first state. Shape ``(n,)``.
    """
    is_hermite = segment.interpolation == "HERMITE"
    size = (segment.degree + 1) // 2 if is_hermite else segment.degree + 1
    # As many states before an instant as after it, except near the segment's ends.
    right = np.searchsorted(segment.t_s, t_s, side="right")
    left = np.clip(right - size // 2 - size % 2, 0, len(segment.t_s) - size)
    rows = left[:, None] + np.arange(size)
    nodes_s = segment.t_s[rows]
    scale_s = np.maximum(nodes_s[:, -1:] - nodes_s[:, :1], 1e-9)
    nodes, x = (nodes_s - nodes_s[:, :1]) / scale_s, (t_s[:, None] - nodes_s[:, :1]) / scale_s
    basis, slope = _lagrange(nodes, x)
    if not is_hermite:
        return np.asarray(np.einsum("nk,nkc->nc", basis, segment.position_km[rows]))
    offset = x - nodes
    of_value = (1.0 - 2.0 * offset * slope) * basis**2
    of_rate = offset * basis**2 * scale_s
    return np.asarray(
        np.einsum("nk,nkc->nc", of_value, segment.position_km[rows])
        + np.einsum("nk,nkc->nc", of_rate, segment.velocity_km_s[rows])
    )


def _lagrange(nodes: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return Lagrange's polynomials at ``x``, and the slope of each at its own node.

    Shapes ``(n, k)`` for nodes and results, ``(n, 1)`` for ``x``.
    """
    size = nodes.shape[1]
    basis, slope = np.ones_like(nodes), np.zeros_like(nodes)
    for i in range(size):
        for j in range(size):
            if i != j:
                apart = nodes[:, i] - nodes[:, j]
                basis[:, i] *= (x[:, 0] - nodes[:, j]) / apart
                slope[:, i] += 1.0 / apart
    return basis, slope


def _in_teme(
    position: Floats,
    frame: Frame,
    start: datetime,
    t_s: Floats,
    orientation: EarthOrientation,
    turned: tuple[Floats, Floats, Floats],
) -> Floats:
    if frame == "TEME":
        return position
    if frame != "ITRF":
        position = _inertial_to_itrf(position, frame, start, t_s, orientation)
    return frames.itrf_to_teme(position, *turned)


def _inertial_to_itrf(
    position: Floats, frame: Frame, start: datetime, t_s: Floats, orientation: EarthOrientation
) -> Floats:
    """Return Earth-fixed positions by the IAU 2006/2000A models (ERFA)."""
    jd, day = frames.julian_date(start)
    fraction = day + t_s / 86400.0
    dut1_s, xp, yp = orientation.at(jd, fraction)
    tt_utc_s = orientation.tai_utc_at(jd, fraction) + _TT_TAI_S
    if frame == "EME2000":
        # The mean equator and equinox of 2000 are 0.02 arcseconds off those of the GCRF.
        bias, _, _ = erfa.bp00(jd, day)
        position = position @ bias
    matrix = erfa.c2t06a(jd, fraction + tt_utc_s / 86400.0, jd, fraction + dut1_s / 86400.0, xp, yp)
    return np.asarray(np.einsum("nij,nj->ni", matrix, position))


def _text(instant: datetime) -> str:
    return instant.isoformat(timespec="seconds").replace("+00:00", "Z")
