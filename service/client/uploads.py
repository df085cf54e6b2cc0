"""Files to send to the service: their bytes, and the media type that names their form."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

Source = Path | str | bytes
"""A file, or its content."""

MEDIA_TYPES: Final = {
    "tle": "text/plain",
    "kvn": "text/plain",
    "json": "application/json",
    "geojson": "application/geo+json",
    "csv": "text/csv",
    "netcdf": "application/netcdf",
    "xml": "application/xml",
}
_SUFFIXES: Final = {
    ".txt": "tle",
    ".2le": "tle",
    ".3le": "tle",
    ".oem": "kvn",
    ".nc": "netcdf",
    ".nc4": "netcdf",
}


def upload(source: Source, form: str | None) -> dict[str, Any]:
    """Return how to send a file: its content, and the header that names its form.

    Parameters
    ----------
    form
        A key of ``MEDIA_TYPES``; None if the suffix of a ``Path`` tells it.

    >>> upload("id,lat_deg,lon_deg", "csv")
    {'content': b'id,lat_deg,lon_deg', 'headers': {'Content-Type': 'text/csv'}}
    """
    name = form
    if name is None and isinstance(source, Path):
        name = _SUFFIXES.get(source.suffix.lower(), source.suffix.lower().removeprefix("."))
    if name not in MEDIA_TYPES:
        known = ", ".join(MEDIA_TYPES)
        said = "the form of a text must be given" if name is None else f"there is no form {name!r}"
        raise ValueError(f"{said}: {known}")
    match source:
        case Path():
            content = source.read_bytes()
        case str():
            content = source.encode()
        case bytes():
            content = source
    return {"content": content, "headers": {"Content-Type": MEDIA_TYPES[name]}}
