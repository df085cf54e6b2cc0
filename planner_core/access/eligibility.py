"""Who may image a target, and when: sensor types, release and due times.

None of it is geometry. Accesses to a target are found only for satellites with the sensor type it
asks for, and cut to the time between its release and due times; later steps see only the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planner_core.access.windows import Accesses
from planner_core.domain import Horizon, Sensor, Target

Floats = npt.NDArray[np.float64]
Longs = npt.NDArray[np.int64]

_ROUNDING_MS = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Eligibility:
    """What targets ask for besides geometry, as columns; shape ``(num_targets,)`` each.

    Attributes
    ----------
    release_s, due_s
        Seconds from the start of the horizon, rounded inward to the millisecond; infinite for
        no limit.
    sensor_type
        None for any.
    """

    release_s: Floats
    due_s: Floats
    sensor_type: tuple[str | None, ...]

    @classmethod
    def of(cls, targets: Sequence[Target], horizon: Horizon) -> Eligibility:
        """Return what targets ask for, in their order."""
        release_s = np.array(
            [-np.inf if t.release is None else horizon.offset_s(t.release) for t in targets],
            dtype=np.float64,
        )
        due_s = np.array(
            [np.inf if t.due is None else horizon.offset_s(t.due) for t in targets],
            dtype=np.float64,
        )
        return cls(
            release_s=np.ceil(release_s * 1000.0 - _ROUNDING_MS) / 1000.0,
            due_s=np.floor(due_s * 1000.0 + _ROUNDING_MS) / 1000.0,
            sensor_type=tuple(t.sensor_type for t in targets),
        )

    def served_by(self, sensor: Sensor) -> Longs:
        """Return the targets that a sensor may image, ascending."""
        return np.array(
            [
                index
                for index, wanted in enumerate(self.sensor_type)
                if wanted is None or wanted == sensor.sensor_type
            ],
            dtype=np.int64,
        )

    def in_time(self, accesses: Accesses) -> Accesses:
        """Return the accesses to targets, cut to the time between release and due times."""
        start_s = np.maximum(accesses.start_s, self.release_s[accesses.site])
        end_s = np.minimum(accesses.end_s, self.due_s[accesses.site])
        kept = start_s < end_s
        if kept.all():
            return replace(accesses, start_s=start_s, end_s=end_s)
        return Accesses(
            site=accesses.site[kept],
            start_s=start_s[kept],
            end_s=end_s[kept],
            starts_cut=accesses.starts_cut[kept],
            ends_cut=accesses.ends_cut[kept],
        )
