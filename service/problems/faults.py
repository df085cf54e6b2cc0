"""Faults of a body or a file as problems: from pydantic's errors to JSON pointers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from planner_core.errors import Fault
from service.problems.kinds import ServiceError

M = TypeVar("M", bound=BaseModel)


def refuse(faults: Sequence[Fault], *, code: str | None = None) -> ServiceError:
    """Return the error for a body with these faults, with their code if they share one."""
    codes = {fault.code for fault in faults}
    common = codes.pop() if len(codes) == 1 else "invalid_request"
    first = faults[0]
    where = f"line {first.row}: " if first.row else f"{first.pointer}: " if first.pointer else ""
    detail = f"{where}{first.detail}"
    if len(faults) > 1:
        detail = f"{len(faults)} errors; the first: {detail}"
    return ServiceError(code or common, detail, faults=tuple(faults))


def refuse_one(
    code: str, detail: str, pointer: str | None = None, *, row: int | None = None
) -> ServiceError:
    """Return the error for a body with one fault."""
    return refuse([Fault(code=code, detail=detail, pointer=pointer, row=row)])


def require_none(faults: Sequence[Fault]) -> None:
    """Refuse a body that has faults."""
    if faults:
        raise refuse(faults)


def validated(shape: type[M], values: object) -> M:
    """Return a document of this shape; 422 with all faults if it does not fit."""
    try:
        return shape.model_validate(values)
    except ValidationError as error:
        raise refuse(faults_of_validation(error, values)) from None


def pointer_to(*steps: str | int) -> str:
    """Return the JSON pointer with these steps.

    >>> pointer_to("rewards", "a/b"), pointer_to()
    ('/rewards/a~1b', '')
    """
    return "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in steps)


def faults_of(errors: Iterable[Any], body: object) -> list[Fault]:
    """Return pydantic's errors as faults, with JSON pointers into ``body``."""
    return [
        Fault(
            code=_CODES.get(e["type"], "invalid_value"),
            detail=_sentence(e),
            pointer=_pointer(e["loc"], body),
        )
        for e in errors
    ]


def faults_of_validation(error: ValidationError, body: object) -> list[Fault]:
    """Return the faults of a document that was validated outside FastAPI."""
    found = ({**e, "loc": ("body", *e["loc"])} for e in error.errors(include_url=False))
    return faults_of(found, body)


_OUT_OF_RANGE = (
    "greater_than", "greater_than_equal", "less_than", "less_than_equal",
    "too_short", "too_long", "string_too_short", "string_too_long",
)  # fmt: skip
_CODES = {
    "missing": "missing_field",
    "extra_forbidden": "unknown_field",
    "json_invalid": "malformed_json",
    "literal_error": "unknown_value",
    "enum": "unknown_value",
    "finite_number": "not_finite",
    **dict.fromkeys(_OUT_OF_RANGE, "value_out_of_range"),
    "too_many_fields": "too_many_fields",
    "naive_time": "naive_time",
    "invalid_time": "invalid_time",
}


def _sentence(error: Mapping[str, Any]) -> str:
    message = str(error["msg"])
    place, name = error["loc"][0], error["loc"][-1]
    if error["type"] == "json_invalid":
        return f"{error['ctx']['error']} at character {name}."
    if place in ("query", "header", "path"):
        return f"{place} parameter {name}: {message}."
    if error["type"] == "extra_forbidden":
        return f"There is no field {name!r}."
    return message if message.endswith(".") else f"{message}."


def _pointer(loc: Sequence[str | int], body: object) -> str | None:
    # A pydantic location also names branches of unions, which do not exist in the document.
    # Only the parts that lead somewhere in the body are kept, and the last one, which may be
    # a missing field.
    if loc[0] != "body":
        return None
    parts: list[str | int] = []
    here: object = body
    for number, part in enumerate(loc[1:], start=2):
        if isinstance(here, dict) and (part in here or number == len(loc)):
            here = here.get(part)
        elif isinstance(here, list) and isinstance(part, int) and part < len(here):
            here = here[part]
        else:
            continue
        parts.append(part)
    return pointer_to(*parts)
