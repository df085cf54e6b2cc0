"""Who has access: keys, scopes, and the content of a refusal."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest
import sqlalchemy as sa

from service.access import key_store
from service.access.tokens import key_id_of
from service.db.rows import ApiKeyRow
from tests.service.access.conftest import Door, MakeDoor
from tests.service.factories import ground_station
from tests.service.problems import assert_problem

OPEN = {
    "/health/live": 200,
    "/health/ready": 503,
    "/version": 200,
    "/docs": 200,
    "/openapi.json": 200,
    "/problems/invalid-key": 200,
}
STATIC = "dashboard:read:" + 32 * "r" + ", robot:submit:" + 32 * "s"


def operations(client: httpx.Client) -> Iterator[tuple[str, str, dict[str, object]]]:
    for path, methods in client.get("/openapi.json").json()["paths"].items():
        for method, operation in methods.items():
            yield method, path, operation


def test_what_is_open_needs_no_key(door: Door) -> None:
    assert {path: door.client.get(path).status_code for path in OPEN} == OPEN


def test_every_other_call_needs_one_and_says_so_in_openapi(door: Door) -> None:
    guarded = 0
    for method, path, operation in operations(door.client):
        if path.startswith("/v1/") or path == "/metrics":
            guarded += 1
            refused = door.client.request(method, path.replace("{", "").replace("}", ""))
            assert_problem(refused, 401, "authentication_required")
            assert refused.headers["www-authenticate"] == 'Bearer realm="slewline"'
            assert operation["security"] == [{"bearer": []}, {"header": []}]
            assert {"401", "403", "429"} <= set(operation["responses"])  # type: ignore[call-overload]
        else:
            assert "security" not in operation
    assert guarded > 20
    assert_problem(door.client.get("/nowhere"), 401, "authentication_required")


def test_a_key_is_shown_as_bearer_or_in_a_header_of_its_own(door: Door) -> None:
    token = door.token("read")
    for headers in (
        {"Authorization": f"Bearer {token}"},
        {"Authorization": f"bearer {token}"},
        {"X-API-Key": token},
        {"X-API-Key": token, "Authorization": "Basic dXNlcjpwYXNz"},
    ):
        assert door.client.get("/v1/jobs", headers=headers).status_code == 200


def test_a_wrong_key_is_refused_and_not_repeated(door: Door) -> None:
    token = door.token("admin")
    other = door.token("admin")
    mixed = f"slw_{key_id_of(token)}_{other.rpartition('_')[2]}"
    for wrong in (mixed, token[:-1], token + "0", "hunter2", "", "ü", f"{token} {token}"):
        refused = door.client.get("/v1/jobs", headers={b"X-API-Key": wrong.encode()})
        assert_problem(refused, 401, "invalid_key")
        assert 'error="invalid_token"' in refused.headers["www-authenticate"]
        assert wrong.rpartition("_")[2] == "" or wrong not in refused.text


def test_a_key_in_an_address_is_masked_in_the_answer(door: Door) -> None:
    token = door.token("admin")
    missing = door.client.get(f"/v1/jobs/{token}", headers={"X-API-Key": token})
    assert missing.status_code == 404
    assert token not in missing.text
    assert "_***" in missing.json()["instance"]


def test_a_key_is_good_until_it_expires_or_is_revoked(door: Door) -> None:
    expired = door.token("admin", expires_days=-1e-6)
    refused = door.client.get("/v1/jobs", headers={"X-API-Key": expired})
    assert_problem(refused, 401, "invalid_key")
    token = door.token("admin")
    key_id = key_id_of(token)
    assert key_id is not None
    assert door.client.get("/v1/jobs", headers={"X-API-Key": token}).status_code == 200
    with door.jobs.database.transaction() as session:
        assert key_store.revoke(session, key_id)
        assert not key_store.revoke(session, key_id)
    refused = door.client.get("/v1/jobs", headers={"X-API-Key": token})
    assert_problem(refused, 401, "invalid_key")


def test_only_a_digest_of_a_key_is_stored(door: Door) -> None:
    token = door.token("admin")
    with door.jobs.database.reading() as session:
        stored = str(session.execute(sa.select(*ApiKeyRow.__table__.columns)).all())
    assert str(key_id_of(token)) in stored
    assert token.rpartition("_")[2] not in stored


def test_scopes_allow_what_they_say_and_what_is_below(door: Door) -> None:
    keys = {scope: door.key(scope) for scope in ("read", "submit", "admin")}
    for key in keys.values():
        assert door.client.get("/v1/ground-stations", headers=key).status_code == 200
    refused = door.client.post("/v1/ground-stations", json=ground_station(), headers=keys["read"])
    assert_problem(refused, 403, "insufficient_scope")
    assert 'error="insufficient_scope", scope="submit"' in refused.headers["www-authenticate"]
    assert door.client.get("/v1/ground-stations", headers=keys["read"]).json()["items"] == []
    for scope in ("submit", "admin"):
        stored = door.client.post("/v1/ground-stations", json=ground_station(), headers=keys[scope])
        assert stored.status_code == 201
    for scope in ("read", "submit"):
        refused = door.client.get("/v1/audit-events", headers=keys[scope])
        assert_problem(refused, 403, "insufficient_scope")
        assert 'scope="admin"' in refused.headers["www-authenticate"]
    assert door.client.get("/v1/audit-events", headers=keys["admin"]).status_code == 200


def test_every_call_asks_each_scope_for_what_it_needs(door: Door) -> None:
    keys = {scope: door.key(scope) for scope in ("read", "submit", "admin")}
    allowed = dict.fromkeys(keys, 0)
    for method, path, operation in operations(door.client):
        if "security" not in operation or path.endswith("/events"):
            continue
        needed = "admin" if "audit" in path else "read" if method == "get" else "submit"
        for scope, key in keys.items():
            address = path.replace("{", "").replace("}", "")
            status = door.client.request(method, address, headers=key).status_code
            is_enough = list(keys).index(scope) >= list(keys).index(needed)
            assert (status != 403) == is_enough, (method, path, scope)
            assert status not in (401, 500), (method, path)
            allowed[scope] += is_enough
    assert 10 < allowed["read"] < allowed["submit"] < allowed["admin"]


def test_a_body_is_not_looked_at_before_the_key(door: Door) -> None:
    headers = {"Content-Type": "application/json"}
    for content in (b"{", b"x" * 5_000_000):
        refused = door.client.post("/v1/jobs", content=content, headers=headers)
        assert_problem(refused, 401, "authentication_required")


def test_keys_may_come_from_the_environment(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, api_keys=STATIC) as door:
        reader, robot = ({"X-API-Key": 32 * letter} for letter in "rs")
        job = door.submit(robot)
        assert door.client.get(f"/v1/jobs/{job}", headers=robot).status_code == 200
        assert_problem(door.client.get(f"/v1/jobs/{job}", headers=reader), 404, "not_found")
        refused = door.client.post(f"/v1/jobs/{job}/cancel", headers=reader)
        assert_problem(refused, 403, "insufficient_scope")
        unknown = door.client.get("/v1/jobs", headers={"X-API-Key": 32 * "t"})
        assert_problem(unknown, 401, "invalid_key")


def test_on_this_machine_no_key_is_needed_but_a_wrong_one_is_wrong(make_door: MakeDoor) -> None:
    with make_door() as door:
        assert door.client.get("/v1/audit-events").status_code == 200
        refused = door.client.get("/v1/jobs", headers={"X-API-Key": "hunter2"})
        assert_problem(refused, 401, "invalid_key")
        refused = door.client.get("/v1/audit-events", headers=door.key("read"))
        assert_problem(refused, 403, "insufficient_scope")


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7", "planner.example"])
def test_beyond_this_machine_there_is_no_way_round_keys(make_door: MakeDoor, host: str) -> None:
    with make_door(host=host, require_keys=False) as door:
        assert_problem(door.client.get("/v1/jobs"), 401, "authentication_required")


def test_without_its_database_nobody_passes(door: Door) -> None:
    key = door.key("admin")
    with door.jobs.database.transaction() as session:
        session.execute(sa.text("ALTER TABLE api_key RENAME TO elsewhere"))
    assert_problem(door.client.get("/v1/jobs", headers=key), 500, "internal_error")
