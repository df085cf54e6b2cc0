"""Modified Rodrigues parameters, Basilisk's form of an attitude (Schaub & Junkins, chapter 3)."""

from __future__ import annotations

import numpy as np

from benchmarks.flight.mission import Floats


def parameters(attitude: Floats) -> Floats:
    """Return the parameters of attitudes, for the rotation by at most 180 degrees.

    Parameters
    ----------
    attitude
        Columns are the body's axes in the inertial frame. Shape ``(n, 3, 3)``.

    Returns
    -------
    Floats
        Shape ``(n, 3)``.
    """
    trace = np.trace(attitude, axis1=1, axis2=2)
    squares = np.column_stack([trace, *(attitude[:, i, i] for i in range(3))])
    # Sheppard's method: divide by the greatest of the four Euler parameters.
    euler = np.empty((len(attitude), 4))
    greatest = squares.argmax(axis=1)
    pairs = [(2, 1), (0, 2), (1, 0)]
    for row, best in enumerate(greatest):
        a = attitude[row]
        if best == 0:
            euler[row, 0] = 1.0 + trace[row]
            euler[row, 1:] = [a[i, j] - a[j, i] for i, j in pairs]
        else:
            i = best - 1
            j, k = (i + 1) % 3, (i + 2) % 3
            euler[row, 0] = a[k, j] - a[j, k]
            euler[row, 1 + i] = 1.0 + 2.0 * a[i, i] - trace[row]
            euler[row, 1 + j] = a[i, j] + a[j, i]
            euler[row, 1 + k] = a[i, k] + a[k, i]
    euler /= np.linalg.norm(euler, axis=1, keepdims=True)
    euler[euler[:, 0] < 0.0] *= -1.0
    parameters: Floats = euler[:, 1:] / (1.0 + euler[:, :1])
    return parameters


def boresights(parameters: Floats) -> Floats:
    """Return where the body's third axis points, in the inertial frame. Shape ``(n, 3)``."""
    x, y, z = parameters.T
    square = (parameters**2).sum(axis=1)
    out = np.column_stack([
        8.0 * x * z + 4.0 * y * (1.0 - square),
        8.0 * y * z - 4.0 * x * (1.0 - square),
        4.0 * (z * z - x * x - y * y) + (1.0 - square) ** 2,
    ])  # fmt: skip
    boresights: Floats = out / ((1.0 + square) ** 2)[:, None]
    return boresights
