"""``slewline solve``: plan a scenario file with only the core, without service or database."""

from __future__ import annotations

import argparse
import json
import signal
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

from planner_core.budget import Budget
from planner_core.solvers.registry import solver_class
from service.commands.outcome import FAILED, OK
from service.commands.scenario_files import read_object, require_folder, told_of
from service.commands.summary import summary
from service.jobs.plan_job import run_plan_job
from service.jobs.plan_request import PlanAnswer, PlanRequest
from service.jobs.solver_params import params_of, parse_params
from service.scenarios.canonical import canonical, sha256_of


def solve(options: argparse.Namespace) -> int:
    """Plan a scenario file, print a summary, and return 0 if the plan is valid, else 1.

    When its time is over, or on Ctrl-C, the search ends with its best plan so far.
    """
    with told_of(options.scenario):
        require_folder(options.out)
        request = Search.of(options).request(read_object(options.scenario))
        timeline = json.loads(answer_of(request, Budget(options.time_s)).timeline)
        if options.out is not None:
            options.out.write_text(json.dumps(timeline, indent=1) + "\n", encoding="utf-8")
    print(summary(timeline))
    return OK if timeline["validity"] != "violations" else FAILED


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """How a scenario is searched; ``params`` holds all parameters of the solver."""

    solver: str
    params: Mapping[str, Any]
    seed: int
    time_s: float | None

    @classmethod
    def of(cls, options: argparse.Namespace) -> Self:
        """Return the search given on a command line, with the solver's defaults filled in."""
        params = params_of(parse_params(solver_class(options.solver), dict(options.param)))
        return cls(solver=options.solver, params=params, seed=options.seed, time_s=options.time_s)

    def request(self, scenario: Mapping[str, Any]) -> PlanRequest:
        """Return the request to plan a scenario file."""
        content = canonical(scenario)
        return PlanRequest(
            job_id="local",
            scenario_sha256=sha256_of(content),
            content=content,
            solver=self.solver,
            params=self.params,
            seed=self.seed,
            limits={"time_s": self.time_s},
        )


def answer_of(request: PlanRequest, budget: Budget) -> PlanAnswer:
    """Return the answer to a request; Ctrl-C and the budget end the search with its best plan."""
    # In a thread of its own, since inside a kernel the main thread cannot handle a signal.
    signal.signal(signal.SIGINT, lambda *_: budget.cancel())
    with ThreadPoolExecutor(max_workers=1) as pool:
        return pool.submit(run_plan_job, request, budget).result()
