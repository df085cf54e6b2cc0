"""The content of every problem document."""

from __future__ import annotations

from typing import Any

import httpx

KEYS = {"type", "title", "status", "code", "detail", "instance", "request_id", "errors"}


def assert_problem(
    response: httpx.Response, status: int, code: str, pointer: str | None = None
) -> dict[str, Any]:
    """Check the shape, status and code of a problem; return it."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    body: dict[str, Any] = response.json()
    assert set(body) == KEYS
    assert body["status"] == status
    assert body["code"] == code, body
    assert body["type"] == "/problems/" + code.replace("_", "-")
    assert body["instance"] == response.request.url.path
    assert body["request_id"] == response.headers["x-request-id"]
    for error in body["errors"]:
        assert set(error) == {"pointer", "code", "row", "detail"}
    if pointer is not None:
        assert pointer in [error["pointer"] for error in body["errors"]], body["errors"]
    return body
