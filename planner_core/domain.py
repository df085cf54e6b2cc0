"""The nouns of planning.

Glossary
--------
Target
    A point on the ground that someone wants imaged once.
Access
    A maximal interval in which geometry allows a satellite to see a target or a station.
Opportunity
    A *collect* (image of a target) or a *contact* (pass over a station) that a plan may take.
Plan
    The actions chosen. A *timeline* is the plan replayed by the referee.
Horizon
    The span that is planned; instants inside it are seconds from its start.
Epoch
    The instant an element set is given for.
Reward, quality, worth
    What a perfect image of a target earns; how good an image is, from 0 to 1; their product.
Pin
    What a plan must hold, or must not; see ``planner_core.pins``.
Off-nadir angle
    At the satellite, between nadir and the line of sight. *Elevation* is measured at the ground.
Slew, settle
    The turn from one line of sight to another, and the wait after it.

Every type is immutable and checks itself when made.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Literal

from planner_core.errors import InvalidScenario
from planner_core.pins import Pins

Dynamics = Literal["physical", "paper"]
Nadir = Literal["geodetic", "geocentric"]
LookSide = Literal["left", "right", "any"]
OrbitDirection = Literal["ascending", "descending", "any"]
CollectAlignment = Literal["access", "horizon"]
SunPointing = Literal["free", "slew"]
SlewModel = Literal["rest", "moving"]

_LONGEST_SENSOR_TYPE = 100


def _require(condition: bool, where: str, message: str) -> None:
    if not condition:
        raise InvalidScenario("value_out_of_range", f"{where}: {message}", pointer="/" + where)


def _require_finite(owner: object, *names: str) -> None:
    for name in names:
        value = getattr(owner, name)
        if value is not None:
            _require(math.isfinite(value), name, "must be a finite number")


def _check_light(limits: Sensor | Target) -> None:
    """Check the limits of sun and local time that sensors and targets share."""
    lowest, highest = limits.sun_elevation_min_deg, limits.sun_elevation_max_deg
    for name, value in (("sun_elevation_min_deg", lowest), ("sun_elevation_max_deg", highest)):
        _require(value is None or -90 <= value <= 90, name, "must be between -90 and 90")
    _require(
        lowest is None or highest is None or lowest <= highest,
        "sun_elevation_max_deg",
        "must not be below sun_elevation_min_deg",
    )
    begin, end = limits.local_time_from_h, limits.local_time_to_h
    for name, hour in (("local_time_from_h", begin), ("local_time_to_h", end)):
        _require(hour is None or 0 <= hour <= 24, name, "must be between 0 and 24")
    _require(
        (begin is None) == (end is None) and (begin is None or begin != end),
        "local_time_to_h",
        "needs a local_time_from_h that differs from it, and the other way round",
    )


def _check_sun_exclusion(angle_deg: float | None) -> None:
    _require(
        angle_deg is None or 0 <= angle_deg <= 180,
        "sun_exclusion_deg",
        "must be between 0 and 180, or null for no limit",
    )


def _check_sensor_type(sensor_type: str | None) -> None:
    _require(
        sensor_type is None
        or (0 < len(sensor_type) <= _LONGEST_SENSOR_TYPE and sensor_type.isprintable()),
        "sensor_type",
        f"must be 1 to {_LONGEST_SENSOR_TYPE} printable characters, or null for none",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Horizon:
    """The span to plan, and the only converter between instants and seconds.

    Attributes
    ----------
    start, end
        Aware instants in UTC; ``start`` is before ``end``.
    """

    start: datetime
    end: datetime

    def __post_init__(self) -> None:
        _require(self.start.tzinfo is not None, "start", "needs a time zone")
        _require(self.end.tzinfo is not None, "end", "needs a time zone")
        _require(self.end > self.start, "end", "must be later than start")

    @property
    def duration_s(self) -> float:
        """Return the length of the horizon."""
        return (self.end - self.start).total_seconds()

    def instant(self, offset_s: float) -> datetime:
        """Return the UTC instant that lies ``offset_s`` after the start, to the millisecond.

        >>> day = Horizon(
        ...     start=datetime(2026, 1, 1, tzinfo=UTC), end=datetime(2026, 1, 2, tzinfo=UTC)
        ... )
        >>> day.instant(90.0004).isoformat()
        '2026-01-01T00:01:30+00:00'
        """
        return self.start.astimezone(UTC) + timedelta(milliseconds=round(offset_s * 1000.0))

    def offset_s(self, instant: datetime) -> float:
        """Return the seconds from the start to ``instant``."""
        return (instant - self.start).total_seconds()


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
        """Return the mean (Kozai) orbital period."""
        return 86400.0 / self.mean_motion_rev_day


@dataclass(frozen=True, slots=True, kw_only=True)
class Agility:
    """How fast the satellite turns. Defaults are the paper's 1 deg/s at once.

    Attributes
    ----------
    slew_model
        From rest to rest, or from the moving line of sight of one task to that of another.
    sun_exclusion_deg
        Least angle between boresight and sun in turns; None for no limit. Plans do not look at it:
        a flight does.
    """

    slew_rate_deg_s: float = 1.0
    acceleration_deg_s2: float | None = None
    settle_s: float = 0.0
    slew_model: SlewModel = "rest"
    sun_exclusion_deg: float | None = None

    def __post_init__(self) -> None:
        _require_finite(self, "slew_rate_deg_s", "acceleration_deg_s2", "settle_s")
        _check_sun_exclusion(self.sun_exclusion_deg)
        _require(self.slew_rate_deg_s > 0, "slew_rate_deg_s", "must be greater than 0")
        _require(
            self.acceleration_deg_s2 is None or self.acceleration_deg_s2 > 0,
            "acceleration_deg_s2",
            "must be greater than 0, or null for an instant start",
        )
        _require(self.settle_s >= 0, "settle_s", "must be 0 or more")
        _require(
            self.slew_model == "rest" or self.acceleration_deg_s2 is not None,
            "slew_model",
            "moving needs an acceleration_deg_s2",
        )

    @property
    def tracks(self) -> bool:
        """Whether turns begin and end with the rates of tracking."""
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
        What targets may ask for by this name; None serves only targets that ask for none.
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
        _require_finite(self, "off_nadir_min_deg", "off_nadir_max_deg", "min_elevation_deg")
        _check_sun_exclusion(self.sun_exclusion_deg)
        _require(0 <= self.off_nadir_min_deg <= 90, "off_nadir_min_deg", "must be between 0 and 90")
        _require(
            self.off_nadir_min_deg <= self.off_nadir_max_deg <= 90,
            "off_nadir_max_deg",
            "must be between off_nadir_min_deg and 90",
        )
        _require(
            0 <= self.min_elevation_deg < 90, "min_elevation_deg", "must be from 0 to below 90"
        )
        _check_light(self)
        _check_sensor_type(self.sensor_type)


@dataclass(frozen=True, slots=True, kw_only=True)
class Resources:
    """Battery and recorder in fractions of their capacity, per second.

    All rates are magnitudes: the model knows which of them charge and which drain.

    Attributes
    ----------
    sunpoint_charge_per_s
        Net charge while sun-pointing.
    collect_drain_per_s, contact_drain_per_s
        Net draw of the two modes.
    collect_fill_per_s, downlink_per_s, telemetry_per_s
        What a collect writes, a contact takes down, and telemetry adds at all times.
    recorder_capacity_mbit
        Size of the recorder, or None where only fractions are known (the presets).
    sun_pointing
        Whether all idle time counts as pointing at the sun (``free``), or only what is left
        between a turn to the sun and one back (``slew``).
    panel_angle_deg
        Between the normal of the panels and the boresight; the rotation about it is free.
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

    @property
    def knows_free_charge_alone(self) -> bool:
        """Whether idle time costs nothing and charges throughout, as in the paper."""
        return self.sun_pointing == "free" and self.idle_drain_per_s == 0.0

    @classmethod
    def limitless(cls) -> Resources:
        """Return what nothing draws on or fills, so that agility alone counts."""
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
        _require_finite(self, *names)
        for name in names:
            _require(0 <= getattr(self, name) <= 1, name, "must be between 0 and 1")
        rates = [
            "sunpoint_charge_per_s",
            "collect_drain_per_s",
            "contact_drain_per_s",
            "collect_fill_per_s",
            "downlink_per_s",
            "telemetry_per_s",
            "idle_drain_per_s",
        ]
        _require_finite(self, *rates, "panel_angle_deg")
        for name in rates:
            _require(getattr(self, name) >= 0, name, "must be 0 or more")
        _require(0 <= self.panel_angle_deg <= 180, "panel_angle_deg", "must be between 0 and 180")


