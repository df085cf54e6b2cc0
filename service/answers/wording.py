"""What a judged plan is called in documents: its actions, opportunities, instants, reasons."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.reasons.reason import Change, TargetOutcome
from planner_core.referee.replay import Timeline, Violation
from service.wire.instants import instant_text

Document = dict[str, Any]


class Wording:
    """Base of the documents about one plan.

    Action ids run through all satellites, ``a1``, ``a2``, ...
    """

    def __init__(self, scenario: Scenario, problem: Problem, timeline: Timeline):
        self.scenario = scenario
        self.problem = problem
        actions = [a for s in timeline.satellites for a in s.actions]
        self._action_ids = {
            action.position: f"a{number}"
            for number, action in enumerate(actions, start=1)
            if action.position is not None
        }

    def _instant(self, offset_s: float) -> str:
        return instant_text(self.scenario.horizon.instant(offset_s))

    def _change(self, change: Change) -> Document:
        found: Document = {"opportunity_id": self._opportunity_id(change.opportunity)}
        if change.satellite is None:
            return found | {"drop_actions": [self._action_ids[p] for p in change.drop]}
        satellite_id = self.problem.satellites[change.satellite].id
        return found | {"satellite_id": satellite_id} | dict(change.settings)

    def _opportunity_id(self, row: int | None) -> str | None:
        return None if row is None else f"o{self.problem.scenario_row(row)}"

    def _violation(
        self, violation: Violation, action_ids: Mapping[int, str] | None = None
    ) -> Document:
        ids = self._action_ids if action_ids is None else action_ids
        return {
            "code": violation.code,
            "satellite_id": self.problem.satellites[violation.satellite].id,
            "at": self._instant(violation.at_s),
            "needed": violation.needed,
            "available": violation.available,
            "actions": [ids[p] for p in violation.blamed if p in ids],
            "detail": violation.detail,
        }

    def _target(self, outcome: TargetOutcome) -> Document:
        target = self.scenario.targets[outcome.target]
        satellite = outcome.satellite
        reason: Document | None = None
        if outcome.reason is not None:
            found = outcome.reason
            reason = {
                "code": found.code,
                "certainty": found.certainty,
                "blocking_actions": [self._action_ids[p] for p in found.blocking],
                "opportunity_id": self._opportunity_id(found.opportunity),
                "at": None if found.at_s is None else self._instant(found.at_s),
                "reward_delta": found.reward_delta,
                "change": None if found.change is None else self._change(found.change),
                "detail": found.detail,
            }
        return {
            "target_id": target.id,
            "target_catalog_id": target.catalog_id,
            "outcome": outcome.outcome,
            "action_id": None if outcome.position is None else self._action_ids[outcome.position],
            "satellite_id": None if satellite is None else self.problem.satellites[satellite].id,
            "reason": reason,
        }
