"""From a scenario to a problem: the only place where orbits and problem meet."""

from __future__ import annotations

import numpy as np

from planner_core.access.given import table_of, with_given
from planner_core.access.passes import downlinks_of
from planner_core.access.scenario_opportunities import ScenarioOpportunities
from planner_core.budget import Budget, Progress
from planner_core.domain import Scenario
from planner_core.errors import InvalidScenario
from planner_core.flown import Past, carried, flown_as, given_of, pasts_of
from planner_core.idling import started, sunlit_from
from planner_core.orbits.eclipse import always_sunlit, sunlight
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites
from planner_core.orbits.sun import sun_path
from planner_core.pinning.pinned_problem import pinned_problem
from planner_core.problem import (
    ACCESS_FOUND,
    ImageOnBoard,
    Ints,
    Opportunities,
    Problem,
    build_satellite_problem,
)
from planner_core.problem.delivery import with_objective
from planner_core.problem.on_board import with_on_board
from planner_core.problem.pointing import Path, Pointing
from planner_core.valuation import worth_of_opportunities


def build_problem(scenario: Scenario, computed: ScenarioOpportunities, budget: Budget) -> Problem:
    """Return the frozen problem that solvers and the referee see.

    Raises
    ------
    Cancelled
        The budget is spent before the problem is complete.
    InvalidScenario
        A pin is impossible.
    """
    satellites = []
    table, origin = _with_frozen(scenario, computed.opportunities)
    pasts = pasts_of(scenario)
    images: list[ImageOnBoard] = []
    states = {state.satellite_id: state for state in scenario.states}
    sun = sun_path(scenario.horizon)
    is_own = table is computed.opportunities
    downlinks = computed.downlinks_of(scenario) if is_own else downlinks_of(scenario, table)
    for index, satellite in enumerate(scenario.satellites):
        budget.proceed(Progress(phase="compile", fraction=index / len(scenario.satellites)))
        sees_shadow = scenario.use_resources and satellite.resources.eclipse_aware
        lit = computed.sunlight[index]
        if not sees_shadow:
            lit = always_sunlit(scenario.horizon.duration_s)
        start = started(scenario, index, states.get(satellite.id), computed.opportunities)
        if index in pasts:
            past = pasts[index]
            part = _flown_problem(past, budget)
            of_data = part if past.before is None else _flown_problem(past.of_data, budget)
            start = carried(past, part, of_data, start)
        images += start.images
        satellites.append(
            build_satellite_problem(
                index,
                table,
                id=satellite.id,
                name=satellite.name,
                agility=satellite.agility,
                resources=start.resources,
                downlinks=downlinks,
                sunlight=sunlit_from(lit, start.sun_from_s) if start.sun_from_s > 0.0 else lit,
                sun=sun,
                heading=start.heading,
            )
        )
    budget.proceed(Progress(phase="compile", fraction=1.0))
    stations = scenario.ground_stations
    problem = Problem(
        horizon_s=scenario.horizon.duration_s,
        use_resources=scenario.use_resources,
        dynamics=scenario.dynamics,
        continuous_starts=scenario.has_continuous_starts,
        pointing=_pointing(scenario) if scenario.has_continuous_starts else None,
        target_ids=tuple(target.id for target in scenario.targets),
        worth=worth_of_opportunities(scenario, table),
        target_access=computed.target_access,
        station_ids=tuple(station.id for station in stations),
        station_antennas=np.array([s.antennas for s in stations], dtype=np.int32),
        downlinks=downlinks,
        opportunities=table,
        satellites=tuple(satellites),
        origin=origin,
    )
    problem = with_objective(problem, scenario.objective)
    return pinned_problem(scenario, with_on_board(problem, tuple(images)))


def _flown_problem(past: Past, budget: Budget) -> Problem:
    """Return the problem that holds only what a satellite did before the horizon."""
    part = past.part()
    (satellite,) = part.satellites
    return build_problem(
        part,
        ScenarioOpportunities(
            opportunities=table_of(part, past.given(part)),
            target_access=np.full(len(part.targets), ACCESS_FOUND, dtype=np.int8),
            sunlight=(sunlight(propagate(satellite, part.horizon)),),
            warnings=(),
        ),
        budget,
    )


def _with_frozen(scenario: Scenario, table: Opportunities) -> tuple[Opportunities, Ints | None]:
    """Return the table with each frozen action at its own instants, and the original rows.

    Raises
    ------
    InvalidScenario
        ``frozen_not_kept``: with newer elements the satellite does not see the action's site then.
    """
    replan, horizon = scenario.replan, scenario.horizon
    if replan is None:
        return table, None
    frozen = {
        i: flown_as(action)
        for i, action in enumerate(replan.base)
        if action.start is not None
        and action.end is not None
        and horizon.start <= action.start < replan.freeze_until
    }
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    given = [given_of(scenario, satellites[one.satellite_id], one) for one in frozen.values()]
    made = with_given(scenario, table, given)
    if made.missing and replan.elements == "newest":
        number = list(frozen)[made.missing[0]]
        action = frozen[number]
        site = f"target {action.target_id!r}" if action.target_id else "the station"
        raise InvalidScenario(
            "frozen_not_kept",
            f"With its newest elements, satellite {action.satellite_id!r} does not see {site} at "
            f"{action.start:%Y-%m-%dT%H:%M:%SZ}: end the freeze earlier, or skip the action.",
            pointer=f"/replan/base/{number}",
        )
    if len(made.table) == len(table):
        return table, None
    return made.table, made.origin


def _pointing(scenario: Scenario) -> Pointing:
    paths = []
    for satellite in scenario.satellites:
        found = propagate(satellite, scenario.horizon)
        turn = np.column_stack([found.gmst_rad, found.xp_rad, found.yp_rad])
        nodes = np.hstack([found.position_itrf_m, found.velocity_itrf_m_s, turn])
        paths.append(Path(found.step_s, np.ascontiguousarray(nodes)))
    return Pointing(
        paths=tuple(paths),
        targets_m=Sites.of(scenario.targets).position_m,
        stations_m=Sites.of(scenario.ground_stations).position_m,
    )
