"""ETags identify states: 304 if a client is up to date, 412 if it should be but is not."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from fastapi import Request, Response
from pydantic import BaseModel

from service.api.deps import Call
from service.api.errors import problem_responses
from service.problems.kinds import ServiceError

M = TypeVar("M", bound=BaseModel)
R = TypeVar("R")

NOT_MODIFIED: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "`If-None-Match` names the current version: nothing has changed."}
}
"""For ``responses=`` of every route that may answer 304."""


def etag_of(text: str) -> str:
    """Return a strong ETag of a representation.

    >>> etag_of("a")
    '"ca978112ca1bbdca"'
    """
    return f'"{hashlib.sha256(text.encode()).hexdigest()[:16]}"'


def matches(if_none_match: str | None, etag: str) -> bool:
    """Return whether an ``If-None-Match`` header names this ETag (weak comparison).

    >>> matches('"x", W/"y"', '"y"'), matches("*", '"y"'), matches(None, '"y"')
    (True, True, False)
    """
    if if_none_match is None:
        return False
    known = {tag.strip().removeprefix("W/") for tag in if_none_match.split(",")}
    return "*" in known or etag.removeprefix("W/") in known


def matches_strongly(if_match: str, etag: str) -> bool:
    """Return whether an ``If-Match`` header names this ETag; a weak tag names nothing.

    >>> matches_strongly('"x", "y"', '"y"'), matches_strongly('W/"y"', '"y"')
    (True, False)
    """
    named = {tag.strip() for tag in if_match.split(",")}
    return "*" in named or etag in named


def etagged(model: BaseModel) -> str:
    """Return the ETag of a model's JSON."""
    return etag_of(model.model_dump_json())


def readable(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the OpenAPI entries of a route that reads one thing by its id."""
    return {**NOT_MODIFIED, **problem_responses(404, *statuses)}


def known_as(call: Call, etag: str) -> Response | None:
    """Give the answer this ETag; return 304 if ``If-None-Match`` names it, else None."""
    call.response.headers["ETag"] = etag
    is_known = matches(call.request.headers.get("if-none-match"), etag)
    return Response(status_code=304, headers={"ETag": etag}) if is_known else None


def sent(
    request: Request, content: str | bytes, media_type: str, headers: Mapping[str, str]
) -> Response:
    """Return the content, or 304 if ``If-None-Match`` names the ETag among its headers."""
    if matches(request.headers.get("if-none-match"), headers["ETag"]):
        return Response(status_code=304, headers=headers)
    return Response(content, media_type=media_type, headers=headers)


def unless_known(call: Call, model: M) -> M | Response:
    """Return the model with its ETag, or 304 if ``If-None-Match`` names that ETag."""
    return known_as(call, etagged(model)) or model


def matched(call: Call, row: R, show: Callable[[R], BaseModel]) -> R:
    """Return a row that is to change; 412 if ``If-Match`` names another state than its own.

    Call it in the transaction of the change, with the row locked.
    """
    if "if-match" in call.request.headers:
        require_match(call, etagged(show(row)))
    return row


def require_match(call: Call, etag: str) -> None:
    """Refuse a change (412) if ``If-Match`` does not name this ETag."""
    asked = call.request.headers.get("if-match")
    if asked is not None and not matches_strongly(asked, etag):
        raise ServiceError(
            "precondition_failed",
            f"If-Match is {asked[:200]}, but the current ETag is {etag}: it has been changed.",
            headers={"ETag": etag},
        )


def located(call: Call, model: M, location: str) -> M:
    """Return the model of something new or changed; set its ``Location`` and ETag."""
    call.response.headers.update({"Location": location, "ETag": etagged(model)})
    return model
