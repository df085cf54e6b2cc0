"""What a job does, from a scenario file to documents, checked by a second opinion."""

from __future__ import annotations

import functools
import json
import re
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.certified.proofs import documents as proofs
from planner_core.certified.proofs.bound import Bound
from planner_core.solvers.registry import SOLVERS
from service.jobs.plan_job import run_plan_job
from service.jobs.plan_request import Parcel, PlanAnswer, PlanRequest
from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.translate import scenario_from_content
from service.wire.proofs import ProofOut
from tests import independent
from tests.missions import Document, drawn_targets, paper_mission


def run(
    scenario: Document,
    solver: str,
    block: bytes | None = None,
    bound: str | None = None,
    budget: Budget | None = None,
    **params: Any,
) -> PlanAnswer:
    content = canonical(scenario)
    chosen: Any = SOLVERS[solver](**params)
    request = PlanRequest(
        job_id="j",
        scenario_sha256=sha256_of(content),
        content=content,
        solver=solver,
        params=asdict(chosen),
        seed=0,
        limits={"time_s": 60, "memory_mb": 2048},
        opportunity_block=Parcel(block),
        bound=bound,
    )
    return run_plan_job(request, budget or Budget())


NEAR = {"certified": {"gap": 0.05}, "milp": {"gap": 0.05, "cut_rounds": 5}}
"""Gaps at which exact solvers may stop; not having to prove the last image saves minutes."""


QUALITY = {"off_nadir_deg": [[0, 1], [30, 0.95], [50, 0.8]]}
_FEW = 110
CHOSEN = [
    *(pytest.param(_FEW, s, NEAR.get(s, {}), id=s) for s in sorted(SOLVERS)),
    *(
        pytest.param(150, s, {}, id=f"{s} of 150, to the end", marks=pytest.mark.full_size)
        for s in sorted(SOLVERS)
    ),
]


@functools.cache
def _by_rule(content: str) -> PlanAnswer:
    return run(json.loads(content), "rule")


@pytest.mark.parametrize(("num_targets", "solver", "params"), CHOSEN)
@pytest.mark.parametrize(
    "flags",
    [
        {}, {"dynamics": "paper"}, {"use_resources": False}, {"collect_spacing_s": 30.0},
        {"continuous_starts": True}, {"continuous_starts": True, "use_resources": False},
        {"collect_spacing_s": 30.0, "quality": QUALITY},
    ],
    ids=str,
)  # fmt: skip
def test_timelines_pass_an_independent_check(
    num_targets: int, solver: str, params: dict[str, Any], flags: dict[str, Any]
) -> None:
    scenario = paper_mission(drawn_targets(num_targets), **flags)
    if num_targets > _FEW:
        answer = run(scenario, solver, **params)
    else:  # as in the service a job is given the results of its scenario's earlier jobs
        answer = first = _by_rule(canonical(scenario))
        if solver != "rule":
            answer = run(scenario, solver, first.opportunity_block, first.proof, **params)
    timeline = json.loads(answer.timeline)
    file = json.loads(canonical(scenario))
    independent.check(file, timeline, json.loads(answer.targets))
    assert timeline["totals"]["reward"] > 50
    assert timeline["totals"]["reward"] == answer.reward


@pytest.mark.parametrize("use_resources", [True, False])
@pytest.mark.parametrize("solver", sorted(SOLVERS))
def test_time_that_is_over_before_the_search_leaves_its_first_plan(
    solver: str, use_resources: bool
) -> None:
    """On a busy machine access alone may use up the time."""
    budget = Budget(0.0)
    budget.expire()
    scenario = {**paper_mission(drawn_targets(60, seed=3)), "use_resources": use_resources}
    answer = run(scenario, solver, budget=budget)
    assert answer.termination in ("time_limit", "horizon_complete", "optimal", "gap_reached")
    document = json.loads(answer.timeline)
    assert document["validity"] == "valid"
    assert answer.reward > 0.0


