"""The effect of each secondary aim on the paper's missions, and that it costs no worth.

Run as ``python -m benchmarks.preferences``; it prints a table.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import get_args

from benchmarks.missions import paper_scenario
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.certified.solver import Certified
from planner_core.domain import Objective, Preference
from planner_core.preferences.polish import polished
from planner_core.referee.replay import replay


def main() -> None:
    """Print a row for each mission and aim."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of the search for worth")
    parser.add_argument("--num-targets", type=int, default=1000)
    arguments = parser.parse_args()
    print("| mission | aim | reward | before | after | CPU s |\n|---|---|---|---|---|---|")
    for use_resources in (False, True):
        objective = Objective(collected_share=0.9 if use_resources else 1.0)
        scenario = replace(
            paper_scenario(arguments.num_targets, 0, use_resources=use_resources),
            objective=objective,
        )
        problem = build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())
        plan = Certified().solve(problem, Budget(arguments.seconds), 0).plan
        reward = replay(problem, plan).reward
        for aim in get_args(Preference):
            began = time.process_time()
            polish = polished(problem, plan, (aim,), Budget(), 0)
            spent_s = time.process_time() - began
            if replay(problem, polish.plan).reward != reward:
                raise AssertionError(f"{aim} cost worth")
            effect = polish.effects[0]
            name = "with resources" if use_resources else "agility alone"
            print(
                f"| {name} | `{aim}` | {reward:.1f} | {effect.before:.4g} | {effect.after:.4g} "
                f"| {spent_s:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
