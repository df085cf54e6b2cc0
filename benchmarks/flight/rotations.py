"""Rotations in three dimensions: slews of burst, coast and burst, and tracking without roll.

A pose is a matrix whose columns are the body's axes in the inertial frame; the boresight is the
third. Rates are vectors of the inertial frame, rad/s.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numba
import numpy as np

from benchmarks.flight.mission import Floats
from benchmarks.flight.world import line_of_sight

BORESIGHT: Final = 2
_BURST_STEPS: Final = 24  # in which the end of a slew is computed
_ROUNDS: Final = 15
_EXACT_RAD: Final = 1e-7
_SMALL: Final = 1e-12
_NUDGE_RAD_S: Final = 1e-6  # to find the derivative of a slew's end with respect to its coast


@numba.njit(cache=True)
def norm(vector: Floats) -> float:
    """Return the length of a vector."""
    return math.sqrt((vector**2).sum())


@numba.njit(cache=True)
def turned(pose: Floats, rotation: Floats) -> Floats:
    """Return a pose rotated about a vector's direction, by its length in rad."""
    angle = norm(rotation)
    if angle < _SMALL:
        return pose.copy()
    axis = rotation / angle
    c, s = math.cos(angle), math.sin(angle)
    out = np.empty((3, 3))
    for column in range(3):
        v = np.ascontiguousarray(pose[:, column])
        out[:, column] = c * v + s * np.cross(axis, v) + (1.0 - c) * (axis * v).sum() * axis
    return out


@numba.njit(cache=True)
def between(direction: Floats, other: Floats) -> Floats:
    """Return the shortest rotation from one direction to another."""
    across = np.cross(direction, other)
    sine, cosine = norm(across), (direction * other).sum()
    if sine < _SMALL:
        return across  # the same; opposite ones never occur here
    return across * (math.atan2(sine, cosine) / sine)


@numba.njit(cache=True)
def facing(direction: Floats, pose: Floats) -> Floats:
    """Return the pose with a given boresight that is nearest to another pose."""
    return turned(pose, between(np.ascontiguousarray(pose[:, BORESIGHT]), direction))


@numba.njit(cache=True)
def bursts_s(spin: Floats, cruise: Floats, end_spin: Floats, acceleration: float) -> Any:
    """Return how long the two bursts of a slew take."""
    return norm(cruise - spin) / acceleration, norm(end_spin - cruise) / acceleration


@numba.njit(cache=True)
def _end(
    pose: Floats, spin: Floats, cruise: Floats, end_spin: Floats, takes_s: float,
    acceleration: float,
) -> Floats:  # fmt: skip
    """Return the pose in which a slew ends."""
    first_s, last_s = bursts_s(spin, cruise, end_spin, acceleration)
    for step in range(_BURST_STEPS):
        rate = spin + (cruise - spin) * ((step + 0.5) / _BURST_STEPS)
        pose = turned(pose, rate * (first_s / _BURST_STEPS))
    pose = turned(pose, cruise * (takes_s - first_s - last_s))
    for step in range(_BURST_STEPS):
        rate = cruise + (end_spin - cruise) * ((step + 0.5) / _BURST_STEPS)
        pose = turned(pose, rate * (last_s / _BURST_STEPS))
    return pose


@numba.njit(cache=True)
def solve(
    pose: Floats, spin: Floats, direction: Floats, end_spin: Floats, takes_s: float,
    acceleration: float,
) -> Any:  # fmt: skip
    """Find the coast of a slew of a given duration between moving lines of sight.

    By Newton's method: of the rates that bring the boresight to its goal, each step takes the one
    of least change, since the rotation about the boresight is free.

    Returns
    -------
    found, cruise
        Whether there is one, and its rate.
    """
    boresight = np.ascontiguousarray(pose[:, BORESIGHT])
    wanted = between(boresight, direction)
    cruise = wanted / takes_s
    for _ in range(3):
        first_s, last_s = bursts_s(spin, cruise, end_spin, acceleration)
        left_s = max(takes_s - (first_s + last_s) / 2.0, 0.1 * takes_s)
        cruise = (wanted - spin * (first_s / 2.0) - end_spin * (last_s / 2.0)) / left_s
    for _ in range(_ROUNDS):
        if not norm(cruise) < 10.0:
            break
        error = _error(pose, spin, cruise, end_spin, takes_s, acceleration, direction)
        size = norm(error)
        if size < _EXACT_RAD:
            return True, cruise
        # Along two axes across the boresight; about the third there is no error.
        one = _across(direction)
        other = np.cross(direction, one)
        slope_one, slope_other = np.empty(3), np.empty(3)
        for axis in range(3):
            nudged = cruise.copy()
            nudged[axis] += _NUDGE_RAD_S
            change = _error(pose, spin, nudged, end_spin, takes_s, acceleration, direction) - error
            slope_one[axis] = (change * one).sum() / _NUDGE_RAD_S
            slope_other[axis] = (change * other).sum() / _NUDGE_RAD_S
        step = _least_change(slope_one, slope_other, (error * one).sum(), (error * other).sum())
        most = 0.5 / takes_s
        cruise = cruise - step * min(1.0, most / max(norm(step), _SMALL))
    return False, cruise


