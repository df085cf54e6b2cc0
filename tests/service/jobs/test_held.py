"""What a worker holds: it stays within its limits, and has no influence on plans."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import pytest

import planner_core.access.opportunities_after
import planner_core.run
from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import Scenario
from planner_core.solvers.registry import Certified
from service.jobs.held import HeldBlocks, make_folder, remove_folder
from service.jobs.plan_job import run_plan_job
from service.jobs.plan_request import Parcel, Parent, PlanAnswer, PlanRequest
from service.scenarios.canonical import canonical, sha256_of
from tests.missions import Document, drawn_targets, paper_mission


@pytest.fixture
def folder() -> Iterator[Path]:
    made = make_folder()
    assert made is not None
    yield made
    remove_folder(made)
    assert not made.exists()


def test_the_longest_unused_go_first(folder: Path) -> None:
    held = HeldBlocks(folder, most_bytes=250)
    for i, name in enumerate(("a", "b")):
        held.save(name, 100 * name.encode())
        os.utime(folder / f"{name}.npz", (i, i))
    assert held.load("a") == 100 * b"a"  # which makes it the last one used
    held.save("c", 100 * b"c")
    assert held.load("b") is None
    assert (held.load("a"), held.load("c")) == (100 * b"a", 100 * b"c")
    held.save("d", 251 * b"d")
    assert not held.holds("d")
    assert held.load("a") is not None
    assert sum(path.stat().st_size for path in folder.iterdir()) <= 250


def test_what_cannot_be_written_is_not_held(folder: Path) -> None:
    remove_folder(folder)
    held = HeldBlocks(folder)
    held.save("a", b"a")
    assert held.load("a") is None


def test_folders_of_processes_that_are_gone_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    gone = tmp_path / f"slewline-held-{2**30}-x"
    other = tmp_path / f"slewline-held-{os.getppid()}-x"
    gone.mkdir()
    other.mkdir()
    made = make_folder()
    assert made is not None
    assert made.exists()
    assert other.exists()
    assert not gone.exists()


def request(document: Document, **more: object) -> PlanRequest:
    content = canonical(document)
    plain = PlanRequest(
        job_id="j",
        scenario_sha256=sha256_of(content),
        content=content,
        solver="certified",
        params=asdict(Certified()),
        seed=0,
        limits={"time_s": 60, "memory_mb": 2048},
    )
    return replace(plain, **more)  # type: ignore[arg-type]


def follower(document: Document, answer: PlanAnswer) -> Document:
    """Return the scenario after an urgent request."""
    (satellite,) = json.loads(answer.timeline)["satellites"]
    base = [
        {
            "satellite_id": satellite["id"],
            "start": action["start"],
            **{k: action[k] for k in ("target_id", "station_id") if action.get(k)},
        }
        for action in satellite["actions"]
        if action["mode"] in ("collect", "contact")
    ]
    urgent = {**document["targets"][0], "id": "urgent", "reward": 7.0}
    return {
        **document,
        "targets": [*document["targets"][1:], urgent],
        "replan": {
            "base": [b for b in base if b.get("target_id") != document["targets"][0]["id"]],
            "freeze_until": document["horizon"]["start"],
        },
    }


def test_cold_and_warm_workers_give_the_same_plan(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed: list[int] = []

    def counted(scenario: Scenario, budget: Budget) -> ScenarioOpportunities:
        computed.append(len(scenario.targets))
        return compute_opportunities(scenario, budget)

    monkeypatch.setattr(planner_core.run, "compute_opportunities", counted)
    monkeypatch.setattr(planner_core.access.opportunities_after, "compute_opportunities", counted)
    document = paper_mission(drawn_targets(60))
    num_targets = len(document["targets"])
    first = request(document, held_in=str(folder))
    answer = run_plan_job(first, Budget())
    assert computed == [num_targets]
    assert HeldBlocks(folder).holds(first.scenario_sha256)

    asked = follower(document, answer)
    parent = Parent(
        scenario_sha256=first.scenario_sha256, content=first.content, bound=answer.proof,
        imaged=imaged_by(answer),
    )  # fmt: skip
    warm = run_plan_job(request(asked, parent=parent, held_in=str(folder)), Budget())
    assert computed == [num_targets, 1]
    stored = replace(parent, opportunity_block=Parcel(answer.opportunity_block))
    cold = run_plan_job(request(asked, parent=stored), Budget())
    assert computed == [num_targets, 1, 1]
    assert plan_of(warm) == plan_of(cold)
    assert (warm.reward, warm.bound) == (cold.reward, cold.bound)
    assert warm.opportunity_block == cold.opportunity_block

    # If nothing is stored either, only the search for a proof differs.
    bare = run_plan_job(request(asked), Budget())
    assert computed == [num_targets, 1, 1, num_targets]
    assert bare.reward == pytest.approx(warm.reward)
    assert bare.opportunity_block == warm.opportunity_block


def imaged_by(answer: PlanAnswer) -> frozenset[str]:
    return frozenset(
        action["target_id"]
        for satellite in json.loads(answer.timeline)["satellites"]
        for action in satellite["actions"]
        if action["mode"] == "collect"
    )


def plan_of(answer: PlanAnswer) -> list[tuple[str, str]]:
    return [
        (action["start"], action["mode"])
        for satellite in json.loads(answer.timeline)["satellites"]
        for action in satellite["actions"]
    ]