def test_angles_are_those_of_an_action_with_its_own_start() -> None:
    scenario = paper_mission(drawn_targets(150), use_resources=False, continuous_starts=True)
    answer = run(scenario, "rule")
    (line,) = json.loads(answer.timeline)["satellites"]
    record = independent.record_of(scenario["satellites"][0])
    places = {target["id"]: target for target in scenario["targets"]}
    for action in line["actions"]:
        start, end = independent.instant(action["start"]), independent.instant(action["end"])
        middle = start + (end - start) / 2
        off_nadir_deg, _ = independent.view(record, places[action["target_id"]], middle)
        assert action["off_nadir_deg"] == pytest.approx(off_nadir_deg, abs=0.02)


def test_every_collect_tells_its_worth_and_its_quality() -> None:
    curves = {"off_nadir_deg": [[10, 1], [50, 0.3]], "sun_elevation_deg": [[0, 0.2], [60, 1]]}
    targets = [target | {"reward": 1.0 + i % 3} for i, target in enumerate(drawn_targets(150))]
    answer = run(paper_mission(targets, quality=curves), "rule")
    assert answer.opportunity_block is not None
    table = ScenarioOpportunities.from_bytes(answer.opportunity_block).opportunities
    timeline = json.loads(answer.timeline)
    actions = timeline["satellites"][0]["actions"]
    reward = {target["id"]: target["reward"] for target in targets}
    quality = {}
    for action in actions:
        if action["mode"] != "collect":
            assert (action["worth"], action["quality"]) == (None, None)
            continue
        row = int(action["opportunity_id"].removeprefix("o"))
        by_angle = np.interp(table.off_nadir_deg[row], [10, 50], [1, 0.3])
        by_light = np.interp(table.sun_elevation_deg[row], [0, 60], [0.2, 1])
        assert action["quality"] == pytest.approx(by_angle * by_light, abs=1e-9)
        worth = reward[action["target_id"]] * by_angle * by_light
        assert action["worth"] == pytest.approx(worth, abs=1e-9)
        if action["reward"]:
            assert action["reward"] == action["worth"]
            quality[action["target_id"]] = action["quality"]
    assert len(set(quality.values())) > 20
    totals = timeline["totals"]
    assert totals["quality_mean"] == pytest.approx(np.mean(list(quality.values())), abs=1e-8)
    assert totals["reward"] == pytest.approx(sum(a["reward"] for a in actions))


@pytest.mark.parametrize("objective", ["collected", {"collected_share": 0.5, "half_life_s": 7200}])
def test_every_collect_tells_when_it_is_on_the_ground(objective: object) -> None:
    answer = run(paper_mission(drawn_targets(600), objective=objective), "rule")
    timeline = json.loads(answer.timeline)
    totals, line = timeline["totals"], timeline["satellites"][0]
    collects = [a for a in line["actions"] if a["mode"] == "collect"]
    ages_s = []
    for action in collects:
        share = 0.0
        if action["delivered_at"] is not None:
            down, end = (independent.instant(action[name]) for name in ("delivered_at", "end"))
            assert action["age_s"] == pytest.approx((down - end).total_seconds(), abs=0.002)
            ages_s.append(action["age_s"])
            share = 2 ** (-action["age_s"] / 7200)
        expected = 1.0 if objective == "collected" else 0.5 + 0.5 * share
        assert action["worth"] == pytest.approx(expected, abs=1e-6)
    assert 10 < len(ages_s) < len(collects)
    assert totals["delivered"] == totals["targets"]["downlinked"] == len(ages_s)
    ages = {
        "mean": np.mean(ages_s), "median": np.median(ages_s),
        "p90": np.quantile(ages_s, 0.9), "max": np.max(ages_s),
    }  # fmt: skip
    assert totals["age_s"] == pytest.approx(ages, abs=0.01)
    assert totals["reward"] == pytest.approx(sum(a["reward"] for a in collects))
    assert line["totals"] == {name: totals[name] for name in line["totals"]}
    worth = {t["target_id"]: t["worth"] for t in json.loads(answer.targets)}
    assert sum(filter(None, worth.values())) == pytest.approx(totals["reward"])
    assert totals["bound"] >= totals["reward"]


