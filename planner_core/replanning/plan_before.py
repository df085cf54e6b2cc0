"""What the search for the previous plan has found out, for the plan that follows it."""

from __future__ import annotations

from dataclasses import dataclass

from planner_core.access.opportunities_after import is_seen_alike, opportunities_after
from planner_core.access.scenario_opportunities import ScenarioOpportunities
from planner_core.budget import Budget
from planner_core.certified.proofs.bound import Bound
from planner_core.domain import Scenario
from planner_core.replanning.known import KnownMultipliers, multipliers_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanBefore:
    """The previous plan's scenario, and what was found out about it.

    Attributes
    ----------
    bound
        The bound proven for it, if any.
    imaged
        The targets that the plan images; None if unknown.
    """

    scenario: Scenario
    opportunities: ScenarioOpportunities
    bound: Bound | None = None
    imaged: frozenset[str] | None = None

    @property
    def multipliers(self) -> KnownMultipliers | None:
        """The multipliers of its targets, if it has any."""
        return multipliers_of(self.bound, [target.id for target in self.scenario.targets])

    def opportunities_of(self, scenario: Scenario, budget: Budget) -> ScenarioOpportunities:
        """Return the opportunities of the next scenario; only those of new targets are computed."""
        return opportunities_after(scenario, self.scenario, self.opportunities, budget)

    def asked_by(self, scenario: Scenario) -> frozenset[str] | None:
        """Return the targets that are new in a replan, have changed or have lost their image.

        None if it differs from the previous plan in more than these, outages and pins.
        """
        replan, before = scenario.replan, self.scenario
        if replan is None or self.imaged is None or not is_seen_alike(scenario, before):
            return None
        is_counted_alike = (
            scenario.objective == before.objective
            and scenario.quality == before.quality
            and scenario.states == before.states
            and scenario.forecast is None
            and before.forecast is None
        )
        if not is_counted_alike:
            return None
        known = {target.id: target for target in before.targets}
        asked = {target.id for target in scenario.targets if known.get(target.id) != target}
        lost = self.imaged - {action.target_id for action in replan.base}
        return frozenset(asked | (lost & {target.id for target in scenario.targets}))
