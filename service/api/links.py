"""Links of the OpenAPI document: from the answer that creates a thing to the calls about it."""

from __future__ import annotations

from typing import Any, Final

_CREATED: Final = ("200", "201", "202")


def add_links(document: dict[str, Any]) -> None:
    """Link each creating call to every call whose only further need is the new thing's id."""
    paths = document["paths"]
    for path, operations in paths.items():
        if "post" not in operations:
            continue
        links = {
            operation["operationId"]: {
                "operationId": operation["operationId"],
                "parameters": {parameter: "$response.body#/id"},
                "description": operation.get("summary", ""),
            }
            for below, parameter in _below(path, paths)
            for operation in paths[below].values()
        }
        for status, response in operations["post"]["responses"].items():
            if links and status in _CREATED:
                response["links"] = links


def _below(collection: str, paths: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the paths that begin with one thing of a collection, and what its id is called."""
    found = []
    for path in paths:
        root, slot, _ = path.partition("/{")
        if slot and root == collection and path.count("{") == 1:
            found.append((path, path[path.index("{") + 1 : path.index("}")]))
    return found
