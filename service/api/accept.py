"""The form that an ``Accept`` header prefers among several (RFC 9110, section 12.5.1)."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from service.problems.kinds import ServiceError


def require_offered(suffix: str, offered: Collection[str], what: str) -> None:
    """Refuse (406) a suffix that names none of the offered forms."""
    if suffix not in offered:
        forms = ", ".join(f".{known}" for known in offered)
        raise ServiceError("not_acceptable", f"{what} offered as {forms}.")


def preferred(accept: str | None, offered: Sequence[str]) -> str | None:
    """Return the media type to answer in, or None if none is acceptable.

    Of equally preferred types, one that is named wins over one matched by a wildcard, and then
    the first one offered wins.

    >>> preferred("text/csv, */*;q=0.1", ["application/json", "text/csv"])
    'text/csv'
    >>> preferred(None, ["application/json", "text/csv"])
    'application/json'
    >>> preferred("image/png", ["application/json"]) is None
    True
    """
    ranges = [_read(part) for part in (accept or "*/*").split(",") if part.strip()]
    best: tuple[float, int] = (0.0, 0)
    chosen = None
    for media_type in offered:
        family = media_type.partition("/")[0]
        names = (media_type, f"{family}/*", "*/*")
        # The most specific range that fits determines the quality of this type.
        fits = [(3 - names.index(name), quality) for name, quality in ranges if name in names]
        if fits:
            precision, quality = max(fits)
            if quality > 0.0 and (quality, precision) > best:
                best, chosen = (quality, precision), media_type
    return chosen


def _read(part: str) -> tuple[str, float]:
    name, *parameters = (piece.strip().lower() for piece in part.split(";"))
    quality = 1.0
    for parameter in parameters:
        if parameter.startswith("q="):
            try:
                quality = float(parameter[2:])
            except ValueError:
                quality = 0.0
    return name, quality
