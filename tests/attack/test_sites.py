"""Pages of other sites, in the browser of a user who may call the service."""

from __future__ import annotations

import httpx
import pytest
from starlette.datastructures import Headers

from service.api.sites import Sites
from service.problems.kinds import ServiceError
from service.settings import Settings
from tests.attack.conftest import Door, MakeDoor
from tests.service.factories import satellite, tle
from tests.service.problems import assert_problem

EVIL = "https://evil.example"


def import_by_form(door: Door, **headers: str) -> httpx.Response:
    """Post elements as a page can without a preflight request: as plain text."""
    content = "\n".join(tle())
    return door.client.post(
        "/v1/satellites/import",
        content=content,
        headers={"Content-Type": "text/plain", **headers},
    )


@pytest.mark.parametrize("origin", [EVIL, "null", "http://localhost:3000", "http://[", ""])
def test_a_page_of_a_foreign_origin_imports_nothing(make_door: MakeDoor, origin: str) -> None:
    # Old browsers send no Sec-Fetch-Site.
    with make_door() as door:
        assert_problem(import_by_form(door, Origin=origin), 403, "foreign_origin")
        assert door.client.get("/v1/satellites").json()["items"] == []
        key = door.key("submit")
        assert_problem(import_by_form(door, Origin=origin, **key), 403, "foreign_origin")
        own = str(door.client.base_url).rstrip("/")
        assert import_by_form(door, Origin=own).status_code == 200


def test_a_page_of_a_foreign_origin_orders_nothing(make_door: MakeDoor) -> None:
    with make_door() as door:
        assert door.client.post("/v1/satellites", json=satellite()).status_code == 201
        path = "/stapi/products/paper/orders"
        answer = door.client.post(path, json={}, headers={"Origin": EVIL})
        assert_problem(answer, 403, "foreign_origin")
        # Without the foreign origin only the empty body is wrong.
        assert door.client.post(path, json={}).status_code == 422


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", ""]
)
def test_a_name_that_was_made_to_lead_here_is_not_served(make_door: MakeDoor, host: str) -> None:
    with make_door(allowed_hosts="ops.example") as door:
        for method, path in (("GET", "/v1/jobs"), ("GET", "/"), ("POST", "/v1/jobs")):
            answer = door.client.request(method, path, headers={"Host": host})
            assert_problem(answer, 421, "misdirected_request")
        answer = door.client.get("/v1/jobs", headers={"Host": host} | door.key("read"))
        assert_problem(answer, 421, "misdirected_request")
        for good in ("localhost", "LOCALHOST:8000", "[::1]:8000", "127.0.0.1", "ops.example:443"):
            assert door.client.get("/v1/jobs", headers={"Host": good}).status_code == 200
        # Health may be requested under any host name: it reveals nothing.
        assert door.client.get("/health/live", headers={"Host": host}).status_code == 200


def test_a_page_behind_a_proxy_is_an_own_page_whatever_the_proxy_calls_us() -> None:
    sites = Sites(Settings(allowed_hosts="inner").own_hosts, ())
    called = {"host": "inner", "origin": "https://ops.example"}
    sites.check("POST", Headers(called | {"sec-fetch-site": "same-origin"}))
    sites.check("POST", Headers(called | {"host": "inner", "origin": "https://inner:443"}))
    with pytest.raises(ServiceError, match="another site"):
        sites.check("POST", Headers(called))
