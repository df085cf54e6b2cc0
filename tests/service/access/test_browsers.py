"""Headers for browsers: who may call, what a page may do, and what is cached."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator

import httpx
import pytest

from service.settings import Settings
from tests.service.access.conftest import MakeDoor
from tests.service.conftest import new_app, serve
from tests.service.factories import ground_station
from tests.service.problems import assert_problem

DASHBOARD = "https://ops.example"
NOT_OURS = "https://evil.example"
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
}


def headers_of(response: httpx.Response) -> dict[str, str | None]:
    return {name: response.headers.get(name) for name in HEADERS}


@pytest.fixture
def client(settings: Settings) -> Iterator[httpx.Client]:
    """The real application with a route that fails."""
    app = new_app(settings)

    @app.get("/bug")
    def bug() -> None:
        raise RuntimeError

    with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
        yield client
    app.state.database.close()


def test_every_answer_has_the_headers_also_a_refusal_and_a_failure(client: httpx.Client) -> None:
    for path, status in (("/version", 200), ("/v1/jobs", 200), ("/nowhere", 404), ("/bug", 500)):
        answer = httpx.get(f"{client.base_url}{path}")
        assert answer.status_code == status
        assert headers_of(answer) == HEADERS
    big = httpx.post(f"{client.base_url}/v1/jobs", content=b"x" * 5_000_000)
    assert (big.status_code, headers_of(big)) == (413, HEADERS)


def test_answers_are_kept_for_nobody_else(client: httpx.Client) -> None:
    assert client.get("/v1/jobs").headers["cache-control"] == "private, no-cache"
    assert "cache-control" not in client.get("/version").headers


def test_the_page_of_calls_runs_its_own_script_and_style_and_no_other(
    client: httpx.Client,
) -> None:
    page = client.get("/docs")
    policy = page.headers["content-security-policy"].split("; ")
    for tag, directive in (("script", "script-src"), ("style", "style-src")):
        (text,) = re.findall(rf"<{tag}>(.*?)</{tag}>", page.text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{directive} 'sha256-{digest}'" in policy
    assert {"default-src 'none'", "frame-ancestors 'none'"} <= set(policy)
    assert " style=" not in page.text
    assert not re.search(r"<[^>]* on\w+=", page.text)


def test_pages_of_other_sites_may_call_only_where_they_are_listed(make_door: MakeDoor) -> None:
    asking = {
        "Access-Control-Request-Method": "POST",
        "Access-Control-Request-Headers": "authorization, content-type, idempotency-key",
    }
    with make_door(require_keys=True, cors_origins=f"{DASHBOARD}, http://localhost:3000") as door:
        key = door.key("read")
        asked = door.client.options("/v1/jobs", headers=asking | {"Origin": DASHBOARD})
        assert asked.status_code == 200
        assert asked.headers["access-control-allow-origin"] == DASHBOARD
        answer = door.client.get("/v1/jobs", headers=key | {"Origin": DASHBOARD})
        assert answer.headers["access-control-allow-origin"] == DASHBOARD
        assert "etag" in answer.headers["access-control-expose-headers"].lower()
        assert "access-control-allow-credentials" not in answer.headers
        refused = door.client.get("/v1/jobs", headers={"Origin": DASHBOARD})
        assert_problem(refused, 401, "authentication_required")
        assert refused.headers["access-control-allow-origin"] == DASHBOARD
        foreign = door.client.options("/v1/jobs", headers=asking | {"Origin": NOT_OURS})
        assert foreign.status_code == 400
        answer = door.client.get("/v1/jobs", headers=key | {"Origin": NOT_OURS})
        assert "access-control-allow-origin" not in answer.headers
    with make_door() as door:
        answer = door.client.get("/v1/jobs", headers={"Origin": DASHBOARD})
        assert "access-control-allow-origin" not in answer.headers


@pytest.mark.parametrize("origins", ["*", "ops.example", "https://ops.example/", "null"])
def test_only_whole_origins_can_be_listed(origins: str) -> None:
    with pytest.raises(ValueError, match="is not an origin"):
        Settings(cors_origins=origins)


def test_a_page_of_another_site_changes_nothing(make_door: MakeDoor) -> None:
    body = ground_station()
    with make_door(cors_origins=DASHBOARD) as door:

        def answer(site: str, origin: str, key: dict[str, str] | None = None) -> httpx.Response:
            headers = {"Sec-Fetch-Site": site, "Origin": origin} | (key or {})
            return door.client.post("/v1/ground-stations", json=body, headers=headers)

        for site in ("cross-site", "same-site"):
            assert_problem(answer(site, NOT_OURS), 403, "foreign_origin")
            assert_problem(answer(site, "null"), 403, "foreign_origin")
            assert answer(site, DASHBOARD).status_code == 201
            assert_problem(answer(site, NOT_OURS, door.key("submit")), 403, "foreign_origin")
        own = str(door.client.base_url)
        assert answer("same-origin", own).status_code == 201
