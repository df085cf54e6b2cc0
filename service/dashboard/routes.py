"""Routes of the dashboard's pages and files, which hold no data and so need no key."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter, Request, Response

from service.api.conditional import etag_of, sent
from service.dashboard.assets import PAGES, load_assets
from service.problems.kinds import ServiceError

router = APIRouter(include_in_schema=False)

PAGE_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; require-trusted-types-for 'script'; trusted-types 'none'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""Own files only, nothing inline, and no text turned into markup."""

_FOR_EVER: Final = "public, max-age=31536000, immutable"


@router.get("/static/{version}/{name}")
def static_file(version: str, name: str) -> Response:
    """Return a script, style sheet or picture of this version."""
    assets = load_assets()
    asset = assets.static.get(name) if version == assets.version else None
    if asset is None:
        raise ServiceError("not_found", f"There is no file {name!r} of version {version!r}.")
    return Response(
        asset.content, media_type=asset.media_type, headers={"Cache-Control": _FOR_EVER}
    )


def _show(name: str, path: str) -> None:
    """Serve a page at an address; whether its subject exists is left to the API."""

    def page(request: Request) -> Response:
        found = load_assets().pages[name]
        headers = {
            "ETag": etag_of(found.content.decode()), "Cache-Control": "no-cache",
            "Content-Security-Policy": PAGE_POLICY,
        }  # fmt: skip
        return sent(request, found.content, found.media_type, headers)

    router.add_api_route(path, page, name=name)


for _name, (_path, _) in PAGES.items():
    _show(_name, _path)
