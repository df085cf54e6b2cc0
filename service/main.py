"""Assembly of the HTTP application."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from operator import attrgetter
from typing import TYPE_CHECKING

from fastapi import Depends, FastAPI
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.exceptions import ExceptionMiddleware

import planner_core
from service.answers.explanations import Explainer
from service.answers.variations import Variations
from service.api import (
    comparisons,
    element_exports,
    forecasts,
    ground_stations,
    job_events,
    job_questions,
    jobs,
    meta,
    metrics,
    openapi,
    outages,
    passes,
    plans,
    replans,
    satellites,
    scenarios,
    solvers,
    spacecraft,
    stapi,
    target_catalogs,
    targets,
    telemetry,
    timelines,
    webhooks,
)
from service.api.body_limit import BodyLimit
from service.api.bulkhead import Admitted, Bulkhead
from service.api.deps import check_request
from service.api.errors import install_error_handlers, refusals
from service.api.guard import Guard
from service.api.idempotency import install_replay
from service.api.middleware import RequestContext
from service.api.polls import Polls
from service.api.questions import Questions
from service.api.security_headers import SecurityHeaders
from service.dashboard import routes as dashboard
from service.db.session import Database
from service.process.tracing import is_untraced
from service.scenarios.opportunities import OpportunityReader
from service.settings import Settings

if TYPE_CHECKING:
    from service.jobs.queue import JobQueue

DESCRIPTION = (
    "Operations planning for agile Earth-observation satellites, with a referee for every "
    "timeline. Instants are RFC 3339 in UTC; units end the names; unknown fields are refused; "
    "errors are problem documents (RFC 9457)."
)

ROUTERS = tuple(
    module.router
    for module in (
        element_exports, satellites, spacecraft, stapi, ground_stations, outages, target_catalogs,
        targets, forecasts, scenarios, jobs, timelines, job_questions, job_events, comparisons,
        solvers, plans, telemetry, passes, replans, webhooks, meta, metrics, openapi, dashboard,
    )
)  # fmt: skip


def create_app(
    settings: Settings,
    queue: JobQueue | None = None,
    *,
    heavy: str | None = None,
    is_heavy: bool = False,
) -> FastAPI:
    """Return the application. The database must have been migrated.

    Parameters
    ----------
    settings
        The configuration of this process.
    queue
        Where jobs are sent; without it the service accepts none.
    heavy
        Socket file of a process for heavy requests; without it they are handled here.
    is_heavy
        Whether this is that process, whose callers another process has already admitted.
    """
    app = FastAPI(
        title="Slewline",
        version=planner_core.__version__,
        description=DESCRIPTION,
        openapi_url=None,  # service.api.openapi has its own routes
        docs_url=None,  # FastAPI's pages load scripts from the internet
        redoc_url=None,
        lifespan=_lifespan,
        dependencies=[Depends(check_request)],
        redirect_slashes=False,
        # Names of operations in generated clients.
        generate_unique_id_function=attrgetter("name"),
        # Spans only if service.process.tracing has set them up; metrics and logs are our own.
        telemetry={
            "metrics": False,
            "logs": False,
            "operation_spans": False,
            "auto_configure": False,
            "exclude": is_untraced,
        },
    )
    app.state.settings = settings
    app.state.database = Database(settings.database_url, settings.database_timeout_s)
    app.state.opportunities = OpportunityReader()
    app.state.explainer = Explainer()
    app.state.variations = Variations()
    app.state.queue = queue
    app.state.questions = Questions(app.state)
    app.state.call_counters = metrics.CallCounters()
    for router in ROUTERS:
        app.include_router(router)
    install_error_handlers(app)
    install_replay(app)
    openapi.install_openapi(app)
    # The last one added is the outermost.
    if is_heavy:
        app.add_middleware(Admitted)
        return app
    if heavy is not None:
        app.add_middleware(Bulkhead, address=heavy)
    app.add_middleware(Polls, state=app.state)
    app.add_middleware(BodyLimit, max_bytes=int(settings.max_body_mb * 1_000_000))
    app.add_middleware(Guard, settings=settings)
    # Errors of the guard, a limit or the bulkhead are answered like those of routes.
    app.add_middleware(ExceptionMiddleware, handlers=refusals(app))
    if settings.allowed_origins:
        _allow_pages(app, settings.allowed_origins)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(RequestContext, counters=app.state.call_counters)
    return app


def _allow_pages(app: FastAPI, origins: Sequence[str]) -> None:
    # Outside the guard, which would demand a key for a browser's preflight request.
    app.add_middleware(
        CORSMiddleware,
        allow_origins=origins,
        allow_methods=["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE"],
        allow_headers=[
            "Authorization", "X-API-Key", "Content-Type", "Idempotency-Key", "If-Match",
            "If-None-Match", "Last-Event-ID", "X-Request-ID",
        ],
        expose_headers=[
            "Content-Disposition", "ETag", "Idempotency-Replayed", "Link", "Location",
            "Retry-After", "WWW-Authenticate", "X-Request-ID",
        ],
    )  # fmt: skip


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    yield
    app.state.explainer.close()
    app.state.variations.close()
    app.state.opportunities.close()
    app.state.database.close()