@dataclass(frozen=True, slots=True, kw_only=True)
class Satellite:
    """A satellite: its orbit and what it can do."""

    id: str
    name: str
    orbit: OrbitElements
    agility: Agility = Agility()
    sensor: Sensor = Sensor()
    resources: Resources


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A point on the ground to be imaged once, by any satellite.

    The limits from ``off_nadir_min_deg`` to ``orbit_direction`` are named and meant as those of
    ``Sensor``, and narrow them: a collect meets both.

    Attributes
    ----------
    release, due
        Aware instants between which a collect lies as a whole. None for no limit.
    sensor_type
        Only satellites whose sensor has this very type may collect it. None for any satellite.
    """

    id: str
    lat_deg: float
    lon_deg: float
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
    catalog_id: str | None = None

    def __post_init__(self) -> None:
        _require_finite(self, "lat_deg", "lon_deg", "alt_m", "reward", "collect_s")
        _require(-90 <= self.lat_deg <= 90, "lat_deg", "must be between -90 and 90")
        _require(-180 <= self.lon_deg <= 360, "lon_deg", "must be between -180 and 360")
        _require(-500 <= self.alt_m <= 10000, "alt_m", "must be between -500 and 10000")
        _require(self.reward >= 0, "reward", "must be 0 or more")
        _require(self.collect_s > 0, "collect_s", "must be greater than 0")
        for name in ("off_nadir_min_deg", "off_nadir_max_deg", "min_elevation_deg"):
            value = getattr(self, name)
            _require(value is None or 0 <= value <= 90, name, "must be between 0 and 90")
        _check_light(self)
        for name, instant in (("release", self.release), ("due", self.due)):
            _require(instant is None or instant.tzinfo is not None, name, "needs a time zone")
        _require(
            self.release is None or self.due is None or self.release < self.due,
            "due",
            "must be later than release",
        )
        _check_sensor_type(self.sensor_type)


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundStation:
    """A ground station that serves ``antennas`` satellites at a time.

    ``elevation_mask`` is a tuple of (azimuth_deg, elevation_deg) knots, linear between
    them and round the compass; the higher of mask and ``min_elevation_deg`` holds.
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

    def __post_init__(self) -> None:
        _require_finite(self, "lat_deg", "lon_deg", "alt_m", "min_elevation_deg", "min_contact_s")
        _require(-90 <= self.lat_deg <= 90, "lat_deg", "must be between -90 and 90")
        _require(-180 <= self.lon_deg <= 360, "lon_deg", "must be between -180 and 360")
        _require(
            0 <= self.min_elevation_deg < 90, "min_elevation_deg", "must be from 0 to below 90"
        )
        _require(self.min_contact_s >= 0, "min_contact_s", "must be 0 or more")
        _require(self.antennas >= 1, "antennas", "must be 1 or more")


