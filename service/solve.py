"""``slewline solve``: plan a scenario file with the core alone, no service and no database."""

from __future__ import annotations

import json
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner_core.errors import InvalidScenario
from planner_core.solvers import solver_class
from planner_core.solvers.base import Budget
from service.jobs.plan_job import PlanRequest, run_plan_job
from service.solver_params import params_of, parse_params
from service.summary import HEADER, LEGEND, summary_row, table
from service.translate import canonical, sha256_of


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
    PlannerError
        Where the file, the solver's name or its parameters are wrong.
    OSError
        Where a file cannot be read or written.
    """
    chosen = parse_params(solver_class(solver), params)
    content = canonical(_read_json(path))
    budget = Budget(time_s)
    signal.signal(signal.SIGINT, lambda *_: budget.cancel())
    request = PlanRequest(
        job_id="local",
        scenario_sha256=sha256_of(content),
        content=content,
        solver=solver,
        params=params_of(chosen),
        seed=seed,
        limits={"time_s": time_s},
    )
    timeline = json.loads(run_plan_job(request, budget).timeline)
    if out is not None:
        out.write_text(json.dumps(timeline, indent=1) + "\n", encoding="utf-8")
    print(table([HEADER, summary_row(timeline)]))
    print(LEGEND)
    print(f"ended: {timeline['termination']}; plan {timeline['plan_sha256']}")
    return 0 if timeline["validity"] == "valid" else 1


def _read_json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InvalidScenario("invalid_json", f"{path} is not JSON: {error}.") from error
    if not isinstance(content, dict):
        raise InvalidScenario("invalid_json", f"{path} must hold one JSON object.")
    return content
