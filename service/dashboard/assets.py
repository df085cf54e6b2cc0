"""The dashboard's files as served: read once, with a hash of their content in the address."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Template
from typing import Final

_HERE: Final = Path(__file__).parent
_MEDIA_TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Asset:
    """One file."""

    content: bytes
    media_type: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Assets:
    """All files of one version of the dashboard.

    Attributes
    ----------
    version
        Hash of the static files. It is part of their address, so that a page never runs
        scripts of another version and browsers may cache them for ever.
    static, pages
        By name.
    """

    version: str
    static: dict[str, Asset]
    pages: dict[str, Asset]


PAGES: Final = {
    "jobs": ("/", "Jobs"),
    "new": ("/new", "New plan"),
    "job": ("/jobs/{job_id}", "Job"),
    "comparison": ("/comparisons/{comparison_id}", "Comparison"),
    "plans": ("/plans", "Plans"),
    "plan": ("/plans/{plan_id}", "Plan"),
    "fleet": ("/fleet", "Fleet"),
    "targets": ("/targets", "Targets"),
    "wall": ("/wall", "Wall"),
}
"""Address and title of each page; its script has the page's name."""


@cache
def load_assets() -> Assets:
    """Return the files that ship with this version."""
    static = {
        path.name: Asset(content=path.read_bytes(), media_type=_MEDIA_TYPES[path.suffix])
        for path in sorted((_HERE / "static").iterdir())
        if path.suffix in _MEDIA_TYPES
    }
    digest = hashlib.sha256()
    for name, asset in static.items():
        digest.update(f"{name} {len(asset.content)}\n".encode() + asset.content)
    version = digest.hexdigest()[:16]
    pages = {name: _page(name, version) for name in PAGES}
    return Assets(version=version, static=static, pages=pages)


def _page(name: str, version: str) -> Asset:
    layout = Template((_HERE / "pages" / "layout.html").read_text(encoding="utf-8"))
    main = (_HERE / "pages" / f"{name}.html").read_text(encoding="utf-8")
    filled = layout.substitute(
        title=PAGES[name][1],
        static=f"/static/{version}",
        script=f"{name}_page.js",
        main=main.strip(),
    )
    return Asset(content=filled.encode(), media_type="text/html; charset=utf-8")
