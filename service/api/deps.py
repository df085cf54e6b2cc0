"""What a route asks the application for, and what every call is checked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, cast

from fastapi import Depends, Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from planner_core.errors import Fault
from service.api.errors import refuse
from service.api.problems import ServiceError
from service.db.session import Database
from service.settings import Settings


def _database(request: Request) -> Database:
    return cast(Database, request.app.state.database)


def _settings(request: Request) -> Settings:
    return cast(Settings, request.app.state.settings)


async def _raw_body(request: Request) -> bytes:
    return await request.body()


DatabaseDep = Annotated[Database, Depends(_database)]
SettingsDep = Annotated[Settings, Depends(_settings)]
RawBodyDep = Annotated[bytes, Depends(_raw_body)]


def media_type_of(request: Request) -> str:
    """Return the media type of the body in lower case, without parameters; "" for none."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def require_media_type(request: Request, *allowed: str) -> str:
    """Return the media type of the body; 415 where it is none of these."""
    media_type = media_type_of(request)
    if media_type not in allowed:
        said = media_type or "missing"
        raise ServiceError(
            "unsupported_media_type",
            f"Content-Type is {said}; this call takes {', '.join(allowed)}.",
            headers={"Accept-Post": ", ".join(allowed)},
        )
    return media_type


async def check_request(request: Request) -> None:
    """Refuse query parameters that the call does not have, and JSON bodies sent as another type."""
    route = request.scope.get("route")
    if not isinstance(route, APIRoute):
        return
    known = set(_query_names(route.dependant))
    faults = [
        Fault(code="unknown_parameter", detail=f"There is no query parameter {name!r}.")
        for name in request.query_params
        if name not in known
    ]
    if faults:
        raise refuse(faults)
    if route.body_field is not None and await request.body():
        require_media_type(request, "application/json")


def _query_names(dependant: Dependant) -> Iterator[str]:
    for field in dependant.query_params:
        yield field.alias
    for part in dependant.dependencies:
        yield from _query_names(part)
