"""The possible readings of what the paper leaves open, each a variant of its mission."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

from benchmarks.missions import paper_scenario
from planner_core.domain import Dynamics, Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A reading of the mission.

    Attributes
    ----------
    look_deg
        Least and greatest off-nadir angle. The text gives none; the authors' code has 5 to 55
        as its default, their files 5 to 50 from 1,200 targets up and 0 to 50 below.
    rates
        Telemetry and downlink of the text (``paper``) or of the authors' code (``paper_code``).
    dynamics
        ``paper`` books a task's resources at once and sun-points from event to event;
        ``physical`` integrates over time.
    """

    look_deg: tuple[float, float] = (5.0, 55.0)
    rates: str = "paper"
    dynamics: Dynamics = "paper"

    @property
    def name(self) -> str:
        """Return the reading in a few words, as in the tables.

        >>> Reading().name
        'look 5-55, paper rates, paper dynamics'
        """
        low, high = self.look_deg
        rates = "paper" if self.rates == "paper" else "code"
        return f"look {low:g}-{high:g}, {rates} rates, {self.dynamics} dynamics"

    def covers(self, other: Reading, *, res: bool) -> bool:
        """Return whether a family is the same in both: without resources only angles matter."""
        return self == other or (not res and self.look_deg == other.look_deg)

    def scenario(self, num_targets: int, draw: int, *, use_resources: bool) -> Scenario:
        """Return one draw of the mission under this reading."""
        scenario = paper_scenario(
            num_targets,
            draw,
            use_resources=use_resources,
            dynamics=self.dynamics,
            preset=self.rates,
        )
        (satellite,) = scenario.satellites
        low, high = self.look_deg
        sensor = replace(satellite.sensor, off_nadir_min_deg=low, off_nadir_max_deg=high)
        return replace(scenario, satellites=(replace(satellite, sensor=sensor),))


BASE = Reading()
"""The reading of the figures and the grids."""

_LOOKS = ((0.0, 50.0), (5.0, 45.0), (5.0, 50.0), (5.0, 55.0))
_DYNAMICS: tuple[Dynamics, ...] = ("paper", "physical")


def readings(*, use_resources: bool) -> tuple[Reading, ...]:
    """Return the readings that differ in one family: without resources only angles matter."""
    if not use_resources:
        return tuple(Reading(look_deg=look) for look in _LOOKS)
    return tuple(
        Reading(look_deg=look, rates=rates, dynamics=dynamics)
        for look, rates, dynamics in itertools.product(_LOOKS, ("paper", "paper_code"), _DYNAMICS)
    )
