"""The service's answers, checked against the OpenAPI document."""

from __future__ import annotations

import re
from typing import Any

import httpx
from jsonschema import Draft202012Validator

Document = dict[str, Any]


class Contract:
    """Checks answers against the document: status, media type, and the schema of JSON bodies.

    Pass ``check`` to a client as an event hook to check every answer of a test.
    """

    def __init__(self, document: Document):
        self.document = document
        self.seen: set[tuple[str, str, str]] = set()
        paths = sorted(document["paths"], key=lambda path: (path.count("{"), path))
        self._patterns = [
            (re.compile(re.sub(r"\{[^}]+\}", "[^/]+", path.replace(".", r"\."))), path)
            for path in paths
        ]

    def operation(self, method: str, path: str) -> tuple[str, Document] | None:
        """Return the template and the operation of a call; None if there is none."""
        for pattern, template in self._patterns:
            operation = self.document["paths"][template].get(method.lower())
            if pattern.fullmatch(path) and operation is not None:
                return template, operation
        return None

    def check(self, response: httpx.Response) -> None:
        """Raise an error if an answer is not declared."""
        request = response.request
        # The path as sent: an id may contain a slash.
        path = request.url.raw_path.decode().partition("?")[0]
        found = self.operation(request.method, path)
        told = f"{request.method} {request.url.path}: {response.status_code}"
        if found is None:
            assert response.status_code in (200, 304, 404, 405, 413), told  # pages, and nothing
            return
        template, operation = found
        declared = operation["responses"].get(str(response.status_code))
        assert declared is not None, f"{told} is not declared"
        self.seen.add((request.method, template, str(response.status_code)))
        media_type = response.headers.get("content-type", "").partition(";")[0]
        content = declared.get("content", {})
        if not content:
            assert not response.read(), f"{told} has a body, and none is declared"
            return
        assert media_type in content, f"{told}: {media_type} is not declared"
        if media_type.endswith("json"):
            response.read()
            self._validate(content[media_type].get("schema", {}), response.json(), told)

    def _validate(self, schema: Document, body: object, told: str) -> None:
        whole = schema | {"components": self.document["components"]}
        error = next(Draft202012Validator(whole).iter_errors(body), None)
        assert error is None, f"{told}: {error}"
