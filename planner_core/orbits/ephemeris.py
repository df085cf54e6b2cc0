"""A satellite's path over the horizon: SGP4 or an ephemeris at nodes, and cubics between them.

SGP4 runs once a minute (twice for eccentric orbits). Between nodes a cubic Hermite
polynomial is within 0.4 m of SGP4 in low Earth orbit, which moves an access edge by less than
3 ms. Its rates are derivatives of the positions themselves: SGP4's own velocity differs from
the rate of its position, by 3 m/s in a Molniya orbit, which would cost 13 m between nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from sgp4.api import SGP4_ERRORS

from planner_core.domain import Horizon, Nadir, OrbitElements, OrbitEphemeris, Satellite
from planner_core.errors import PropagationFailed
from planner_core.jit import kernel
from planner_core.orbits import frames
from planner_core.orbits.earth_orientation import EarthOrientation, shipped
from planner_core.orbits.oem_states import positions_teme_km, require_covered
from planner_core.orbits.sgp4_record import satrec
from planner_core.orbits.sun import sun_direction_teme

Floats = npt.NDArray[np.float64]

_STEP_S = 60.0
_ECCENTRIC_STEP_S = 30.0
_ECCENTRIC = 0.1
_STENCIL = 7
"""Nodes that each rate is computed from: exact to sixth order."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ephemeris:
    """States at evenly spaced nodes ``k * step_s`` that cover the horizon exactly.

    Positions in metres, velocities in m/s, each of shape ``(num_nodes, 3)``; Earth-fixed
    velocities are relative to the rotating Earth.

    Attributes
    ----------
    satellite
        Name, for messages.
    duration_s, step_s
        Length of the horizon, and of one of its ``num_nodes - 1`` intervals.
    gmst_rad, xp_rad, yp_rad
        The Earth's orientation at the nodes; ``gmst_rad`` grows without jumps.
    sun_teme
        Unit vector to the sun. Shape ``(num_nodes, 3)``.
    """

    satellite: str
    duration_s: float
    step_s: float
    position_teme_m: Floats
    velocity_teme_m_s: Floats
    position_itrf_m: Floats
    velocity_itrf_m_s: Floats
    gmst_rad: Floats
    xp_rad: Floats
    yp_rad: Floats
    sun_teme: Floats

    @property
    def node_s(self) -> Floats:
        """Instants of the nodes, in seconds."""
        return np.arange(len(self.gmst_rad), dtype=np.float64) * self.step_s

    def state_teme(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Return inertial position and velocity at instants in the horizon, ``(n, 3)`` each."""
        return _between(self.position_teme_m, self.velocity_teme_m_s, self.step_s, t_s)

    def state_itrf(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Return Earth-fixed position and velocity at instants in the horizon."""
        return _between(self.position_itrf_m, self.velocity_itrf_m_s, self.step_s, t_s)

    def to_teme(self, vector: Floats, t_s: Floats) -> Floats:
        """Return Earth-fixed vectors in inertial axes at each instant. Shape ``(n, 3)``."""
        return frames.itrf_to_teme(vector, *self._orientation(t_s))

    def to_itrf(self, vector: Floats, t_s: Floats) -> Floats:
        """Return inertial vectors in Earth-fixed axes at each instant. Shape ``(n, 3)``."""
        return frames.rotate_to_itrf(vector, *self._orientation(t_s))

    def sun_itrf(self, t_s: Floats) -> Floats:
        """Return the Earth-fixed direction to the sun at each instant. Shape ``(n, 3)``."""
        inertial = [np.interp(t_s, self.node_s, self.sun_teme[:, axis]) for axis in range(3)]
        return self.to_itrf(np.stack(inertial, axis=1), t_s)

    def _orientation(self, t_s: Floats) -> tuple[Floats, Floats, Floats]:
        node_s = self.node_s
        return (
            np.interp(t_s, node_s, self.gmst_rad),
            np.interp(t_s, node_s, self.xp_rad),
            np.interp(t_s, node_s, self.yp_rad),
        )

    def track(self, nadir: Nadir) -> Floats:
        """Return the polynomials that the access search evaluates.

        Returns
        -------
        Coefficients in seconds since the interval's start: Earth-fixed position, the local
        vertical at the satellite, and the direction to the sun, three columns each.
        Shape ``(num_nodes - 1, 4, 9)``.
        """
        vertical = (
            frames.geodetic_normal(self.position_itrf_m)
            if nadir == "geodetic"
            else frames.unit(self.position_itrf_m)
        )
        sun = frames.rotate_to_itrf(self.sun_teme, self.gmst_rad, self.xp_rad, self.yp_rad)
        columns = np.hstack([self.position_itrf_m, vertical, sun])
        return _hermite(columns, _rate_at_nodes(columns, self.step_s), self.step_s)


@kernel
def _between(value: Floats, rate: Floats, step_s: float, t_s: Floats) -> tuple[Floats, Floats]:
    """Return value and rate between nodes: the same cubics as ``_hermite``, at many instants."""
    at, rate_at = np.empty((len(t_s), 3)), np.empty((len(t_s), 3))
    for row in range(len(t_s)):
        k = min(max(int(t_s[row] / step_s), 0), len(value) - 2)
        u = t_s[row] / step_s - k
        for axis in range(3):
            v0, v1 = value[k, axis], value[k + 1, axis]
            m0, m1 = rate[k, axis] * step_s, rate[k + 1, axis] * step_s
            c2 = 3.0 * (v1 - v0) - 2.0 * m0 - m1
            c3 = 2.0 * (v0 - v1) + m0 + m1
            at[row, axis] = v0 + u * (m0 + u * (c2 + u * c3))
            rate_at[row, axis] = (m0 + u * (2.0 * c2 + u * 3.0 * c3)) / step_s
    return at, rate_at


def _hermite(value: Floats, rate: Floats, step_s: float) -> Floats:
    v0, v1, r0, r1 = value[:-1], value[1:], rate[:-1], rate[1:]
    c2 = (3.0 * (v1 - v0) / step_s - 2.0 * r0 - r1) / step_s
    c3 = (2.0 * (v0 - v1) / step_s + r0 + r1) / step_s**2
    return np.ascontiguousarray(np.stack([v0, r0, c2, c3], axis=1))


def propagate(
    satellite: Satellite, horizon: Horizon, orientation: EarthOrientation | None = None
) -> Ephemeris:
    """Return a satellite's states over the horizon.

    Parameters
    ----------
    orientation
        UT1 and the pole; by default the table shipped with the package.

    Raises
    ------
    PropagationFailed
        SGP4 gives an error code, or no finite state, at some node.
    InvalidScenario
        ``orbit_outside_span`` if an ephemeris does not cover the horizon.
    """
    orientation = orientation or shipped()
    t_s, jd, fraction = _nodes(satellite, horizon)
    step_s = horizon.duration_s / (len(t_s) - 1)
    dut1_s, xp, yp = orientation.at(jd, fraction)
    gmst = frames.gmst82_rad(jd, fraction + dut1_s / 86400.0)
    if isinstance(satellite.orbit, OrbitEphemeris):
        turned = gmst, xp, yp
        position = 1000.0 * positions_teme_km(satellite.orbit, horizon, t_s, orientation, turned)
    else:
        position = _sgp4_positions(satellite.name, satellite.orbit, horizon, t_s)
    velocity = _rate_at_nodes(position, step_s)
    position_itrf, velocity_itrf = frames.teme_to_itrf(position, velocity, gmst, xp, yp)
    return Ephemeris(
        satellite=satellite.name,
        duration_s=horizon.duration_s,
        step_s=step_s,
        position_teme_m=position,
        velocity_teme_m_s=velocity,
        position_itrf_m=position_itrf,
        velocity_itrf_m_s=velocity_itrf,
        gmst_rad=gmst,
        xp_rad=xp,
        yp_rad=yp,
        sun_teme=sun_direction_teme(jd, fraction),
    )


def check_propagation(satellite: Satellite, horizon: Horizon) -> None:
    """Raise if ``propagate`` would, at less cost."""
    if isinstance(satellite.orbit, OrbitEphemeris):
        require_covered(satellite.orbit, horizon)
        return
    t_s, _, _ = _nodes(satellite, horizon)
    _sgp4_positions(satellite.name, satellite.orbit, horizon, t_s)


def _nodes(satellite: Satellite, horizon: Horizon) -> tuple[Floats, float, Floats]:
    """Return the nodes in seconds since the horizon's start, and as Julian dates in UTC."""
    eccentric = satellite.orbit.eccentricity > _ECCENTRIC
    step_s = _ECCENTRIC_STEP_S if eccentric else _STEP_S
    num_intervals = max(_STENCIL - 1, math.ceil(horizon.duration_s / step_s - 1e-9))
    jd, start = frames.julian_date(horizon.start)
    t_s = np.linspace(0.0, horizon.duration_s, num_intervals + 1)
    return t_s, jd, start + t_s / 86400.0


def _sgp4_positions(name: str, elements: OrbitElements, horizon: Horizon, t_s: Floats) -> Floats:
    """Return positions in metres. Shape ``(n, 3)``."""
    jd, start = frames.julian_date(horizon.start)
    fraction = start + t_s / 86400.0
    codes, position_km, _ = satrec(elements).sgp4_array(np.full_like(fraction, jd), fraction)
    failed = np.flatnonzero((codes != 0) | ~np.isfinite(position_km).all(axis=1))
    if len(failed) > 0:
        code = int(codes[failed[0]])
        at = horizon.instant(float(t_s[failed[0]])).isoformat(timespec="seconds")
        raise PropagationFailed(
            name,
            code,
            f"Satellite {name!r}: SGP4 stops at {at} with error {code} "
            f"({SGP4_ERRORS.get(code, 'no finite state')}).",
        )
    return np.asarray(position_km * 1000.0)


def _rate_at_nodes(value: Floats, step_s: float) -> Floats:
    """Return the rate of evenly sampled functions at their samples. Shape ``(n, k)``."""
    nodes = np.arange(_STENCIL, dtype=np.float64)
    powers = np.arange(_STENCIL)[:, None]
    first_power = (powers[:, 0] == 1).astype(np.float64)
    weights = np.stack([np.linalg.solve((nodes - at) ** powers, first_power) for at in nodes])
    half = _STENCIL // 2
    rate = np.empty_like(value)
    rate[:half] = weights[:half] @ value[:_STENCIL]
    rate[-half:] = weights[-half:] @ value[-_STENCIL:]
    middle = rate[half:-half]
    middle[:] = 0.0
    for offset, weight in enumerate(weights[half]):
        middle += weight * value[offset : offset + len(middle)]
    return rate / step_s
