"""``slewline compare-spacing``: what more starts in each access gain on one's own mission."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from planner_core.budget import Budget
from planner_core.build import ScenarioOpportunities
from planner_core.solvers.registry import solver_class
from service.commands.scenario_files import read_scenario, require_folder
from service.commands.solve import answer_of
from service.jobs.plan_job import PlanRequest
from service.jobs.solver_params import params_of, parse_params
from service.scenarios.translate import canonical, quality_from, read_file, sha256_of

SPACINGS_S: Final = (60.0, 30.0, 15.0)
"""Those that are tried unless others are named."""

_HEADER: Final = (
    "starts", "opportunities", "reward", "gain", "bound", "gap", "search_s", "ended", "validity",
)  # fmt: skip
_WIDTHS: Final = (12, 13, 9, 7, 9, 7, 8, 16, 10)


def compare_spacing(
    path: Path,
    *,
    spacings_s: Sequence[float],
    solver: str,
    params: Mapping[str, Any],
    seed: int = 0,
    time_s: float,
    out: Path | None = None,
) -> int:
    """Plan a scenario file with ever more starts, print a line for each; return 0 if all are valid.

    Parameters
    ----------
    path
        A self-contained scenario file; what it says of spacing and continuous starts is varied.
        With ``quality`` its collects do not start anywhere.
    spacings_s
        Seconds between the starts of an access's collects.
    solver, params, seed
        As in ``POST /v1/jobs``.
    time_s
        Of each search; Ctrl-C ends the one that runs, and the comparison.
    out
        Where to write the table, as CSV.

    Raises
    ------
    PlannerError
        Where the file, the solver's name or its parameters are wrong.
    Cancelled
        Where the patience ended before there was a plan.
    OSError
        Where a file cannot be read or written.
    """
    if out is not None:
        require_folder(out)
    content = read_scenario(path)
    has_quality = bool(quality_from(read_file(content).quality))
    chosen = params_of(parse_params(solver_class(solver), params))
    print(_line(_HEADER))
    rows: list[tuple[str, ...]] = []
    first: float | None = None
    all_valid = True
    for starts, change in _variants(spacings_s, anywhere=not has_quality):
        varied = canonical(content | change)
        request = PlanRequest(
            job_id="local",
            scenario_sha256=sha256_of(varied),
            content=varied,
            solver=solver,
            params=chosen,
            seed=seed,
            limits={"time_s": time_s},
        )
        budget = Budget(time_s)
        answer = answer_of(request, budget)
        timeline, block = json.loads(answer.timeline), answer.opportunity_block
        assert block is not None
        first = answer.reward if first is None else first
        rows.append(_row(starts, timeline, first, ScenarioOpportunities.from_bytes(block)))
        all_valid = all_valid and timeline["validity"] == "valid"
        print(_line(rows[-1]), flush=True)
        if budget.is_cancelled:
            break
    if out is not None:
        with out.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([_HEADER, *rows])
    return 0 if all_valid else 1


def _variants(
    spacings_s: Sequence[float], *, anywhere: bool
) -> Iterator[tuple[str, dict[str, Any]]]:
    yield "one, centred", {"collect_spacing_s": None, "continuous_starts": False}
    for spacing_s in spacings_s:
        yield (
            f"every {spacing_s:g} s",
            {"collect_spacing_s": spacing_s, "continuous_starts": False},
        )
    if anywhere:
        yield "anywhere", {"collect_spacing_s": None, "continuous_starts": True}


def _row(
    starts: str, timeline: Mapping[str, Any], first: float, found: ScenarioOpportunities
) -> tuple[str, ...]:
    totals = timeline["totals"]
    gain = totals["reward"] / first - 1.0 if first else 0.0
    return (
        starts,
        str(len(found.opportunities)),
        f"{totals['reward']:g}",
        f"{gain:+.1%}",
        "-" if totals["bound"] is None else f"{totals['bound']:g}",
        "-" if totals["gap"] is None else f"{totals['gap']:.1%}",
        f"{timeline['runtime_s']['solve']:.1f}",
        timeline["termination"],
        timeline["validity"],
    )


def _line(cells: Sequence[str]) -> str:
    padded = [cells[0].ljust(_WIDTHS[0]), *map(str.rjust, cells[1:], _WIDTHS[1:])]
    return "  ".join(padded).rstrip()
