"""The opportunities of a scenario that differs from an earlier one in its targets only.

Access is most of what a replan would have to compute again. If only targets have changed, accesses
are searched for new targets only, and the rows of the others are reused.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from planner_core.access import opportunities as tasks
from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import Scenario, Target
from planner_core.orbits.checks import orbit_warnings
from planner_core.pins import Pins
from planner_core.problem import COLLECT, Longs, Opportunities


def opportunities_after(
    scenario: Scenario, before: Scenario, known: ScenarioOpportunities, budget: Budget
) -> ScenarioOpportunities:
    """Return what ``compute_opportunities`` returns, bit for bit.

    Parameters
    ----------
    before, known
        An earlier scenario, and its opportunities.

    Raises
    ------
    PropagationFailed, InvalidScenario, Cancelled
        As in ``compute_opportunities``.
    """
    if not is_seen_alike(scenario, before):
        return compute_opportunities(scenario, budget)
    places = {target.id: (i, target) for i, target in enumerate(before.targets)}
    old = np.array(
        [
            places[target.id][0]
            if target.id in places and _is_same_site(target, places[target.id][1])
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
    return _merged(scenario, known, old, found, fresh)


def _merged(
    scenario: Scenario,
    known: ScenarioOpportunities,
    old: Longs,
    found: ScenarioOpportunities | None,
    fresh: Longs,
) -> ScenarioOpportunities:
    """Return the rows of known and of new targets, in the order of a table.

    Parameters
    ----------
    old
        Index of each target in the earlier scenario; -1 for new ones. Shape ``(num_targets,)``.
    fresh
        Indices of the new targets.
    """
    table = known.opportunities
    place = np.full(len(known.target_access), -1, dtype=np.int32)
    place[old[old >= 0]] = np.flatnonzero(old >= 0)
    is_collect = table.kind == COLLECT
    own = np.where(is_collect, place[np.where(is_collect, table.site, 0)], table.site)
    part = _columns(table)
    part["site"] = own.astype(np.int32)
    parts = [{name: values[own >= 0] for name, values in part.items()}]
    access = np.empty(len(old), dtype=known.target_access.dtype)
    access[old >= 0] = known.target_access[old[old >= 0]]
    if found is not None:
        new = _columns(found.opportunities)
        new["site"] = fresh[new["site"]].astype(np.int32)
        new["access"] = new["access"] + np.int32(len(table))  # beyond the known numbers
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
    """Return the parts of a scenario besides targets that its opportunities depend on."""
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


def is_seen_alike(scenario: Scenario, before: Scenario) -> bool:
    """Return whether the same targets would have the same opportunities in both scenarios."""
    return _bare(scenario) == _bare(before)


def _is_same_site(target: Target, before: Target) -> bool:
    """Return whether a target can be imaged as before; name, reward and catalogue may differ."""
    same = replace(target, name=before.name, reward=before.reward, catalog_id=before.catalog_id)
    return same == before
