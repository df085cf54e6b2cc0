"""Satellites: their orbits, and what they can do."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import numpy as np
import numpy.typing as npt

from planner_core.domain.checks import (
    check_downlink,
    check_light,
    check_sensor_type,
    check_sun_exclusion,
    make_real,
    require,
    require_finite,
)
from planner_core.domain.orbit_ephemeris import OrbitEphemeris

Nadir = Literal["geodetic", "geocentric"]
LookSide = Literal["left", "right", "any"]
OrbitDirection = Literal["ascending", "descending", "any"]
SunPointing = Literal["free", "slew"]
SlewModel = Literal["rest", "moving"]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitElements:
    """One SGP4 mean element set, whatever format it came in.

    Angles are mean elements in the TEME frame. ``norad_cat_id`` may have up to nine
    digits; SGP4 itself never sees it.
    """

    name: str | None
    norad_cat_id: int
    object_id: str
    epoch: datetime
    mean_motion_rev_day: float
    eccentricity: float
    inclination_deg: float
    raan_deg: float
    arg_perigee_deg: float
    mean_anomaly_deg: float
    bstar: float = 0.0
    mean_motion_dot: float = 0.0
    mean_motion_ddot: float = 0.0
    element_set_no: int = 999
    rev_at_epoch: int = 0
    classification: str = "U"

    @property
    def period_s(self) -> float:
        """Mean (Kozai) orbital period."""
        return 86400.0 / self.mean_motion_rev_day


Orbit = OrbitElements | OrbitEphemeris


def mean_elements(orbit: Orbit) -> OrbitElements:
    """Return an orbit that is given by elements; raise `TypeError` for an ephemeris."""
    if isinstance(orbit, OrbitElements):
        return orbit
    raise TypeError(f"The orbit of {orbit.name!r} is an ephemeris.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Agility:
    """How fast the satellite slews. Defaults are the paper's: 1 deg/s, reached at once.

    Attributes
    ----------
    slew_model
        From rest to rest, or from the moving line of sight of one task to that of another.
    sun_exclusion_deg
        Least angle between boresight and sun during slews; None for no limit. Planning ignores it;
        the flight simulation of the benchmarks checks it.
    """

    slew_rate_deg_s: float = 1.0
    acceleration_deg_s2: float | None = None
    settle_s: float = 0.0
    slew_model: SlewModel = "rest"
    sun_exclusion_deg: float | None = None

    def __post_init__(self) -> None:
        require_finite(self, "slew_rate_deg_s", "acceleration_deg_s2", "settle_s")
        check_sun_exclusion(self.sun_exclusion_deg)
        require(self.slew_rate_deg_s > 0, "slew_rate_deg_s", "must be greater than 0")
        require(
            self.acceleration_deg_s2 is None or self.acceleration_deg_s2 > 0,
            "acceleration_deg_s2",
            "must be greater than 0, or null for an instant start",
        )
        require(self.settle_s >= 0, "settle_s", "must be 0 or more")
        require(
            self.slew_model == "rest" or self.acceleration_deg_s2 is not None,
            "slew_model",
            "moving needs an acceleration_deg_s2",
        )
        make_real(self, "slew_rate_deg_s", "acceleration_deg_s2", "settle_s")

    @property
    def tracks(self) -> bool:
        """Whether slews begin and end at the rates of moving lines of sight."""
        return self.slew_model == "moving"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """The limits of imaging. Visibility (elevation >= 0) is always required.

    Attributes
    ----------
    off_nadir_min_deg, off_nadir_max_deg
        Of the line of sight, from the vertical that ``nadir`` names.
    nadir
        Vertical of the ellipsoid (geodetic) or towards the Earth's centre (geocentric).
    look_side
        Side of the target as seen along the satellite's velocity over the ground.
    min_elevation_deg
        Of the satellite, as the target sees it.
    sun_elevation_min_deg, sun_elevation_max_deg
        Of the sun, as the target sees it, without refraction. None for no limit.
    local_time_from_h, local_time_to_h
        Local apparent solar time at the target, in hours from midnight; a span from 22 to 2
        runs over midnight. None for no limit.
    orbit_direction
        Ascending while the satellite moves north.
    sensor_type
        A name by which targets may ask for it; None serves only targets that ask for no type.
    sun_exclusion_deg
        Least angle between the line of sight and the sun. None for no limit.
    """

    off_nadir_min_deg: float = 5.0
    off_nadir_max_deg: float = 55.0
    nadir: Nadir = "geodetic"
    look_side: LookSide = "any"
    min_elevation_deg: float = 0.0
    sun_elevation_min_deg: float | None = None
    sun_elevation_max_deg: float | None = None
    local_time_from_h: float | None = None
    local_time_to_h: float | None = None
    orbit_direction: OrbitDirection = "any"
    sensor_type: str | None = None
    sun_exclusion_deg: float | None = None

    def __post_init__(self) -> None:
        require_finite(self, "off_nadir_min_deg", "off_nadir_max_deg", "min_elevation_deg")
        check_sun_exclusion(self.sun_exclusion_deg)
        require(0 <= self.off_nadir_min_deg <= 90, "off_nadir_min_deg", "must be between 0 and 90")
        require(
            self.off_nadir_min_deg <= self.off_nadir_max_deg <= 90,
            "off_nadir_max_deg",
            "must be between off_nadir_min_deg and 90",
        )
        require(
            0 <= self.min_elevation_deg < 90, "min_elevation_deg", "must be at least 0 and below 90"
        )
        check_light(self)
        check_sensor_type(self.sensor_type)


@dataclass(frozen=True, slots=True, kw_only=True)
class Resources:
    """Battery and recorder: levels as fractions of capacity, and rates of them per second.

    All rates are magnitudes: the model knows which of them charge and which drain.

    Attributes
    ----------
    sunpoint_charge_per_s
        Net charge while sun-pointing.
    collect_drain_per_s, contact_drain_per_s
        Net draw of the two modes.
    collect_fill_per_s, downlink_per_s, telemetry_per_s
        What a collect writes, a contact downlinks, and telemetry adds at all times.
    downlink_by_elevation
        Knots of elevation at the station in degrees and downlink rate per second, linear between
        and constant beyond; ``downlink_per_s`` applies if there are none.
    recorder_capacity_mbit
        Size of the recorder, or None if only fractions are known (the presets).
    sun_pointing
        Whether all idle time counts as pointing at the sun (``free``), or only what is left
        between a slew to the sun and one back (``slew``).
    panel_angle_deg
        Between the normal of the panels and the boresight, about which rotation is free.
    idle_drain_per_s
        Drawn at all times, in shadow too; the modes' rates come on top of it.
    """

    battery_min_fraction: float
    initial_battery_fraction: float
    sunpoint_charge_per_s: float
    collect_drain_per_s: float
    contact_drain_per_s: float
    recorder_max_fraction: float
    initial_recorder_fraction: float
    collect_fill_per_s: float
    downlink_per_s: float
    telemetry_per_s: float
    eclipse_aware: bool = False
    recorder_capacity_mbit: float | None = None
    sun_pointing: SunPointing = "free"
    panel_angle_deg: float = 180.0
    idle_drain_per_s: float = 0.0
    downlink_by_elevation: tuple[tuple[float, float], ...] = ()

    def downlink_at(self, elevation_deg: Floats) -> Floats:
        """Return the downlink rate per second at each elevation, for a station of gain 1."""
        if not self.downlink_by_elevation:
            return np.full_like(elevation_deg, self.downlink_per_s)
        knots = np.array(self.downlink_by_elevation, dtype=np.float64)
        return np.interp(elevation_deg, knots[:, 0], knots[:, 1])

    @property
    def knows_free_charge_alone(self) -> bool:
        """Whether idle time costs nothing and charges throughout, as in the paper."""
        return self.sun_pointing == "free" and self.idle_drain_per_s == 0.0

    @classmethod
    def limitless(cls) -> Resources:
        """Return resources that nothing draws on or fills, so that agility alone counts."""
        return cls(
            battery_min_fraction=0.0,
            initial_battery_fraction=1.0,
            sunpoint_charge_per_s=0.0,
            collect_drain_per_s=0.0,
            contact_drain_per_s=0.0,
            recorder_max_fraction=1.0,
            initial_recorder_fraction=0.0,
            collect_fill_per_s=0.0,
            downlink_per_s=0.0,
            telemetry_per_s=0.0,
        )

    @classmethod
    def paper(cls, period_s: float) -> Resources:
        """Return the paper's spacecraft with the rates of its text (section Experiments)."""
        return cls._paper(period_s, telemetry_per_s=1e-6, downlink_ratio=4.0)

    @classmethod
    def paper_code(cls, period_s: float) -> Resources:
        """Return the paper's spacecraft with the rates of the authors' code."""
        return cls._paper(period_s, telemetry_per_s=1.0 / 3e7, downlink_ratio=10.0)

    @classmethod
    def _paper(cls, period_s: float, *, telemetry_per_s: float, downlink_ratio: float) -> Resources:
        image_fill_per_s = 1.0 / 3000.0  # a 30 s image is 1 % of the recorder
        image_drain_per_s = 1.0 / (0.1 * period_s)  # 10 % duty cycle
        return cls(
            battery_min_fraction=0.3,
            initial_battery_fraction=1.0,
            sunpoint_charge_per_s=1.0 / (0.9 * period_s),
            collect_drain_per_s=image_drain_per_s,
            contact_drain_per_s=image_drain_per_s / 4.0,
            recorder_max_fraction=0.75,
            initial_recorder_fraction=0.0,
            collect_fill_per_s=image_fill_per_s,
            downlink_per_s=downlink_ratio * image_fill_per_s,
            telemetry_per_s=telemetry_per_s,
        )

    def __post_init__(self) -> None:
        names = [
            "battery_min_fraction",
            "initial_battery_fraction",
            "recorder_max_fraction",
            "initial_recorder_fraction",
        ]
        require_finite(self, *names)
        for name in names:
            require(0 <= getattr(self, name) <= 1, name, "must be between 0 and 1")
        rates = [
            "sunpoint_charge_per_s",
            "collect_drain_per_s",
            "contact_drain_per_s",
            "collect_fill_per_s",
            "downlink_per_s",
            "telemetry_per_s",
            "idle_drain_per_s",
        ]
        require_finite(self, *rates, "panel_angle_deg")
        for name in rates:
            require(getattr(self, name) >= 0, name, "must be 0 or more")
        require(0 <= self.panel_angle_deg <= 180, "panel_angle_deg", "must be between 0 and 180")
        check_downlink(self.downlink_by_elevation)
        make_real(self, *names, *rates, "panel_angle_deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class Satellite:
    """A satellite: its orbit and what it can do.

    Attributes
    ----------
    spacecraft
        The type that its figures are from, if known.
    """

    id: str
    name: str
    orbit: Orbit
    agility: Agility = Agility()
    sensor: Sensor = Sensor()
    resources: Resources
    spacecraft: str | None = None
