"""Plans made with and without a forecast, judged under the same 10,000 skies.

Run ``python -m benchmarks.clouds [--targets 1000] [--draws 2] [--time-s 60]``.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from benchmarks.clouds.forecast import forecast_of
from benchmarks.clouds.weather import Floats, Sites, Weather, position_km
from benchmarks.missions import paper_scenario
from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified

_SKIES = 10_000
_WEATHER_SEED = 20_000
_SKIES_SEED = 30_000


def clear_images(problem: Problem, scenario: Scenario, rows: list[int], weather: Weather) -> Floats:
    """Return how many of these images are clear, in each of the skies."""
    table = problem.opportunities
    targets = [scenario.targets[site] for site in table.site[rows].tolist()]
    lat_deg = np.array([target.lat_deg for target in targets])
    sites = Sites(
        position_km(lat_deg, np.array([target.lon_deg for target in targets])),
        lat_deg,
        (table.start_s[rows] + table.end_s[rows]) / 7200.0,
    )
    draw = np.random.default_rng(_SKIES_SEED)
    clear: Floats = weather.samples(sites, _SKIES, draw).sum(axis=1).astype(np.float64)
    return clear


def plan(
    scenario: Scenario, computed: ScenarioOpportunities, weather: Weather, time_s: float
) -> tuple[float, str]:
    """Return the mean number of clear images of a plan, and a line about it."""
    problem = build_problem(scenario, computed, Budget())
    begun = time.process_time()
    solution = Certified(gap=0.01).solve(problem, Budget(time_s=time_s), 0)
    cpu_s = time.process_time() - begun
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert solution.bound is not None
    rows = [solution.plan.actions[c.position].opportunity for c in timeline.collected.values()]
    clear = clear_images(problem, scenario, rows, weather)
    gap = 100.0 * (solution.bound - timeline.reward) / solution.bound
    expected = f", {timeline.reward:.1f} expected" if scenario.forecast is not None else ""
    said = f"{len(rows)} images{expected}, {clear.mean():.1f} clear (sd {clear.std():.0f})"
    return float(clear.mean()), f"{said}, gap {gap:.2f} %, {cpu_s:.0f} CPU s"


def main() -> None:
    """Print a line for each draw, with and without resources."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--draws", type=int, default=2)
    parser.add_argument("--time-s", type=float, default=60.0)
    options = parser.parse_args()
    for use_resources in (False, True):
        for draw in range(options.draws):
            weather = Weather(_WEATHER_SEED + draw)
            blind = paper_scenario(options.targets, draw, use_resources=use_resources)
            seeing = replace(blind, forecast=forecast_of(blind, weather))
            computed = compute_opportunities(blind, Budget())
            without, told = plan(blind, computed, weather, options.time_s)
            with_it, told_too = plan(seeing, computed, weather, options.time_s)
            kind = "with resources" if use_resources else "no resources"
            print(f"{options.targets}/{draw}, {kind}")
            print(f"  without a forecast: {told}")
            print(f"  with it:            {told_too}")
            print(f"  {100.0 * (with_it / without - 1.0):+.1f} % clear images", flush=True)


if __name__ == "__main__":
    main()
