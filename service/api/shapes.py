"""What all resources share: instants, strict schemas, ETags."""

from __future__ import annotations

import hashlib
import re
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    StringConstraints,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from service.instants import instant_text

_MOST_FIELDS = 1000
_RFC3339 = re.compile(
    r"(\d{4}-\d\d-\d\d)[Tt ](\d\d:\d\d:\d\d)(?:\.(\d{1,9})\d*)?([Zz]|[+-]\d\d:\d\d)?"
)


def parse_instant(value: object) -> datetime:
    """Return the UTC instant of an RFC 3339 text, to the nearest millisecond.

    >>> parse_instant("2026-01-01T02:00:00+02:00").isoformat()
    '2026-01-01T00:00:00+00:00'
    """
    if isinstance(value, datetime):
        return value
    match = _RFC3339.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise PydanticCustomError(
            "invalid_time", "An instant is RFC 3339, for example 2026-01-31T12:00:00.000Z"
        )
    day, clock, fraction, offset = match.groups()
    if offset is None:
        raise PydanticCustomError(
            "naive_time", "The instant has no time zone: end it in Z or in an offset from UTC"
        )
    zone = "+00:00" if offset in "Zz" else offset
    try:
        whole = datetime.fromisoformat(f"{day}T{clock}{zone}").astimezone(UTC)
        return whole + timedelta(milliseconds=round(float(f"0.{fraction or 0}") * 1000.0))
    except (ValueError, OverflowError):
        raise PydanticCustomError("invalid_time", "There is no such instant") from None


Instant = Annotated[
    datetime,
    BeforeValidator(parse_instant),
    PlainSerializer(instant_text, return_type=str, when_used="json"),
    WithJsonSchema(
        {"type": "string", "format": "date-time", "examples": ["2026-01-31T12:00:00.000Z"]}
    ),
]

Name = Annotated[
    str,
    StringConstraints(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$"),
    Field(description="For people; up to 200 printable characters."),
]


class Body(BaseModel):
    """Base of everything a client sends: unknown fields, "5" for 5, and NaN are refused."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False, validate_default=False
    )

    @model_validator(mode="before")
    @classmethod
    def _is_no_dump(cls, value: object) -> object:
        # Each field too many would be told of, which takes a hundred times its own memory.
        if isinstance(value, dict) and len(value) > _MOST_FIELDS:
            raise PydanticCustomError(
                "too_many_fields",
                "The object has {num_fields} fields; {most} are the most",
                {"num_fields": len(value), "most": _MOST_FIELDS},
            )
        return value


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


Json = dict[str, Any]