def test_what_is_left_out_tells_what_an_image_would_be_worth() -> None:
    targets = [target | {"reward": 2.0} for target in drawn_targets(300)]
    scenario = paper_mission(targets, quality=QUALITY)
    answer = run(scenario, "rule")
    assert answer.opportunity_block is not None
    table = ScenarioOpportunities.from_bytes(answer.opportunity_block).opportunities
    knots = np.array(QUALITY["off_nadir_deg"]).T
    told = 0
    for target in json.loads(answer.targets):
        reason = target["reason"]
        row = reason and reason["opportunity_id"]
        worth = re.search(
            r"An image then would be worth ([0-9.]+) of 2\.$", (reason or {}).get("detail", "")
        )
        assert (worth is not None) == (row is not None)
        if row is not None and worth is not None:
            quality = np.interp(table.off_nadir_deg[int(row.removeprefix("o"))], *knots)
            assert float(worth[1]) == pytest.approx(2.0 * quality, rel=0.01)
            told += 1
    assert told > 20
    plain = run(paper_mission(targets), "rule")
    assert "would be worth" not in plain.targets


def test_stored_opportunities_give_the_same_plan_as_computed_ones() -> None:
    scenario = paper_mission(drawn_targets(50))
    first = run(scenario, "rule")
    assert first.opportunity_block is not None
    again = run(scenario, "rule", first.opportunity_block)
    assert again.opportunity_block is None
    assert json.loads(first.timeline)["plan_sha256"] == json.loads(again.timeline)["plan_sha256"]
    assert first.targets == again.targets


@pytest.mark.parametrize("continuous_starts", [False, True])
@pytest.mark.parametrize("use_resources", [True, False])
@pytest.mark.parametrize("solver", ["rule", "certified"])
def test_the_stored_proof_proves_the_bound(
    solver: str, use_resources: bool, continuous_starts: bool
) -> None:
    """From the file alone: nothing remains of the search that found it."""
    scenario = paper_mission(
        drawn_targets(120), use_resources=use_resources, continuous_starts=continuous_starts
    )
    answer = run(scenario, solver)
    assert answer.proof is not None
    bound = proofs.from_json(answer.proof)
    assert bound.value == answer.bound
    read = scenario_from_content(json.loads(canonical(scenario)))
    problem = build_problem(read, compute_opportunities(read, Budget()), Budget())
    assert proofs.is_proven(problem, bound)
    assert not proofs.is_proven(problem, replace(bound, value=bound.value - 1.0))


@pytest.mark.parametrize("continuous_starts", [False, True])
def test_the_proof_with_a_half_life_knows_contacts(continuous_starts: bool) -> None:
    scenario = paper_mission(
        drawn_targets(60),
        objective={"collected_share": 0.0, "half_life_s": 10_800},
        continuous_starts=continuous_starts,
    )
    # The bound that comes with the first plans, by agility, is within 0.2 of them already.
    answer = run(scenario, "certified", gap=0.2 if continuous_starts else 0.05)
    assert answer.proof is not None
    document = ProofOut.model_validate_json(answer.proof)
    has_contacts = document.contact_prices is not None or document.queue_levels is not None
    assert has_contacts != continuous_starts
    bound = proofs.from_json(answer.proof)
    read = scenario_from_content(json.loads(canonical(scenario)))
    problem = build_problem(read, compute_opportunities(read, Budget()), Budget())
    assert proofs.is_proven(problem, bound)
    assert not proofs.is_proven(problem, replace(bound, value=0.99 * bound.value))


def test_a_known_bound_is_used_again_and_only_a_better_one_replaces_it() -> None:
    scenario = paper_mission(drawn_targets(60), use_resources=False)
    first = run(scenario, "rule")
    assert first.bound is not None
    assert first.proof is not None
    again = run(scenario, "rule", bound=first.proof)
    assert (again.bound, again.proof) == (first.bound, first.proof)
    assert json.loads(again.timeline)["plan_sha256"] == json.loads(first.timeline)["plan_sha256"]
    better = run(scenario, "milp", bound=proofs.to_json(Bound(value=1e6, proof="lagrangian")))
    assert better.bound == better.reward


def test_a_bound_that_a_valid_plan_beats_is_reported_and_not_used(
    caplog: pytest.LogCaptureFixture,
) -> None:
    scenario = paper_mission(drawn_targets(60), use_resources=False)
    first = run(scenario, "rule")
    assert not caplog.records
    again = run(scenario, "rule", bound=proofs.to_json(Bound(value=5.0, proof="lagrangian")))
    assert again.bound == first.bound
    assert "which a valid plan earns" in caplog.text
