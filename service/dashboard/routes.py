"""Where the dashboard's pages and files are. They hold no data and so need no key."""

from __future__ import annotations

import hashlib
from typing import Final

from fastapi import APIRouter, Request, Response

from service.api.conditional import sent
from service.dashboard.assets import load_assets
from service.problems.kinds import ServiceError

router = APIRouter(include_in_schema=False)

PAGE_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; require-trusted-types-for 'script'; trusted-types 'none'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""Own files only, nothing inline, and no text that becomes markup."""

_ADDRESSES: Final = {
    "/": "jobs",
    "/new": "new",
    "/jobs/{job_id}": "job",
    "/comparisons/{comparison_id}": "comparison",
    "/plans": "plans",
    "/plans/{plan_id}": "plan",
    "/fleet": "fleet",
    "/targets": "targets",
    "/wall": "wall",
}
"""Each page, by the name that `assets.py` knows it by."""

_FOR_EVER: Final = "public, max-age=31536000, immutable"


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
    return sent(request, page.content, page.media_type, headers)


def _show(path: str, name: str) -> None:
    """Serve a page under an address; whether there is what it is about, the API will say."""

    def page(request: Request) -> Response:
        return _page(request, name)

    router.add_api_route(path, page, name=name)


for _path, _name in _ADDRESSES.items():
    _show(_path, _name)
