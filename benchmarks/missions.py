"""The paper's mission, drawn from the shipped catalogue."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import (
    Dynamics,
    GroundStation,
    Horizon,
    OrbitElements,
    Resources,
    Satellite,
    Scenario,
    Target,
)
from planner_core.problem import Problem
from service.catalogs.wrs2 import load_wrs2_land

START = datetime(2019, 1, 1, tzinfo=UTC)
ORBIT = OrbitElements(
    name="PAPER",
    norad_cat_id=1,
    object_id="",
    epoch=START,
    mean_motion_rev_day=15.24162312,
    eccentricity=0.001,
    inclination_deg=90.0,
    raan_deg=0.0,
    arg_perigee_deg=0.0,
    mean_anomaly_deg=0.0,
)


def paper_scenario(
    num_targets: int,
    seed: int,
    *,
    use_resources: bool,
    dynamics: Dynamics = "physical",
    preset: str = "paper",
) -> Scenario:
    """Return one day of the paper's satellite over ``num_targets`` land scenes."""
    scenes = load_wrs2_land()
    picked = np.random.default_rng(seed).choice(len(scenes), num_targets, replace=False)
    make = Resources.paper if preset == "paper" else Resources.paper_code
    return Scenario(
        horizon=Horizon(start=START, end=START + timedelta(days=1)),
        satellites=(
            Satellite(id="paper", name="PAPER", orbit=ORBIT, resources=make(ORBIT.period_s)),
        ),
        targets=tuple(
            Target(id=scenes[i].id, lat_deg=scenes[i].lat_deg, lon_deg=scenes[i].lon_deg)
            for i in picked
        ),
        ground_stations=(
            GroundStation(id="svalbard", name="Svalbard", lat_deg=78.2298391, lon_deg=15.3924483),
            GroundStation(id="troll", name="Troll", lat_deg=-72.0167, lon_deg=2.5333),
        ),
        use_resources=use_resources,
        dynamics=dynamics,
    )


def problem_of(scenario: Scenario) -> Problem:
    """Return the compiled problem of a scenario."""
    budget = Budget()
    return build_problem(scenario, compute_opportunities(scenario, budget), budget)
