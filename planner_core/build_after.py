"""The opportunities of a scenario that asks for other targets than one before it.

Access is most of what a replan would have to compute again, and a replan changes targets at most:
those that are new are looked for, and the others are as they were.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from planner_core.access import opportunities as tasks
from planner_core.budget import Budget
from planner_core.build import ScenarioOpportunities, compute_opportunities, orbit_warnings
from planner_core.certified.proofs.bound import Bound
from planner_core.domain import Scenario, Target
from planner_core.pins import Pins
from planner_core.problem import COLLECT, Opportunities
from planner_core.replanning.known import KnownPrices, prices_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanBefore:
    """What the search for an earlier plan has worked out, for one that follows it.

    Attributes
    ----------
    bound
        What it has proven, if anything.
    imaged
        The targets that it images; None where that is not known.
    """

    scenario: Scenario
    opportunities: ScenarioOpportunities
    bound: Bound | None = None
    imaged: frozenset[str] | None = None

    @property
    def prices(self) -> KnownPrices | None:
        """The multipliers of its targets, where it has any."""
        return prices_of(self.bound, [target.id for target in self.scenario.targets])

    def asked_by(self, scenario: Scenario) -> frozenset[str] | None:
        """Return the targets that are new in a replan, earn otherwise or have lost their image.

        None where more than that, what is out and what is pinned tells it from the plan before.
        """
        replan, before = scenario.replan, self.scenario
        if replan is None or self.imaged is None or not _is_seen_alike(scenario, before):
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


def opportunities_after(
    scenario: Scenario, before: PlanBefore, budget: Budget
) -> ScenarioOpportunities:
    """Return what ``compute_opportunities`` returns, bit for bit.

    Raises
    ------
    PropagationFailed, InvalidScenario, Cancelled
        As there.
    """
    if not _is_seen_alike(scenario, before.scenario):
        return compute_opportunities(scenario, budget)
    known = {target.id: (i, target) for i, target in enumerate(before.scenario.targets)}
    old = np.array(
        [
            known[target.id][0]
            if target.id in known and _is_same_place(target, known[target.id][1])
            else -1
            for target in scenario.targets
        ],
        dtype=np.int64,
    )
    fresh = np.flatnonzero(old < 0)
    found = None
    if len(fresh):
        new = replace(
            _bare(scenario),
            targets=tuple(scenario.targets[i] for i in fresh),
            use_resources=False,
        )
        found = compute_opportunities(new, budget)
    return _merged(scenario, before.opportunities, old, found, fresh)


def _merged(
    scenario: Scenario,
    known: ScenarioOpportunities,
    old: np.ndarray,
    found: ScenarioOpportunities | None,
    fresh: np.ndarray,
) -> ScenarioOpportunities:
    """Return the rows of targets known before and of new ones, in the order of a table.

    Parameters
    ----------
    old
        Where each target stood in the scenario before; -1 for new ones. Shape ``(num_targets,)``.
    fresh
        The new ones.
    """
    table = known.opportunities
    place = np.full(len(known.target_access), -1, dtype=np.int32)
    place[old[old >= 0]] = np.flatnonzero(old >= 0)
    is_collect = table.kind == COLLECT
    own = np.where(is_collect, place[np.where(is_collect, table.place, 0)], table.place)
    part = _columns(table)
    part["place"] = own.astype(np.int32)
    parts = [{name: values[own >= 0] for name, values in part.items()}]
    access = np.empty(len(old), dtype=known.target_access.dtype)
    access[old >= 0] = known.target_access[old[old >= 0]]
    if found is not None:
        new = _columns(found.opportunities)
        new["place"] = fresh[new["place"]].astype(np.int32)
        new["access"] = new["access"] + np.int32(len(table))  # beyond those that are known
        parts.append(new)
        access[fresh] = found.target_access
    tasks.check_number(sum(len(part["start_s"]) for part in parts))
    columns = tasks.in_order(
        parts, [t.id for t in scenario.targets], [s.id for s in scenario.ground_stations]
    )
    return ScenarioOpportunities(
        opportunities=Opportunities(**columns),
        target_access=access,
        sunlight=known.sunlight,
        warnings=orbit_warnings(scenario),
    )


def _columns(table: Opportunities) -> tasks.Columns:
    return {field.name: getattr(table, field.name) for field in fields(Opportunities)}


def _bare(scenario: Scenario) -> Scenario:
    """Return what access depends on beside targets."""
    return Scenario(
        horizon=scenario.horizon,
        satellites=scenario.satellites,
        targets=(),
        ground_stations=scenario.ground_stations,
        use_resources=scenario.use_resources,
        collect_spacing_s=scenario.collect_spacing_s,
        collect_alignment=scenario.collect_alignment,
        continuous_starts=scenario.continuous_starts,
        allow_old_elements=scenario.allow_old_elements,
        pins=Pins(),
    )


def _is_seen_alike(scenario: Scenario, before: Scenario) -> bool:
    return _bare(scenario) == _bare(before)


def _is_same_place(target: Target, before: Target) -> bool:
    """Return whether a target is imaged as before, whatever it is worth."""
    same = replace(target, name=before.name, reward=before.reward, catalog_id=before.catalog_id)
    return same == before
