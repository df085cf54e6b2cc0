"""Sites on the ground: targets to be imaged, and stations that receive data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime

from planner_core.domain.checks import check_light, check_sensor_type, require, require_finite
from planner_core.domain.spacecraft import LookSide, OrbitDirection


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A point on the ground to be imaged once, by any satellite.

    The limits from ``off_nadir_min_deg`` to ``orbit_direction`` have the names and meanings of
    those of ``Sensor``, and narrow them: a collect meets both.

    Attributes
    ----------
    name
        For people. None if there is only the id.
    release, due
        Aware instants between which a collect lies as a whole. None for no limit.
    sensor_type
        Only satellites whose sensor has this type may collect it. None for any satellite.
    reward_half_life_s
        The reward halves with every half-life from ``release``, or else the horizon's start, to the
        start of the collect. None if it does not fall.
    """

    id: str
    lat_deg: float
    lon_deg: float
    name: str | None = None
    alt_m: float = 0.0
    reward: float = 1.0
    collect_s: float = 30.0
    off_nadir_min_deg: float | None = None
    off_nadir_max_deg: float | None = None
    min_elevation_deg: float | None = None
    sun_elevation_min_deg: float | None = None
    sun_elevation_max_deg: float | None = None
    local_time_from_h: float | None = None
    local_time_to_h: float | None = None
    look_side: LookSide = "any"
    orbit_direction: OrbitDirection = "any"
    release: datetime | None = None
    due: datetime | None = None
    sensor_type: str | None = None
    reward_half_life_s: float | None = None
    catalog_id: str | None = None

    def __post_init__(self) -> None:
        require_finite(self, "lat_deg", "lon_deg", "alt_m", "reward", "collect_s")
        require(-90 <= self.lat_deg <= 90, "lat_deg", "must be between -90 and 90")
        require(-180 <= self.lon_deg <= 360, "lon_deg", "must be between -180 and 360")
        require(-500 <= self.alt_m <= 10000, "alt_m", "must be between -500 and 10000")
        require(self.reward >= 0, "reward", "must be 0 or more")
        require(self.collect_s > 0, "collect_s", "must be greater than 0")
        for name in ("off_nadir_min_deg", "off_nadir_max_deg", "min_elevation_deg"):
            value = getattr(self, name)
            require(value is None or 0 <= value <= 90, name, "must be between 0 and 90")
        check_light(self)
        for name, instant in (("release", self.release), ("due", self.due)):
            require(instant is None or instant.tzinfo is not None, name, "needs a time zone")
        require(
            self.release is None or self.due is None or self.release < self.due,
            "due",
            "must be later than release",
        )
        check_sensor_type(self.sensor_type)
        half_life_s = self.reward_half_life_s
        require(
            half_life_s is None or 0 < half_life_s < math.inf,
            "reward_half_life_s",
            "must be greater than 0",
        )

    @property
    def title(self) -> str:
        """What people call it: its name, if it has one, and its id.

        >>> Target(id="7", name="Bern", lat_deg=46.9, lon_deg=7.4).title
        'Bern (7)'
        """
        return self.id if self.name is None else f"{self.name} ({self.id})"


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundStation:
    """A ground station that serves ``antennas`` satellites at a time.

    ``elevation_mask`` is a tuple of (azimuth_deg, elevation_deg) knots, linear between
    them and round the compass; the higher of mask and ``min_elevation_deg`` applies.

    Attributes
    ----------
    setup_s
        Time at the beginning of each contact in which nothing is downlinked.
    downlink_gain
        Factor on each satellite's downlink rate.
    """

    id: str
    name: str
    lat_deg: float
    lon_deg: float
    alt_m: float = 0.0
    min_elevation_deg: float = 5.0
    min_contact_s: float = 0.0
    elevation_mask: tuple[tuple[float, float], ...] = ()
    antennas: int = 1
    setup_s: float = 0.0
    downlink_gain: float = 1.0

    def __post_init__(self) -> None:
        require_finite(self, "lat_deg", "lon_deg", "alt_m", "min_elevation_deg", "min_contact_s")
        require(-90 <= self.lat_deg <= 90, "lat_deg", "must be between -90 and 90")
        require(-180 <= self.lon_deg <= 360, "lon_deg", "must be between -180 and 360")
        require(
            0 <= self.min_elevation_deg < 90, "min_elevation_deg", "must be at least 0 and below 90"
        )
        require(self.min_contact_s >= 0, "min_contact_s", "must be 0 or more")
        require(self.antennas >= 1, "antennas", "must be 1 or more")
        require_finite(self, "setup_s", "downlink_gain")
        require(self.setup_s >= 0, "setup_s", "must be 0 or more")
        require(self.downlink_gain > 0, "downlink_gain", "must be greater than 0")
