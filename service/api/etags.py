"""ETags: what names the state of a thing, and how headers are held against it."""

from __future__ import annotations

import hashlib

from pydantic import BaseModel


def etag_of(text: str) -> str:
    """Return a strong ETag of a representation.

    >>> etag_of("a")
    '"ca978112ca1bbdca"'
    """
    return f'"{hashlib.sha256(text.encode()).hexdigest()[:16]}"'


def matches(if_none_match: str | None, etag: str) -> bool:
    """Return whether an ``If-None-Match`` header names this ETag (weak comparison).

    >>> matches('"x", W/"y"', '"y"'), matches("*", '"y"'), matches(None, '"y"')
    (True, True, False)
    """
    if if_none_match is None:
        return False
    known = {tag.strip().removeprefix("W/") for tag in if_none_match.split(",")}
    return "*" in known or etag.removeprefix("W/") in known


def matches_strongly(if_match: str, etag: str) -> bool:
    """Return whether an ``If-Match`` header names this ETag; a weak tag names nothing.

    >>> matches_strongly('"x", "y"', '"y"'), matches_strongly('W/"y"', '"y"')
    (True, False)
    """
    named = {tag.strip() for tag in if_match.split(",")}
    return "*" in named or etag in named


def etagged(model: BaseModel) -> str:
    """Return the ETag of a model's JSON."""
    return etag_of(model.model_dump_json())
