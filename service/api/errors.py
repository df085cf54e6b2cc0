"""Exceptions as answers: every error leaves the server as an RFC 9457 problem document."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import iter_route_contexts
from sqlalchemy.exc import SQLAlchemyError
from starlette.exceptions import HTTPException

from planner_core.errors import Fault, PlannerError
from service.access.tokens import masked
from service.api.security_headers import SECURITY_HEADERS
from service.db.failures import why_unavailable
from service.problems.faults import faults_of, refuse
from service.problems.kinds import ServiceError, kind_of
from service.wire.operations import FaultOut, ProblemOut

PROBLEM_JSON = "application/problem+json"
MAX_FAULTS = 100
DATABASE_RETRY_S = 5

logger = logging.getLogger(__name__)


def install_error_handlers(app: FastAPI) -> None:
    """Route every exception, the framework's own included, to a problem document."""
    app.exception_handler(ServiceError)(_on_service_error)
    app.exception_handler(PlannerError)(_on_planner_error)
    app.exception_handler(RequestValidationError)(_on_validation_error)
    app.exception_handler(HTTPException)(_on_http_exception)
    app.exception_handler(SQLAlchemyError)(_on_database_error)
    app.exception_handler(Exception)(_on_bug)


def refusals(app: FastAPI) -> dict[Any, Any]:
    """Return the handlers for middleware before the routes, which also refuses by raising."""
    return {kind: on for kind, on in app.exception_handlers.items() if kind is not Exception}


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the OpenAPI entries of these error statuses, for ``responses=``."""
    schema = {"$ref": "#/components/schemas/Problem"}
    return {
        status: {
            "description": HTTPStatus(status).phrase,
            "content": {PROBLEM_JSON: {"schema": schema}},
        }
        for status in statuses
    }


def problem(
    request: Request,
    code: str,
    detail: str,
    *,
    faults: Sequence[Fault] = (),
    headers: Mapping[str, str] | None = None,
    status: int | None = None,
) -> JSONResponse:
    """Return the response for one problem."""
    kind = kind_of(code)
    number = status or kind.status
    if len(faults) > MAX_FAULTS:
        detail = f"{detail} ({len(faults) - MAX_FAULTS} more errors are not listed.)"
    body = ProblemOut(
        type=f"/problems/{code.replace('_', '-')}",
        title=kind.title,
        status=number,
        code=code,
        detail=_sendable(detail),
        instance=masked(request.scope["path"]),
        request_id=request.state.request_id,
        errors=[
            FaultOut(
                pointer=None if f.pointer is None else _sendable(f.pointer),
                code=f.code,
                row=f.row,
                detail=_sendable(f.detail),
            )
            for f in faults[:MAX_FAULTS]
        ],
    )
    return JSONResponse(
        body.model_dump(), status_code=number, headers=dict(headers or {}), media_type=PROBLEM_JSON
    )


def _sendable(text: str) -> str:
    # JSON can hold a lone surrogate, for example in a field's name; UTF-8 cannot.
    # A key that was put into an address by mistake is not repeated in the answer.
    return masked(text.encode("utf-8", "replace").decode())


# Handlers that need no thread are async, so that refusals do not wait for one.


async def _on_service_error(request: Request, error: ServiceError) -> JSONResponse:
    return problem(request, error.code, error.detail, faults=error.faults, headers=error.headers)


def _on_planner_error(request: Request, error: PlannerError) -> JSONResponse:
    return problem(request, error.code, error.detail, faults=(error.fault,))


def _on_validation_error(request: Request, error: RequestValidationError) -> JSONResponse:
    told = refuse(faults_of(error.errors(), error.body))
    return problem(request, told.code, told.detail, faults=told.faults)


_HTTP_CODES = {
    400: "malformed_json",  # FastAPI's status for a body it could not parse at all
    404: "not_found",
    405: "method_not_allowed",
    406: "not_acceptable",
    413: "body_too_large",
    415: "unsupported_media_type",
}


def _on_http_exception(request: Request, error: HTTPException) -> JSONResponse:
    code = _HTTP_CODES.get(error.status_code)
    if code is None:
        code = "_".join(HTTPStatus(error.status_code).phrase.lower().split())
        return problem(request, code, error.detail, headers=error.headers, status=error.status_code)
    headers = dict(error.headers or {})
    if error.status_code == 405 and (methods := _methods(request)):
        headers["Allow"] = ", ".join(methods)
    return problem(request, code, _http_detail(request, error), headers=headers)


def _methods(request: Request) -> list[str]:
    # Each method is a separate route, and the framework lists only those of the first route.
    path = getattr(request.scope.get("route"), "path", None)
    routes = iter_route_contexts(request.app.routes)
    return sorted(
        {method for route in routes if route.path == path for method in route.methods or ()}
    )


def _http_detail(request: Request, error: HTTPException) -> str:
    match error.status_code:
        case 400:
            return "The body cannot be read as JSON."
        case 404:
            return f"There is nothing at {request.url.path}."
        case 405:
            return f"{request.method} is not allowed at {request.url.path}."
    return error.detail


async def _on_database_error(request: Request, error: Exception) -> JSONResponse:
    # Unavailable or full; our own faults are raised again.
    why = why_unavailable(error)
    if why is None:
        raise error
    # Only the driver's message: SQLAlchemy's would add the statement and its values.
    logger.warning("the database did not serve a request: %s", getattr(error, "orig", error))
    headers = {"Retry-After": str(DATABASE_RETRY_S)}
    return problem(request, "database_unavailable", why, headers=headers)


def _on_bug(request: Request, error: Exception) -> JSONResponse:
    # The server re-raises the exception after this answer and logs its traceback, but
    # without the request; this line is the one that can be searched for by request_id.
    logger.error("unhandled exception", exc_info=error)
    return problem(
        request,
        "internal_error",
        f"The service failed; see request {request.state.request_id} in its log.",
        # This answer is made outside the middleware that adds headers.
        headers={"X-Request-ID": request.state.request_id} | SECURITY_HEADERS,
    )