Curve = tuple[tuple[float, float], ...]
"""Knots of an angle in degrees and a value, in ascending order; linear between, constant beyond."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """How good an image is, from 0 to 1, by how it is taken: the product of all curves.

    Angles are those at the middle of the collect. A curve without knots is 1 everywhere.

    Attributes
    ----------
    off_nadir_deg
        At the satellite.
    sun_elevation_deg
        At the target.
    """

    off_nadir_deg: Curve = ()
    sun_elevation_deg: Curve = ()

    def __post_init__(self) -> None:
        _check_curve("off_nadir_deg", self.off_nadir_deg, 0.0, 90.0)
        _check_curve("sun_elevation_deg", self.sun_elevation_deg, -90.0, 90.0)

    def __bool__(self) -> bool:
        """Whether it makes any difference between images."""
        return bool(self.off_nadir_deg or self.sun_elevation_deg)


def _check_curve(name: str, knots: Curve, lowest_deg: float, highest_deg: float) -> None:
    before_deg = -math.inf
    for row, (angle_deg, value) in enumerate(knots):
        where = f"quality/{name}/{row}"
        _require(
            lowest_deg <= angle_deg <= highest_deg,
            where,
            f"the angle must be between {lowest_deg:g} and {highest_deg:g}",
        )
        _require(angle_deg > before_deg, where, "the angle must be greater than the one before")
        _require(0.0 <= value <= 1.0, where, "the value must be between 0 and 1")
        before_deg = angle_deg


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """The frozen question: who may image what, when, and under which rules.

    Attributes
    ----------
    collect_alignment
        Whether the starts of ``collect_spacing_s`` count from each access, or are multiples of it
        from the horizon's start.
    quality
        What part of its target's reward an image earns, by how it is taken.
    allow_old_elements
        Plan with element sets of any age (see ``build.check_element_age``).
    """

    horizon: Horizon
    satellites: tuple[Satellite, ...]
    targets: tuple[Target, ...]
    ground_stations: tuple[GroundStation, ...] = ()
    use_resources: bool = True
    dynamics: Dynamics = "physical"
    collect_spacing_s: float | None = None
    collect_alignment: CollectAlignment = "access"
    continuous_starts: bool = False
    quality: Quality = Quality()
    allow_old_elements: bool = False
    pins: Pins = field(default_factory=Pins)
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        _require(len(self.satellites) > 0, "satellites", "at least one is needed")
        _require(
            self.collect_spacing_s is None or self.collect_spacing_s > 0,
            "collect_spacing_s",
            "must be greater than 0",
        )
        _require(
            self.collect_alignment == "access"
            or (self.collect_spacing_s is not None and not self.continuous_starts),
            "collect_alignment",
            "horizon needs a collect_spacing_s, and no continuous_starts",
        )
        # Plans with free starts are proven best where earlier is never worse.
        _require(
            not (self.quality and self.continuous_starts),
            "continuous_starts",
            "an image's quality would change with its start: use collect_spacing_s with quality",
        )
        _require(
            not (self.continuous_starts and any(s.agility.tracks for s in self.satellites)),
            "continuous_starts",
            "how fast lines of sight move is known at the starts of opportunities only: "
            "use collect_spacing_s with slew_model moving",
        )
        # The authors' events forgo or charge whole spans: there is no time to turn in them.
        _require(
            not self.use_resources
            or self.dynamics == "physical"
            or all(s.resources.knows_free_charge_alone for s in self.satellites),
            "dynamics",
            "paper knows neither turns to the sun nor idle_power_w: use sun_pointing free without",
        )
        for what, ids in (
            ("satellite", [s.id for s in self.satellites]),
            ("target", [t.id for t in self.targets]),
            ("ground_station", [g.id for g in self.ground_stations]),
        ):
            duplicate = _first_duplicate(ids)
            if duplicate is not None:
                position, value = duplicate
                raise InvalidScenario(
                    f"duplicate_{what}_id",
                    f"The {what} id {value!r} appears twice.",
                    pointer=f"/{what}s/{position}/id",
                )
        self.pins.check(
            {s.id for s in self.satellites},
            {t.id for t in self.targets},
            {g.id for g in self.ground_stations},
            has_contacts=self.use_resources,
        )


def _first_duplicate(ids: Iterable[str]) -> tuple[int, str] | None:
    seen: set[str] = set()
    for position, value in enumerate(ids):
        if value in seen:
            return position, value
        seen.add(value)
    return None
