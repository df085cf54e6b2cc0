"""The question that is put to a solver."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from planner_core.domain.checks import require
from planner_core.domain.forecast import Forecast
from planner_core.domain.horizon import Horizon
from planner_core.domain.objective import Objective
from planner_core.domain.outages import Outage
from planner_core.domain.quality import Quality
from planner_core.domain.replan import Replan
from planner_core.domain.sites import GroundStation, Target
from planner_core.domain.spacecraft import Satellite
from planner_core.domain.states import State, check_states
from planner_core.errors import InvalidScenario
from planner_core.pins import Pins

Dynamics = Literal["physical", "paper"]
CollectAlignment = Literal["access", "horizon"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """The question, immutable: who may image what, when, and under which rules.

    Attributes
    ----------
    collect_alignment
        Whether starts are ``collect_spacing_s`` apart from each access's start on, or are multiples
        of it from the horizon's start.
    quality
        The share of its target's reward that an image earns, by how it is taken.
    forecast
        How likely the sky over each target is clear. None to assume a clear sky.
    objective
        How much of that it earns when it is taken, and how much when it is on the ground. Without
        resources there are no contacts, and images earn all when they are taken.
    allow_old_elements
        Plan with element sets of any age (see ``orbits.checks.check_element_age``).
    outages
        Which satellites and stations are known to be unavailable, and when.
    states
        Known states of satellites before the horizon begins: at most one of each.
    replan
        The plan to go on from, if there is one.
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
    quality: Quality = field(default_factory=Quality)
    forecast: Forecast | None = None
    objective: Objective = field(default_factory=Objective)
    allow_old_elements: bool = False
    pins: Pins = field(default_factory=Pins)
    outages: tuple[Outage, ...] = ()
    states: tuple[State, ...] = ()
    replan: Replan | None = None
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        require(len(self.satellites) > 0, "satellites", "at least one is needed")
        self._check_starts()
        # The authors' events charge for a whole span or not at all: they have no time for a slew.
        require(
            not self.use_resources
            or self.dynamics == "physical"
            or all(s.resources.knows_free_charge_alone for s in self.satellites),
            "dynamics",
            "paper has neither turns to the sun nor idle_power_w: use sun_pointing free and no "
            "idle_power_w",
        )
        if self.use_resources:
            self._check_downlinks()
        self._check_ids()
        if self.forecast is not None:
            check_coverage(self.forecast, self.horizon, self.targets)
        satellite_ids = {s.id for s in self.satellites}
        station_ids = {g.id for g in self.ground_stations}
        self.pins.check(
            satellite_ids,
            {t.id for t in self.targets},
            station_ids,
            has_contacts=self.use_resources,
        )
        for position, outage in enumerate(self.outages):
            outage.check(f"/outages/{position}", satellite_ids, station_ids)
        target_ids = {t.id for t in self.targets}
        check_states(self.states, self.satellites, target_ids, station_ids, self.horizon)
        if self.replan is not None:
            require(
                not self.continuous_starts,
                "continuous_starts",
                "a replan needs opportunities at fixed starts",
            )
            self.replan.check(satellite_ids, target_ids, station_ids)

    @property
    def has_continuous_starts(self) -> bool:
        """Whether collects may start anywhere in their accesses.

        The events of ``dynamics: paper`` are the starts of opportunities; there are no others.
        """
        knows_starts_alone = self.use_resources and self.dynamics == "paper"
        return self.continuous_starts and not knows_starts_alone

    def _check_starts(self) -> None:
        """Refuse options for the starts of collects that other fields do not allow."""
        require(
            self.collect_spacing_s is None or self.collect_spacing_s > 0,
            "collect_spacing_s",
            "must be greater than 0",
        )
        require(
            self.collect_alignment == "access"
            or (self.collect_spacing_s is not None and not self.continuous_starts),
            "collect_alignment",
            "horizon needs a collect_spacing_s, and no continuous_starts",
        )
        # Proofs for continuous starts assume that starting earlier is never worse.
        require(
            not (self.quality and self.continuous_starts),
            "continuous_starts",
            "an image's quality would change with its start: use collect_spacing_s with quality",
        )
        # A start before its opportunity's would earn more than the bound assumes.
        require(
            not (self.continuous_starts and any(t.reward_half_life_s for t in self.targets)),
            "continuous_starts",
            "rewards would change with the starts: use collect_spacing_s with reward_half_life_s",
        )
        require(
            not (self.continuous_starts and any(s.agility.tracks for s in self.satellites)),
            "continuous_starts",
            "the rates of lines of sight are known only at the starts of opportunities: use "
            "collect_spacing_s with slew_model moving",
        )

    def _check_ids(self) -> None:
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

    def _check_downlinks(self) -> None:
        """Refuse passes in which telemetry may fill the recorder faster than it is emptied.

        Once data begins to flow, the recorder must not fill again until the contact's end, so that
        one number describes what the contact downlinks.
        """
        for index, satellite in enumerate(self.satellites):
            resources = satellite.resources
            if not resources.downlink_by_elevation:
                continue
            knots_deg = [elevation_deg for elevation_deg, _ in resources.downlink_by_elevation]
            for station in self.ground_stations:
                lowest_deg = station.min_elevation_deg
                seen_deg = [lowest_deg, 90.0, *(deg for deg in knots_deg if deg > lowest_deg)]
                slowest = station.downlink_gain * resources.downlink_at(np.array(seen_deg)).min()
                require(
                    bool(slowest >= resources.telemetry_per_s),
                    f"satellites/{index}/resources/downlink_rate_mbit_s",
                    f"above {lowest_deg:g} deg at {station.name!r} it falls below the telemetry "
                    "rate: raise the station's min_elevation_deg to where it does not",
                )


def check_coverage(forecast: Forecast, horizon: Horizon, targets: Sequence[Target]) -> None:
    """Refuse a forecast that does not cover a time at which a target may be imaged.

    Raises
    ------
    InvalidScenario
        ``forecast_does_not_cover``, with the first such target and its first such instant.
    """
    if forecast.default_clear_probability is not None:
        return
    covered_s = forecast.coverage_s(len(targets))
    for position, target in enumerate(targets):
        first_s = 0.0 if target.release is None else max(0.0, horizon.offset_s(target.release))
        last_s = horizon.duration_s
        if target.due is not None:
            last_s = min(last_s, horizon.offset_s(target.due))
        begins_s, ends_s = covered_s[position]
        if first_s >= last_s or (begins_s <= first_s and last_s <= ends_s):
            continue
        outside_s = first_s if first_s < begins_s else max(first_s, ends_s)
        raise InvalidScenario(
            "forecast_does_not_cover",
            f"The forecast does not cover target {target.id!r} at "
            f"{horizon.instant(float(outside_s)):%Y-%m-%dT%H:%M:%SZ}; give the forecast a "
            "default_clear_probability for such cases.",
            pointer=f"/targets/{position}",
        )


def _first_duplicate(ids: Iterable[str]) -> tuple[int, str] | None:
    seen: set[str] = set()
    for position, value in enumerate(ids):
        if value in seen:
            return position, value
        seen.add(value)
    return None
