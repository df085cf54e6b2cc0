"""One owner that submits more jobs than can be run."""

from __future__ import annotations

import httpx

from tests.attack.conftest import Door, MakeDoor
from tests.service.problems import assert_problem

RULE = {"solver": "rule"}


def compare(door: Door, key: dict[str, str], num_runs: int) -> httpx.Response:
    body = {"scenario_id": door.jobs.scenario_id, "runs": [RULE] * num_runs}
    return door.client.post("/v1/comparisons", json=body, headers=key)


def test_comparisons_of_one_owner_leave_room_for_the_others(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, max_queued=12, max_queued_per_tenant=8) as door:
        greedy, other = door.key("submit", "greedy"), door.key("submit", "other")
        assert compare(door, greedy, 4).status_code == 202
        assert compare(door, greedy, 4).status_code == 202
        refused = compare(door, greedy, 1)
        assert_problem(refused, 503, "queue_full")
        assert int(refused.headers["retry-after"]) > 0
        job_id = door.submit(other)
        for path in (f"/v1/jobs/{job_id}/rerun", f"/v1/jobs/{job_id}/what-if"):
            admin = door.key("admin", "greedy")
            again = door.client.post(path, json={"forbid": ["t1"]}, headers=admin)
            assert_problem(again, 503, "queue_full")
        for _ in range(3):
            door.submit(other)
        assert_problem(compare(door, other, 1), 503, "queue_full")  # now it is full for everybody
