"""Limits on the size of scenarios: larger ones are refused before any work on them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from planner_core.domain import Horizon
from planner_core.errors import InvalidScenario


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioLimits:
    """The largest scenario that the service accepts.

    Attributes
    ----------
    horizon_days
        Longest horizon.
    num_targets
        In all catalogues together.
    satellite_target_days
        Satellites times targets times days: the work of an access search, and about half the
        number of opportunities that it finds.
    """

    horizon_days: float
    num_targets: int
    satellite_target_days: float

    def check(self, horizon: Horizon, num_satellites: int, num_targets: int) -> None:
        """Refuse a scenario that is too large (``horizon_too_long``, ``scenario_too_large``)."""
        days = horizon.duration_s / 86400.0
        if horizon.end - horizon.start > timedelta(days=self.horizon_days):
            detail = f"The horizon has {days:.2f} days; the limit is {self.horizon_days:g}."
            raise InvalidScenario("horizon_too_long", detail, pointer="/horizon/end")
        if num_targets > self.num_targets:
            detail = f"The scenario has {num_targets} targets; the limit is {self.num_targets}."
            raise InvalidScenario("scenario_too_large", detail)
        product = num_satellites * num_targets * days
        if product > self.satellite_target_days:
            raise InvalidScenario(
                "scenario_too_large",
                f"{num_satellites} satellites times {num_targets} targets times {days:.2f} days "
                f"are {product:.3g}; the limit is {self.satellite_target_days:.3g}.",
            )
