"""Where the dashboard's pages and files are. They hold no data and so need no key."""

from __future__ import annotations

import hashlib
from typing import Final

from fastapi import APIRouter, Request, Response

from service.api.etags import matches
from service.dashboard.assets import load_assets
from service.problems.kinds import ServiceError

router = APIRouter(include_in_schema=False)

PAGE_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; require-trusted-types-for 'script'; trusted-types 'none'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""Own files only, nothing inline, and no text that becomes markup."""

_FOR_EVER: Final = "public, max-age=31536000, immutable"


@router.get("/")
def jobs_page(request: Request) -> Response:
    """Return the list of jobs."""
    return _page(request, "jobs")


@router.get("/new")
def new_page(request: Request) -> Response:
    """Return the form that makes a scenario and a job."""
    return _page(request, "new")


@router.get("/jobs/{job_id}")
def job_page(request: Request) -> Response:
    """Return the page of one job; whether there is such a job the API will say."""
    return _page(request, "job")


@router.get("/comparisons/{comparison_id}")
def comparison_page(request: Request) -> Response:
    """Return the page of one comparison."""
    return _page(request, "comparison")


@router.get("/plans")
def plans_page(request: Request) -> Response:
    """Return the list of plans."""
    return _page(request, "plans")


@router.get("/plans/{plan_id}")
def plan_page(request: Request) -> Response:
    """Return the page of one plan."""
    return _page(request, "plan")


@router.get("/fleet")
def fleet_page(request: Request) -> Response:
    """Return the page on which satellites, stations and types are changed, and outages reported."""
    return _page(request, "fleet")


@router.get("/wall")
def wall_page(request: Request) -> Response:
    """Return the page for a display on the wall."""
    return _page(request, "wall")


@router.get("/static/{version}/{name}")
def static_file(version: str, name: str) -> Response:
    """Return a script, style or picture of this version."""
    assets = load_assets()
    asset = assets.static.get(name) if version == assets.version else None
    if asset is None:
        raise ServiceError("not_found", f"There is no file {name!r} of version {version!r}.")
    return Response(
        asset.content, media_type=asset.media_type, headers={"Cache-Control": _FOR_EVER}
    )


def _page(request: Request, name: str) -> Response:
    page = load_assets().pages[name]
    etag = f'"{hashlib.sha256(page.content).hexdigest()[:16]}"'
    headers = {
        "ETag": etag, "Cache-Control": "no-cache", "Content-Security-Policy": PAGE_POLICY,
    }  # fmt: skip
    if matches(request.headers.get("if-none-match"), etag):
        return Response(status_code=304, headers=headers)
    return Response(page.content, media_type=page.media_type, headers=headers)
