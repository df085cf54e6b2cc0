"""Opportunities for readers: computed once per scenario, stored, and kept in memory.

Jobs store the same block, so that whoever comes first computes it for all.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import Scenario
from service.db.rows import ScenarioRow
from service.db.session import Database
from service.scenarios.background import Background
from service.scenarios.translate import scenario_from_content
from service.stores import opportunity_store


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Described:
    """A scenario and its opportunities."""

    scenario: Scenario
    computed: ScenarioOpportunities


class OpportunityReader(Background):
    """Reads or computes opportunities in the background, one scenario at a time.

    Scenarios are identified by their hash, so that what is kept never goes stale.
    """

    _kept, _told = 4, "The opportunities of this scenario are being computed."

    def get(self, database: Database, scenario_id: str, sha256: str) -> Described:
        """Return a scenario's opportunities; 503 ``still_computing`` if that takes long."""
        return self.work_out(sha256, lambda budget: _read(database, scenario_id, sha256, budget))


def _read(database: Database, scenario_id: str, sha256: str, budget: Budget) -> Described:
    with database.reading() as session:
        content = session.get_one(ScenarioRow, scenario_id).content
        block = opportunity_store.load(session, sha256)
    scenario = scenario_from_content(json.loads(content))
    if block is not None:
        computed = ScenarioOpportunities.from_bytes(block)
        return Described(scenario=scenario, computed=computed)
    computed = compute_opportunities(scenario, budget)
    with database.transaction() as session:
        opportunity_store.save(session, sha256, computed.to_bytes())
    return Described(scenario=scenario, computed=computed)