@numba.njit(cache=True)
def _across(direction: Floats) -> Floats:
    """Return some direction perpendicular to another."""
    axis = np.zeros(3)
    axis[np.argmin(np.abs(direction))] = 1.0
    across = np.cross(direction, axis)
    return across / norm(across)


@numba.njit(cache=True)
def _least_change(one: Floats, other: Floats, wanted_one: float, wanted_other: float) -> Floats:
    """Return the shortest vector with the given scalar products with two others."""
    a, b, c = (one * one).sum(), (one * other).sum(), (other * other).sum()
    square = max(a * c - b * b, 1e-9 * a * c)
    x = (c * wanted_one - b * wanted_other) / square
    y = (a * wanted_other - b * wanted_one) / square
    change: Floats = x * one + y * other
    return change


@numba.njit(cache=True)
def _error(
    pose: Floats, spin: Floats, cruise: Floats, end_spin: Floats, takes_s: float,
    acceleration: float, direction: Floats,
) -> Floats:  # fmt: skip
    """Return the rotation from the wanted boresight to the one at the slew's end."""
    end = _end(pose, spin, cruise, end_spin, takes_s, acceleration)
    return between(direction, np.ascontiguousarray(end[:, BORESIGHT]))


@numba.njit(cache=True)
def draw(
    pose: Floats, spin: Floats, cruise: Floats, end_spin: Floats, span_s: Floats,
    acceleration: float, step_s: float, first: int, poses: Floats, rates: Floats,
) -> Floats:  # fmt: skip
    """Write a slew's poses and rates at even steps; return the pose at its end.

    Parameters
    ----------
    span_s
        When it begins and ends. Shape ``(2,)``.
    first
        The step at which ``poses`` begins.
    """
    begin_s, end_s = span_s
    first_s, last_s = bursts_s(spin, cruise, end_spin, acceleration)
    now_s = begin_s
    for row in range(len(poses) + 1):
        until_s = min((first + row) * step_s, end_s) if row < len(poses) else end_s
        for corner_s in (begin_s + first_s, end_s - last_s):
            if now_s < corner_s < until_s:
                pose = _go(pose, spin, cruise, end_spin, span_s, acceleration, now_s, corner_s)
                now_s = corner_s
        pose = _go(pose, spin, cruise, end_spin, span_s, acceleration, now_s, until_s)
        now_s = until_s
        if row < len(poses):
            poses[row] = pose
            rates[row] = _rate(spin, cruise, end_spin, span_s, acceleration, now_s)
    return pose


@numba.njit(cache=True)
def _go(
    pose: Floats, spin: Floats, cruise: Floats, end_spin: Floats, span_s: Floats,
    acceleration: float, from_s: float, to_s: float,
) -> Floats:  # fmt: skip
    middle_s = (from_s + to_s) / 2.0
    rate = _rate(spin, cruise, end_spin, span_s, acceleration, middle_s)
    return turned(pose, rate * (to_s - from_s))


@numba.njit(cache=True)
def _rate(
    spin: Floats, cruise: Floats, end_spin: Floats, span_s: Floats, acceleration: float,
    time_s: float,
) -> Floats:  # fmt: skip
    first_s, last_s = bursts_s(spin, cruise, end_spin, acceleration)
    since_s, left_s = time_s - span_s[0], span_s[1] - time_s
    rate: Floats = cruise.copy()
    if since_s < first_s:
        rate = spin + (cruise - spin) * (since_s / first_s)
    elif left_s < last_s:
        rate = end_spin + (cruise - end_spin) * (left_s / last_s)
    return rate


@numba.njit(cache=True)
def track(
    where: Any, ecef_km: Floats, pose: Floats, step_s: float, first: int, poses: Floats,
    rates: Floats,
) -> None:  # fmt: skip
    """Write poses that keep the boresight on a site and do not roll about it, and their rates."""
    for row in range(len(poses)):
        direction, rate = line_of_sight(where, ecef_km, (first + row) * step_s)
        pose = facing(direction, pose)
        poses[row] = pose
        rates[row] = rate
