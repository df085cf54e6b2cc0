"""``slewline solve``: plan a scenario file with the core alone, no service and no database."""

from __future__ import annotations

import json
import signal
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from planner_core.budget import Budget
from planner_core.solvers.registry import solver_class
from service.commands.scenario_files import read_object, require_folder
from service.commands.summary import summary
from service.jobs.plan_job import run_plan_job
from service.jobs.plan_request import PlanAnswer, PlanRequest
from service.jobs.solver_params import params_of, parse_params
from service.scenarios.canonical import canonical, sha256_of

_LOOK_EVERY_S: Final = 0.05


def solve_file(
    path: Path,
    *,
    solver: str,
    params: Mapping[str, Any],
    seed: int = 0,
    time_s: float | None = None,
    out: Path | None = None,
) -> int:
    """Plan a scenario file, print a summary, and return 0 where the plan is valid, else 1.

    Parameters
    ----------
    path
        A self-contained scenario file, as ``GET /v1/scenarios/{id}?expand=true`` answers it.
    solver, params, seed
        As in ``POST /v1/jobs``; ``params`` are completed with the solver's defaults.
    time_s
        When to stop the search and keep the best plan so far; Ctrl-C does the same.
    out
        Where to write the timeline.

    Raises
    ------
    PlannerError, OSError, Cancelled
        Where input is wrong, a file cannot be read or written, or there was no plan in time.
    """
    if out is not None:
        require_folder(out)
    chosen = parse_params(solver_class(solver), params)
    search = Search(solver=solver, params=params_of(chosen), seed=seed, time_s=time_s)
    answer = answer_of(search.request(read_object(path)), Budget(time_s))
    timeline = json.loads(answer.timeline)
    if out is not None:
        out.write_text(json.dumps(timeline, indent=1) + "\n", encoding="utf-8")
    print(summary(timeline))
    return 0 if timeline["validity"] != "violations" else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """How a scenario is searched; ``params`` are all that the solver has."""

    solver: str
    params: Mapping[str, Any]
    seed: int
    time_s: float | None

    def request(self, scenario: Mapping[str, Any]) -> PlanRequest:
        """Return the question of a scenario file."""
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
    # In a thread: inside a kernel the main one could not take a signal.
    signal.signal(signal.SIGINT, lambda *_: budget.cancel())
    with ThreadPoolExecutor(max_workers=1) as pool:
        job = pool.submit(run_plan_job, request, budget)
        while not job.done():
            wait([job], timeout=_LOOK_EVERY_S)
            if budget.is_spent() and not budget.is_cancelled:
                budget.expire()
        return job.result()
