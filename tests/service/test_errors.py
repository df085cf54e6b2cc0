"""Every error, the framework's own included, is a problem document."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event
from typing import Any

import httpx
import pytest
from fastapi.openapi.utils import get_openapi

from planner_core.errors import InvalidElements
from service.db.rows import WorkerRow
from service.db.session import Database
from service.main import create_app
from service.settings import Settings
from tests.patience import PATIENCE_S
from tests.plain_http import NO_TLS
from tests.service.conftest import Service, new_app, serve
from tests.service.factories import EPOCH, ground_station, satellite, target, tle
from tests.service.problems import assert_problem


def test_an_unknown_path_is_404(client: httpx.Client) -> None:
    assert_problem(client.get("/nowhere"), 404, "not_found")


def test_a_wrong_method_is_405_and_names_the_right_ones(client: httpx.Client) -> None:
    response = client.delete("/version")
    assert_problem(response, 405, "method_not_allowed")
    assert response.headers["allow"] == "GET"
    assert client.patch("/v1/satellites").headers["allow"] == "GET, POST"
    assert client.post("/v1/satellites/1/elements").headers["allow"] == "GET, PUT"
    assert client.put("/v1/satellites/import").headers["allow"] == "POST"
    assert client.post("/docs").headers["allow"] == "GET"


def test_a_wrong_method_does_not_build_the_openapi_document(settings: Settings) -> None:
    # It takes seconds.
    app = create_app(settings)
    with serve(app) as address, httpx.Client(base_url=address, verify=NO_TLS) as client:
        assert client.patch("/v1/satellites").headers["allow"] == "GET, POST"
        assert app.openapi_schema is None


def test_others_are_served_while_the_openapi_document_is_built(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, may_end = Event(), Event()
    built: list[int] = []

    def slow(**kwargs: Any) -> dict[str, Any]:
        built.append(1)
        begun.set()
        may_end.wait(PATIENCE_S)
        return get_openapi(**kwargs)

    monkeypatch.setattr("service.api.openapi.get_openapi", slow)
    with (
        serve(create_app(settings)) as address,
        httpx.Client(base_url=address, verify=NO_TLS, timeout=60) as client,
        ThreadPoolExecutor() as pool,
    ):
        try:
            asked = [pool.submit(client.get, path) for path in ("/openapi.json", "/docs")]
            assert begun.wait(PATIENCE_S)
            assert client.get("/health/live").status_code == 200
        finally:
            may_end.set()
        assert {answer.result().status_code for answer in asked} == {200}
    assert len(built) == 1


def test_a_mistyped_query_parameter_is_refused_rather_than_ignored(client: httpx.Client) -> None:
    body = assert_problem(client.get("/version?vorsion=1"), 422, "unknown_parameter")
    assert "vorsion" in str(body["detail"])


def test_a_query_parameter_given_twice_is_refused(client: httpx.Client) -> None:
    response = client.get("/v1/satellites?limit=1&limit=2")
    body = assert_problem(response, 422, "invalid_value")
    assert "'limit' is given 2 times" in str(body["detail"])


@pytest.fixture
def broken(settings: Settings) -> Iterator[httpx.Client]:
    """The real application with two routes that fail."""
    app = new_app(settings)

    @app.get("/bug")
    def bug() -> None:
        raise RuntimeError("a secret of the server")

    @app.get("/data")
    def data() -> None:
        raise InvalidElements("tle_checksum", "Line 2: expected 7, got 3", pointer="/tle/1")

    with serve(app) as address, httpx.Client(base_url=address, verify=NO_TLS) as client:
        yield client


def test_a_bug_is_500_and_tells_nothing_but_its_request_id(broken: httpx.Client) -> None:
    response = broken.get("/bug")
    body = assert_problem(response, 500, "internal_error")
    assert str(body["request_id"]) in str(body["detail"])
    assert "secret" not in response.text
    assert "Traceback" not in response.text


def test_an_error_of_the_planner_is_422_with_its_pointer(broken: httpx.Client) -> None:
    body = assert_problem(broken.get("/data"), 422, "tle_checksum")
    assert body["errors"] == [
        {
            "pointer": "/tle/1",
            "code": "tle_checksum",
            "row": None,
            "detail": "Line 2: expected 7, got 3",
        }
    ]


def test_the_callers_request_id_is_kept_only_where_it_is_harmless(client: httpx.Client) -> None:
    kept = client.get("/version", headers={"X-Request-ID": "abc-1"})
    assert kept.headers["x-request-id"] == "abc-1"
    replaced = client.get("/version", headers={"X-Request-ID": 'a"b<c>'})
    assert len(replaced.headers["x-request-id"]) == 36


def test_a_change_that_was_meant_for_another_state_is_412(client: httpx.Client) -> None:
    catalog = {"name": "C", "targets": [target()]}
    for path, body in (
        ("/v1/satellites", satellite()),
        ("/v1/ground-stations", ground_station()),
        ("/v1/target-catalogs", catalog),
    ):
        made = client.post(path, json=body)
        address, etag = made.headers["location"], made.headers["etag"]
        for wrong in ('"other"', f"W/{etag}"):
            refused = client.delete(address, headers={"If-Match": wrong})
            assert_problem(refused, 412, "precondition_failed")
            assert refused.headers["etag"] == etag
        assert client.get(address).status_code == 200
        right = {"If-Match": f'"other", {etag}'}
        assert client.delete(address, headers=right).status_code == 204
        assert_problem(client.delete(address, headers={"If-Match": "*"}), 404, "not_found")


def test_of_two_changes_of_one_state_only_the_first_is_made(client: httpx.Client) -> None:
    made = client.post("/v1/satellites", json=satellite(tle=tle()))
    address, etag = made.headers["location"], made.headers["etag"]
    known = {"If-Match": etag}
    newer = {"tle": tle(epoch=EPOCH + timedelta(days=1))}
    newest = {"tle": tle(epoch=EPOCH + timedelta(days=2))}
    first = client.put(f"{address}/elements", json=newer, headers=known)
    assert first.status_code == 200
    second = client.put(f"{address}/elements", json=newest, headers=known)
    assert_problem(second, 412, "precondition_failed")
    assert len(client.get(f"{address}/elements").json()["items"]) == 2
    assert_problem(client.delete(address, headers=known), 412, "precondition_failed")
    assert client.delete(address, headers={"If-Match": first.headers["etag"]}).status_code == 204


def test_each_code_is_explained_under_its_type(client: httpx.Client) -> None:
    problem = client.get("/nowhere").json()
    explained = client.get(problem["type"]).json()
    assert explained["code"] == "not_found"
    assert explained["status"] == 404
    assert explained["explanation"]
    assert_problem(client.get("/problems/no-such"), 404, "not_found")


def test_health_is_not_ready_without_a_worker(service: Service) -> None:
    assert service.client.get("/health/live").json() == {"status": "live"}
    assert_problem(service.client.get("/health/ready"), 503, "not_live")


def test_health_is_ready_while_a_worker_is_heard_of(service: Service) -> None:
    now = datetime.now(UTC)
    with service.database.transaction() as session:
        session.add(WorkerRow(id="old", started_at=now, seen_at=now - timedelta(hours=1)))
        session.add(WorkerRow(id="new", started_at=now, seen_at=now))
    body = service.client.get("/health/ready").json()
    assert (body["status"], body["workers"]) == ("ready", 1)


def test_health_is_not_ready_without_its_database(service: Service, tmp_path: Path) -> None:
    (tmp_path / "broken.db").write_bytes(b"this is no database" * 100)
    service.app.state.database = Database(f"sqlite:///{tmp_path / 'broken.db'}")
    problem = assert_problem(service.client.get("/health/ready"), 503, "not_live")
    assert "database" in problem["detail"]
    assert service.client.get("/health/live").status_code == 200


def test_docs_render_without_the_internet(client: httpx.Client) -> None:
    page = client.get("/docs")
    assert page.status_code == 200
    assert "/health/live" in page.text
    assert "http://" not in page.text
    assert "https://" not in page.text


def test_openapi_declares_every_error_as_a_problem(client: httpx.Client) -> None:
    document = client.get("/openapi.json").json()
    assert document["openapi"].startswith("3.1")
    for operations in document["paths"].values():
        for operation in operations.values():
            errors = {k: v for k, v in operation["responses"].items() if k >= "400"}
            assert {"422", "500"} <= set(errors)
            for response in errors.values():
                assert list(response["content"]) == ["application/problem+json"]


def references(node: object) -> Iterator[str]:
    if isinstance(node, dict):
        yield from (value for key, value in node.items() if key == "$ref")
        for value in node.values():
            yield from references(value)
    elif isinstance(node, list):
        for value in node:
            yield from references(value)


def test_every_reference_in_openapi_leads_somewhere(client: httpx.Client) -> None:
    document = client.get("/openapi.json").json()
    found = {reference.removeprefix("#/components/schemas/") for reference in references(document)}
    assert {"Problem", "TargetCatalogIn", "SatelliteOut"} <= found
    assert found <= set(document["components"]["schemas"])
