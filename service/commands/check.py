"""``slewline check``: a timeline from any source, judged by the referee against its scenario."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Scenario
from planner_core.problem import COLLECT, Problem
from planner_core.referee.replay import plan_sha256, replay
from planner_core.referee.timeline import Timeline
from service.answers.reading import READERS, Reading, UnreadableTimeline, plan_in
from service.commands.outcome import FAILED, OK, WrongInput
from service.commands.scenario_files import read_object, told_of
from service.commands.summary import cell, table
from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.translate import scenario_from_content
from service.wire.instants import instant_text

_AGREED = 1e-6
_MOST_FAULTS = 20


def check(options: argparse.Namespace) -> int:
    """Judge the plan in a file, print the verdict, and return 0 if it is valid, else 1.

    The file is a timeline as ``.json`` or ``.csv``, from this service, edited, or foreign.
    """
    try:
        with told_of(options.scenario):
            return _judged(options.scenario, options.timeline)
    except UnreadableTimeline as error:
        lines = [
            f"{options.timeline} {f'line {f.row}' if f.row else f.pointer or ''}".strip()
            + f": {f.detail}"
            for f in error.faults[:_MOST_FAULTS]
        ]
        left = len(error.faults) - len(lines)
        raise WrongInput("\n".join(lines + [f"{left} more"] * (left > 0))) from error


def _judged(scenario_path: Path, timeline_path: Path) -> int:
    content = canonical(read_object(scenario_path))
    data = timeline_path.read_bytes()
    suffix = timeline_path.suffix.lower()
    records = READERS[suffix](data)
    scenario = scenario_from_content(json.loads(content))
    budget = Budget()
    problem = build_problem(scenario, compute_opportunities(scenario, budget), budget)
    reading = plan_in(records, scenario, problem)
    verdict = replay(problem, reading.plan)
    validity = "violations" if reading.impossible else verdict.validity
    own_hash = plan_sha256(problem, reading.plan)
    print(table([_HEADER, _row(problem, reading, verdict, validity)]))
    print(f"plan {own_hash}")
    for line in _complaints(scenario, reading, verdict):
        print(line)
    if suffix == ".json":
        claimed = json.loads(data)
        for line in _differences(claimed, sha256_of(content), own_hash, verdict.reward):
            print(line)
    return OK if validity != "violations" else FAILED


_HEADER = ("validity", "reward", "collects", "contacts", "battery", "recorder")


def _row(problem: Problem, reading: Reading, verdict: Timeline, validity: str) -> tuple[str, ...]:
    kinds = Counter(int(problem.opportunities.kind[a.opportunity]) for a in reading.plan.actions)
    collects = kinds[COLLECT]
    return (
        validity,
        f"{verdict.reward:g}",
        str(collects),
        str(kinds.total() - collects),
        cell(verdict.battery_min, ".1%"),
        cell(verdict.recorder_max, ".1%"),
    )


def _complaints(scenario: Scenario, reading: Reading, verdict: Timeline) -> Iterator[str]:
    """Yield a line for each fault of the plan, with its location in the file."""
    for place, detail in reading.impossible:
        yield f"{place}: window: {detail}"
    for violation in verdict.violations:
        places = ", ".join(reading.places[position] for position in violation.blamed)
        satellite = scenario.satellites[violation.satellite].name
        at = instant_text(scenario.horizon.instant(violation.at_s))
        where = f"{places}: " if places else ""
        yield f"{where}{violation.code}: {satellite}, {at}: {violation.detail}"


def _differences(
    claimed: Mapping[str, Any], scenario_sha256: str, own_hash: str, reward: float
) -> Iterator[str]:
    """Yield the statements of a timeline document about itself that are false."""
    said = claimed.get("scenario_sha256", scenario_sha256)
    if said != scenario_sha256:
        yield f"note: the file was made for another scenario, {said}"
    if claimed.get("plan_sha256", own_hash) != own_hash:
        yield f"note: the file gives the plan as {claimed['plan_sha256']}"
    totals = claimed.get("totals")
    told = totals.get("reward") if isinstance(totals, dict) else None
    if isinstance(told, int | float) and abs(told - reward) > _AGREED * max(1.0, abs(reward)):
        yield f"note: the file claims a reward of {told:g}"
