"""The solvers over HTTP are those of the core."""

from __future__ import annotations

import httpx

from planner_core.solvers.registry import SOLVERS
from tests.service.problems import assert_problem


def test_every_solver_is_listed_with_the_schema_of_its_parameters(client: httpx.Client) -> None:
    items = client.get("/v1/solvers").json()["items"]
    assert [item["name"] for item in items] == list(SOLVERS)
    for item in items:
        assert client.get(f"/v1/solvers/{item['name']}").json() == item
        assert item["kind"] in {"exact", "heuristic"}
        assert item["params_schema"]["additionalProperties"] is False
        assert set(item["honours"]) == {str(c) for c in SOLVERS[item["name"]].honours}


def test_an_unknown_solver_is_404(client: httpx.Client) -> None:
    assert_problem(client.get("/v1/solvers/magic"), 404, "not_found")
