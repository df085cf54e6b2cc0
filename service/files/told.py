"""The form of a file, detected from its beginning, for clients that send only bytes."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final

_LOOKED_AT: Final = 4096
_JSON: Final = re.compile(r"\s*[{\[]")
_XML: Final = re.compile(r"\s*<")
_BINARY: Final = (b"\x89HDF", b"CDF\x01", b"CDF\x02", b"CDF\x05")
_COLLECTION: Final = re.compile(r'"type"\s*:\s*"FeatureCollection"')
# A CSV file has the keywords of an OMM in one line, its KVN form has one keyword per line.
_OMM_HEADER: Final = re.compile(r"(?=[^\n]*[,;\t])[^\n]*(NORAD_CAT_ID|MEAN_MOTION)", re.IGNORECASE)


def media_type_told(data: bytes, allowed: Collection[str]) -> str:
    """Return which of the allowed media types a file has.

    >>> files = ("application/json", "text/csv", "text/plain")
    >>> media_type_told(b"[]", files), media_type_told(b"1 25544U 98067A", files)
    ('application/json', 'text/plain')
    """
    if data.startswith(_BINARY):
        return _first(allowed, "netcdf")
    head = _text(data[:_LOOKED_AT])
    if _XML.match(head):
        return _first(allowed, "xml")
    if _JSON.match(head):
        is_geojson = _COLLECTION.search(_text(data)) is not None
        return _first(allowed, "geo+json" if is_geojson else "/json", "json")
    if "text/plain" in allowed and not _OMM_HEADER.match(head.lstrip()):
        return "text/plain"
    return "text/csv"


def _text(data: bytes) -> str:
    is_utf16 = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    return data.decode("utf-16" if is_utf16 else "utf-8-sig", errors="replace")


def _first(allowed: Collection[str], *ends: str) -> str:
    """Return the first allowed media type that has one of these ends, trying the ends in order."""
    found = (kind for end in ends for kind in allowed if kind.endswith(end))
    return next(found, "text/csv")
