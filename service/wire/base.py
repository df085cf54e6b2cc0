"""Bases of all models, strict for writers and lenient for readers; instants, names, ids."""

from __future__ import annotations

import json
import re
import sys
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Final, Generic, Self, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    PrivateAttr,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from service.wire.instants import instant_text
from service.wire.stored import beyond_ranges

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)

Json = dict[str, Any]

_READING: Final = "reading"
_MOST_FIELDS: Final = 1000
_LARGEST: Final = sys.float_info.max
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
            "invalid_time",
            "An instant must be in RFC 3339 form, for example 2026-01-31T12:00:00.000Z",
        )
    day, clock, fraction, offset = match.groups()
    if offset is None:
        raise PydanticCustomError(
            "naive_time", "The instant has no time zone: end it with Z or an offset from UTC"
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

TEXT: Final = r"^[^\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufffe\uffff]*$"
"""Pattern of every text: no line ends or control characters, no marks that change the direction
of neighbouring text, nothing that XML forbids. Lone surrogates are refused as well."""
_PLAIN: Final = re.compile(TEXT.replace(r"\ufffe", r"\ud800-\udfff\ufffe"))

Name = Annotated[
    str,
    StringConstraints(min_length=1, max_length=200, pattern=TEXT),
    Field(description="A name for people to read: up to 200 printable characters."),
]
Id = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=TEXT)]

Reason = Annotated[str, StringConstraints(min_length=1, max_length=1000, pattern=TEXT)]
"""A reason for people to read; printable characters."""

Fraction = Annotated[float, Field(ge=0, le=1)]

MOST: Final = 1e9
"""Maximum of every amount, so that sums and products of amounts stay finite and exact."""
LEAST: Final = 1e-6
"""Minimum of every divisor."""
SHORTEST_S: Final = 1e-3
"""The resolution of instants."""

Knot = Annotated[list[float], Field(min_length=2, max_length=2)]
NonNegative = Annotated[float, Field(ge=0, le=MOST)]
Positive = Annotated[float, Field(ge=LEAST, le=MOST)]
Duration = Annotated[float, Field(ge=SHORTEST_S, le=MOST)]


def is_plain(text: str) -> bool:
    r"""Return whether a text may be sent, stored and exported.

    >>> [is_plain(text) for text in ("EYE-1 é", "a\u0085b", "a\u202eb", "\ud800")]
    [True, False, False, False]
    """
    return _PLAIN.fullmatch(text) is not None


def require_plain(value: T) -> T:
    """Return free JSON; refuse it if it holds a forbidden text or a number beyond any float."""
    waiting: list[object] = [value]
    while waiting:
        part = waiting.pop()
        if isinstance(part, dict):
            waiting += [*part, *part.values()]
        elif isinstance(part, list):
            waiting += part
        elif isinstance(part, str) and not is_plain(part):
            raise PydanticCustomError(
                "plain_text", "A text contains characters that are not allowed"
            )
        elif isinstance(part, int | float) and not abs(part) <= _LARGEST:
            raise PydanticCustomError("finite_number", "A number is infinite or beyond 1.8e308")
    return value


Free = Annotated[T, BeforeValidator(require_plain)]
"""JSON whose fields are not declared; forbidden texts and numbers in it are still refused."""


def _open(value: object, known: ValidatorFunctionWrapHandler, info: ValidationInfo) -> object:
    return value if info.context == _READING and isinstance(value, str) else known(value)


Open = Annotated[T, WrapValidator(_open)]
"""One of a set of words. Readers accept any word, as a newer service may add some."""


def _for_readers(schema: Json) -> None:
    """Allow further fields in the OpenAPI schema of an answer: a newer service may add some."""
    schema.pop("additionalProperties", None)


class Wire(BaseModel):
    """Base of everything that is sent."""

    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_extra=_for_readers)

    def __getitem__(self, name: str) -> Any:
        """Return a field by its name in JSON."""
        return getattr(self, name)


class Stored(Wire):
    """Base of resources with an ETag, which identifies their state and is sent in a header."""

    _etag: str | None = PrivateAttr(None)

    @property
    def etag(self) -> str | None:
        """The ETag of its state, if it was read on its own; None if it was read from a list."""
        return self._etag

    def with_etag(self, etag: str | None) -> Self:
        """Return a copy that has this ETag."""
        copy = self.model_copy()
        copy._etag = etag
        return copy


class Listed(Wire, Generic[T]):
    """One page of a list."""

    items: tuple[T, ...]
    next: str | None = Field(description="Cursor of the next page; null on the last one.")


def dumped(model: BaseModel, include: set[str] | None = None) -> Json:
    """Return a model, or some of its fields, as JSON values."""
    return model.model_dump(mode="json", include=include)


def fields_of(body: BaseModel, shape: type[BaseModel]) -> dict[str, Any]:
    """Return the values of a body that are fields of this shape, without converting them."""
    return {name: getattr(body, name) for name in shape.model_fields}


def read(model: type[M], text: str | bytes) -> M:
    """Parse an answer; ignore unknown fields and accept unknown words."""

    def validate(text: str | bytes) -> M:
        return model.model_validate_json(text, extra="ignore", context=_READING)

    try:
        return validate(text)
    except ValidationError as error:
        if error.errors(include_url=False)[0]["type"] == "json_invalid":
            raise
        return beyond_ranges(lambda values: validate(json.dumps(values)), json.loads(text), error)


class Body(Wire):
    """Base of everything a client sends: unknown fields, "5" for 5, and NaN are refused."""

    model_config = ConfigDict(
        strict=True, allow_inf_nan=False, validate_default=False, json_schema_extra=None
    )

    @model_validator(mode="before")
    @classmethod
    def _is_no_dump(cls, value: object) -> object:
        # Pydantic would report every excess field, at a hundred times the field's own memory.
        if isinstance(value, dict) and len(value) > _MOST_FIELDS:
            raise PydanticCustomError(
                "too_many_fields",
                "The object has {num_fields} fields; the limit is {most}",
                {"num_fields": len(value), "most": _MOST_FIELDS},
            )
        return value


class Patch(Body):
    """Base of partial updates."""

    @model_validator(mode="after")
    def _changes_something(self) -> Self:
        if not self.model_fields_set:
            raise PydanticCustomError("nothing_changed", "Give at least one field to change")
        return self
