"""A caller can look up its own identity: pages warn about keys that allow too much."""

from __future__ import annotations

import httpx

from tests.service.access.conftest import MakeDoor


def test_without_a_key_on_this_machine_it_is_the_local_owner(client: httpx.Client) -> None:
    assert client.get("/v1/me").json() == {
        "owner": "local",
        "scope": "admin",
        "key_id": None,
        "key_name": None,
    }


def test_a_key_learns_its_owner_scope_and_public_part(make_door: MakeDoor) -> None:
    with make_door(require_keys=True) as door:
        assert door.client.get("/v1/me").status_code == 401
        token = door.token("read", owner="wall")
        answer = door.client.get("/v1/me", headers={"X-API-Key": token})
        assert answer.json() == {
            "owner": "wall",
            "scope": "read",
            "key_id": token.split("_")[1],
            "key_name": "wall-read",
        }
        assert token not in answer.text


def test_pages_and_their_files_need_no_key_and_what_they_show_does(make_door: MakeDoor) -> None:
    with make_door(require_keys=True) as door:
        for page in ("/", "/new", "/jobs/x", "/comparisons/x"):
            assert door.client.get(page).status_code == 200
        assert door.client.get("/v1/jobs").status_code == 401
