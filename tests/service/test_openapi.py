"""A client that knows only the OpenAPI document can use the running service."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from service.wire.jobs import ACTIVE
from tests.patience import PATIENCE_S
from tests.planner_core.orbits.test_oem import lines, states
from tests.service.contract import Contract, Document
from tests.service.serving import serving

RARE = {
    "401": "a call without a key (tests/service/access)",
    "403": "a key without the scope, or a page of another site (tests/service/access)",
    "406": "one form of a timeline",
    "409": "a job in the wrong state",
    "413": "a body of many megabytes",
    "429": "a caller in a hurry (tests/service/access)",
    "500": "a fault of the service",
    "503": "a full queue, or a service without a worker",
}
FOR_GOOD = ("{plan_id}", "{comparison_id}", "{job_id}", "{scenario_id}")
COLLECTIONS = {"other_id": "/v1/jobs"}


class Client:
    """Calls operations as the document describes them, and keeps what they created."""

    def __init__(self, http: httpx.Client, document: Document):
        self.http = http
        self.document = document
        self.contract = Contract(document)
        http.event_hooks = {"response": [self.contract.check]}

    def operations(self, method: str) -> Iterator[tuple[str, Document]]:
        for path, operations in self.document["paths"].items():
            if method in operations:
                yield path, operations[method]

    def known(self, collection: str, field: str) -> str | None:
        """Return a field of the newest item of a collection, or None if it is empty."""
        items = self.http.get(collection).json()["items"]
        return items[0].get(field, items[0].get("id")) if items else None

    def path(self, template: str, operation: Document) -> str | None:
        """Return a path with existing ids, or None if there are none yet."""
        path = template
        for parameter in operation.get("parameters", []):
            if parameter["in"] != "path":
                continue
            name, slot = parameter["name"], "{" + parameter["name"] + "}"
            examples = parameter["schema"].get("examples") or parameter.get("examples")
            collection = COLLECTIONS.get(name, path.partition("/" + slot)[0])
            value = examples[0] if examples else self.known(collection, name)
            if value is None:
                return None
            path = path.replace(slot, value)
        return path

    def bodies(self, operation: Document) -> Iterator[tuple[str, Any]]:
        """Yield an example for each media type that the operation accepts."""
        for media_type, content in operation["requestBody"]["content"].items():
            schema = content["schema"]
            if schema.get("format") == "binary":
                continue  # JSON cannot show one
            if "$ref" in schema:
                name = schema["$ref"].rpartition("/")[2]
                schema = self.document["components"]["schemas"][name]
            yield media_type, self.with_ids(schema["examples"][0])

    def with_ids(self, body: Any) -> Any:
        """Return a body whose ``things_ids`` and ``thing_id`` are of things that exist."""
        if not isinstance(body, dict):
            return body
        filled = dict(body)
        for name in body:
            for collection in self.document["paths"]:
                thing = collection.rpartition("/")[2].replace("-", "_").removesuffix("s")
                if name == f"{thing}_id":
                    filled[name] = self.known(collection, "id")
                elif name == f"{thing}_ids":
                    filled[name] = [self.known(collection, "id")]
        return filled

    def send(
        self, method: str, path: str, media_type: str, body: Any, **headers: str
    ) -> httpx.Response:
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        if media_type.endswith("json") and not isinstance(body, bytes):
            named["Content-Type"] = media_type
            return self.http.request(method, path, json=body, headers=named)
        named["Content-Type"] = media_type
        content = body.encode() if isinstance(body, str) else body
        return self.http.request(method, path, content=content, headers=named)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    folder = tmp_path_factory.mktemp("openapi")
    with (
        serving(folder, "serve", "--workers", "1") as (_, line),
        httpx.Client(base_url=line.split()[-1], timeout=60, trust_env=False) as http,
    ):
        yield Client(http, http.get("/openapi.json").json())


def create_all(client: Client) -> None:
    """Send every example of every call that creates, as soon as what it names exists."""
    left = [(path, op) for path, op in client.operations("post") if "{" not in path]
    while left:
        before = len(left)
        for path, operation in list(left):
            answers = []
            for media_type, body in client.bodies(operation):
                if isinstance(body, dict) and (None in body.values() or [None] in body.values()):
                    break
                if "job_id" in body:
                    settled(client, f"/v1/jobs/{body['job_id']}/timeline")
                key = f"{path}-{media_type}".replace("/", "-")
                answers = [
                    client.send("POST", path, media_type, body, Idempotency_Key=key)
                    for _ in range(2)
                ]
                assert [answer.is_success for answer in answers] == [True] * 2, answers[0].text
                assert answers[1].headers["idempotency-replayed"] == "true"
                again = client.send("POST", path, media_type, body)
                taken = again.status_code == 409 and again.json()["code"]
                assert again.is_success or taken == "duplicate_norad_cat_id", again.text
            if answers:
                left.remove((path, operation))
        assert len(left) < before, f"nothing can be created of {left}"
    # So that there is a delivery as well.
    (webhook,) = client.http.get("/v1/webhooks?limit=1").json()["items"]
    assert client.http.post(f"{webhook['links']['self']}/test").status_code == 202


def read_all(client: Client) -> None:
    """Read everything, each item until it is finished, and again with known ids."""
    for template, operation in client.operations("get"):
        path = client.path(template, operation)
        assert path is not None, template
        if template.endswith("/oem.kvn"):
            read_ephemeris(client, path)
            continue
        answer = settled(client, path)
        assert answer.status_code == 200, answer.text
        if "304" in operation["responses"]:
            known = {"If-None-Match": answer.headers["etag"]}
            assert client.http.get(path, headers=known).status_code == 304
        if "204" in operation["responses"]:
            ids = [line[4:] for line in answer.text.splitlines() if line.startswith("id: ")]
            seen = {"Last-Event-ID": ids[-1]}
            assert client.http.get(path, headers=seen).status_code == 204


def read_ephemeris(client: Client, path_of_elements: str) -> None:
    """Request an ephemeris of a satellite that has none, and of one that has."""
    assert client.http.get(path_of_elements).status_code == 406
    body = {"name": "FD", "oem": lines(*states()), "spacecraft": "paper"}
    made = client.http.post("/v1/satellites", json=body).json()
    path = f"/v1/satellites/{made['id']}"
    answer = client.http.get(f"{path}/oem.kvn")
    assert answer.status_code == 200, answer.text
    known = {"If-None-Match": answer.headers["etag"]}
    assert client.http.get(f"{path}/oem.kvn", headers=known).status_code == 304
    assert client.http.delete(path).status_code == 204


def settled(client: Client, path: str) -> httpx.Response:
    deadline_s = time.monotonic() + PATIENCE_S
    while "retry-after" in (answer := client.http.get(path)).headers:
        assert time.monotonic() < deadline_s, answer.text
        time.sleep(0.1)
    return answer


def refuse_all(client: Client) -> None:
    """Send what every operation must refuse."""
    for method in ("get", "post", "put", "patch", "delete"):
        for template, operation in client.operations(method):
            path = client.path(template, operation)
            assert path is not None
            call = client.http.request
            assert call(method, path, params={"no_such": "1"}).status_code == 422, path
            if "404" in operation["responses"]:
                missing = template.replace("{", "no-such-").replace("}", "")
                body = next(client.bodies(operation))[1] if "requestBody" in operation else None
                assert call(method, missing, json=body).status_code == 404, missing
            for parameter in operation.get("parameters", []):
                if parameter["in"] == "query" and parameter["schema"].get("type") in {
                    "integer",
                    "number",
                    "boolean",
                }:
                    wrong = call(method, path, params={parameter["name"]: "some"})
                    assert wrong.status_code == 422, (path, parameter)
            if "requestBody" in operation:
                for media_type in operation["requestBody"]["content"]:
                    for junk in (b"", b"{}", b"[]", b"{", b"\xff\xfe", b'{"name": 5}', b"null"):
                        answer = client.send(method, path, media_type, junk)
                        assert answer.status_code == 422, (path, media_type, junk, answer.text)
                assert client.send(method, path, "image/png", b"x").status_code == 415


def live_a_plan(client: Client) -> None:
    """Take a plan from draft to published, and report on its execution."""
    plan = client.http.get("/v1/plans").json()["items"][0]
    moves = f"{plan['links']['self']}/transitions"
    body: Document = {"to": "approved"}
    stale = client.send("POST", moves, "application/json", body, If_Match='"stale"')
    assert stale.status_code == 412
    reports = [{"action_id": "a1", "outcome": "executed"}]
    done = f"{plan['links']['self']}/executions"
    assert client.http.post(done, json=reports).status_code == 409
    for to, status in (("approved", 200), ("approved", 409), ("published", 200)):
        fields = {"effective_from": plan["horizon"]["start"]} if to == "published" else {}
        assert client.http.post(moves, json={"to": to} | fields).status_code == status
    actions = client.http.get(plan["links"]["actions"]).json()["items"]
    reports = [{"action_id": each["id"], "outcome": "executed"} for each in actions]
    assert client.http.post(done, json=reports).status_code == 201
    again = f"{plan['links']['self']}/replans"
    asked = client.http.post(again, json={"now": plan["horizon"]["start"]})
    assert asked.status_code == 202, asked.text
    told = {"satellite_id": actions[0]["satellite_id"], "at": plan["horizon"]["start"]}
    states = f"{plan['links']['self']}/states"
    answer = client.http.post(states, json=[told | {"battery_fraction": 0.9}])
    assert answer.status_code == 201, answer.text


def delete_for_good(client: Client) -> None:
    """Delete plans, comparisons, jobs and scenarios, each as soon as nothing needs it."""

    def all_of(what: str) -> list[Document]:
        found: list[Document] = client.http.get(f"/v1/{what}", params={"limit": 500}).json()[
            "items"
        ]
        return found

    plan = next(each for each in all_of("plans") if each["state"] == "published")
    job, scenario = f"/v1/jobs/{plan['job_id']}", f"/v1/scenarios/{all_of('scenarios')[0]['id']}"
    for path in (plan["links"]["self"], job, scenario):
        assert client.http.delete(path).status_code == 409, path
    moves = f"{plan['links']['self']}/transitions"
    assert client.http.post(moves, json={"to": "withdrawn"}).status_code == 200
    for one in all_of("jobs"):
        if one["state"] in ACTIVE:
            client.http.post(f"/v1/jobs/{one['id']}/cancel")
    deadline_s = time.monotonic() + PATIENCE_S
    while any(one["state"] in ACTIVE for one in all_of("jobs")):
        assert time.monotonic() < deadline_s
        time.sleep(0.2)
    for what in ("plans", "comparisons", "jobs", "scenarios"):
        for one in all_of(what):
            path = f"/v1/{what}/{one['id']}"
            stale = client.http.delete(path, headers={"If-Match": '"stale"'})
            assert stale.status_code == 412, (path, stale.text)
            assert client.http.delete(path).status_code == 204, path
        assert all_of(what) == []


def cancel_one(client: Client) -> None:
    """Cancel a job before it ends, however quick the worker is."""
    job_id = client.http.get("/v1/jobs").json()["items"][0]["id"]
    deadline_s = time.monotonic() + PATIENCE_S
    while True:
        again = client.http.post(f"/v1/jobs/{job_id}/rerun")
        assert again.status_code == 202, again.text
        cancelled = client.http.post(f"/v1/jobs/{again.json()['id']}/cancel")
        if cancelled.status_code == 202:
            return
        assert time.monotonic() < deadline_s, cancelled.text


def test_a_client_of_the_document_alone_uses_every_operation(client: Client) -> None:
    create_all(client)
    read_all(client)
    refuse_all(client)
    for method in ("put", "patch"):
        for template, operation in client.operations(method):
            path = client.path(template, operation)
            assert path is not None
            for media_type, body in client.bodies(operation):
                stale = client.send(method, path, media_type, body, If_Match='"stale"')
                assert stale.status_code == 412
                assert client.send(method, path, media_type, body, If_Match="*").status_code == 200
    for template, operation in client.operations("post"):
        if "requestBody" not in operation:
            path = client.path(template, operation)
            assert path is not None
            assert client.http.post(path).status_code in (202, 409)
        elif "{plan_id}" in template:
            continue  # each in its turn, below
        elif "{" in template:
            path = client.path(template, operation)
            assert path is not None
            for media_type, body in client.bodies(operation):
                answer = client.send("POST", path, media_type, body)
                assert answer.status_code == 202, answer.text
    live_a_plan(client)
    cancel_one(client)
    for template, operation in client.operations("delete"):
        if template.endswith(FOR_GOOD):
            continue  # in their order, below
        path = client.path(template, operation)
        assert path is not None
        assert client.http.delete(path, headers={"If-Match": '"stale"'}).status_code == 412
        assert client.http.delete(path).status_code == 204
    delete_for_good(client)
    declared = {
        (method.upper(), path, status)
        for path, operations in client.document["paths"].items()
        for method, operation in operations.items()
        for status in operation["responses"]
        if status not in RARE
    }
    unseen = declared - client.contract.seen
    assert unseen == set()


def test_an_answer_that_is_not_declared_is_noticed() -> None:
    document = {
        "components": {"schemas": {"Thing": {"type": "object", "required": ["id"]}}},
        "paths": {
            "/things/{id}": {
                "get": {
                    "responses": {
                        "200": {
                            "content": {
                                "application/json": {
                                    "schema": {"$ref": "#/components/schemas/Thing"}
                                }
                            }
                        },
                        "204": {},
                    }
                }
            }
        },
    }
    request = httpx.Request("GET", "http://x/things/1")
    contract = Contract(document)
    contract.check(httpx.Response(200, json={"id": 1}, request=request))
    contract.check(httpx.Response(204, request=request))
    for wrong in (
        httpx.Response(200, json={}, request=request),
        httpx.Response(200, text="hello", request=request),
        httpx.Response(204, text="hello", request=request),
        httpx.Response(404, request=request),
    ):
        with pytest.raises(AssertionError):
            contract.check(wrong)
