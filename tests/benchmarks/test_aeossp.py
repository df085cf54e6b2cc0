"""AEOSSP: the verdicts of the benchmark's own fixtures, and plans that its rules accept."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks.aeossp.case import Case, Observation, read_case, read_solution, write_solution
from benchmarks.aeossp.planner import plan_case
from benchmarks.aeossp.verifier import Verdict, verify
from planner_core.solvers.registry import Rule

FIXTURES = (
    "battery_depletion_invalid",
    "duplicate_observation_no_bonus_valid",
    "full_completion_valid",
    "observation_overlap_invalid",
    "sensor_type_mismatch_invalid",
    "slew_gap_invalid",
    "visibility_invalid",
    "zero_completion_valid",
)


def aeossp(shared_data: Path) -> Path:
    folder = shared_data / "bench" / "aeossp"
    if not folder.is_dir():
        pytest.skip("the AEOSSP cases are not in the shared data")
    return folder


def fixture(shared_data: Path, name: str) -> tuple[Case, list[Observation], dict[str, Any]]:
    folder = aeossp(shared_data) / "fixtures" / name
    case = read_case(folder)
    expected: dict[str, Any] = json.loads((folder / "expected.json").read_text())
    return case, read_solution(case, folder / "solution.json"), expected


@pytest.mark.parametrize("name", FIXTURES)
def test_a_verdict_is_that_of_the_benchmark(shared_data: Path, name: str) -> None:
    case, observations, expected = fixture(shared_data, name)
    verdict = verify(case, observations)
    assert verdict.is_valid == expected["valid"]
    metrics = expected["metrics"]
    assert verdict.completed_share == metrics["CR"]
    assert verdict.weighted_share == metrics["WCR"]
    assert verdict.turnaround_s == metrics["TAT"]
    assert verdict.energy_wh == pytest.approx(metrics["PC"], rel=1e-12)
    assert len(verdict.failures) == expected["action_failures_len"]
    _check_failure(verdict, expected)
    for task_id, told in expected["diagnostics"].get("per_task", {}).items():
        assert (task_id in verdict.completed) == told["completed"]
        if told.get("completed_by_action_index") is not None:
            assert verdict.completed[task_id] == told["completed_by_action_index"]
    summaries = expected["diagnostics"].get("per_satellite_resource_summary", {})
    for satellite_id, told in summaries.items():
        drawn = verdict.drawn[satellite_id]
        assert (drawn.empty_s is not None) == told["failed"]
        if "gross_consumption_wh" in told:
            assert drawn.used_wh == pytest.approx(told["gross_consumption_wh"], rel=1e-12)
            assert drawn.imaging_s == told["total_imaging_time_s"]


def _check_failure(verdict: Verdict, expected: dict[str, Any]) -> None:
    told = expected.get("first_action_failure")
    if told is None:
        assert not verdict.failures
        return
    first = verdict.failures[0]
    assert told["reason_substring"] in first.reason
    assert (first.action, first.satellite_id, first.task_id, first.stage, first.time) == (
        told["action_index"], told["satellite_id"], told["task_id"], told["stage"], told["time"],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"satellite_id": "sat_9"}, "unknown satellite_id"),
        ({"task_id": "task_9"}, "unknown task_id"),
        ({"end_s": 120.0}, "end_time must be after"),
        ({"start_s": -5.0, "end_s": 0.0}, "outside the mission horizon"),
        ({"start_s": 121.0, "end_s": 126.0}, "5s action grid"),
        ({"start_s": 115.0, "end_s": 120.0}, "outside the task window"),
        ({"end_s": 130.0}, "duration must equal"),
    ],
)
def test_actions_that_no_task_allows_are_refused(
    shared_data: Path, change: dict[str, Any], reason: str
) -> None:
    case, (observation,), _ = fixture(shared_data, "full_completion_valid")
    verdict = verify(case, [replace(observation, **change)])
    assert reason in verdict.failures[0].reason
    assert not verdict.is_valid


def test_a_plan_of_a_real_case_is_valid_and_survives_its_file(
    shared_data: Path, tmp_path: Path
) -> None:
    """Three satellites of a training case and the targets they share, on the 5 s grid."""
    whole = read_case(aeossp(shared_data) / "train" / "case_0001")
    tasks = list(whole.tasks.values())[::4]
    case = replace(
        whole,
        satellites=dict(list(whole.satellites.items())[::8]),
        tasks={task.id: task for task in tasks},
    )
    planned = plan_case(case, Rule(), time_s=None, seed=0)
    verdict = verify(case, planned.observations)
    assert verdict.failures == ()
    assert verdict.weighted_share == pytest.approx(planned.weight / sum(t.weight for t in tasks))
    assert len(verdict.completed) == len(planned.observations) > 20
    assert planned.bound is None or planned.bound >= planned.weight
    path = tmp_path / "solution.json"
    write_solution(case, planned.observations, path)
    assert read_solution(case, path) == list(planned.observations)


def test_a_battery_that_does_not_last_costs_the_least_images(shared_data: Path) -> None:
    case, _, _ = fixture(shared_data, "full_completion_valid")
    (satellite,) = case.satellites.values()
    # Idling takes 10 Wh; the image and its slew need slightly more than remains.
    short = replace(satellite, initial_battery_wh=10.05)
    planned = plan_case(
        replace(case, satellites={satellite.id: short}), Rule(), time_s=None, seed=0
    )
    assert planned.observations == ()
    assert planned.num_dropped == 1
