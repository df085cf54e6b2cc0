"""Answers that carry an ETag, and 304 where the client already has them."""

from __future__ import annotations

from typing import TypeVar

from fastapi import Request, Response
from pydantic import BaseModel

from service.api.shapes import etagged, matches

M = TypeVar("M", bound=BaseModel)


def unless_known(request: Request, response: Response, model: M) -> M | Response:
    """Return the model with its ETag, or 304 where ``If-None-Match`` names that ETag."""
    etag = etagged(model)
    if matches(request.headers.get("if-none-match"), etag):
        return Response(status_code=304, headers={"ETag": etag})
    response.headers["ETag"] = etag
    return model


def created(response: Response, model: M, location: str) -> M:
    """Return the model of something new, with its ``Location`` and ETag."""
    response.headers["Location"] = location
    response.headers["ETag"] = etagged(model)
    return model
