"""Common parts of imports: the answer's shape, and when a file is refused as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Annotated, Any, Final, TypeVar

from fastapi import Query

from planner_core.errors import Fault
from service.api.deps import ANY_FILE
from service.problems.faults import refuse
from service.wire.imports import Imported, RejectedRow

BYTES: Final[dict[str, Any]] = {
    "type": "string",
    "format": "binary",
    "description": "A file in any of these formats, recognised by its content.",
}
"""The schema of a file whose form is detected from its content."""

T = TypeVar("T")


class OnError(StrEnum):
    """What to do with the good records of a file that also has bad ones."""

    SKIP = "skip"
    REJECT_ALL = "reject_all"


OnErrorQuery = Annotated[
    OnError, Query(description="`skip` stores the good records; `reject_all` stores nothing (422).")
]


def refuse_if_asked(accepted: int, faults: Sequence[Fault], on_error: OnError) -> None:
    """Raise 422 if no record is good, or if any is bad and ``on_error`` is ``reject_all``."""
    if faults and (not accepted or on_error is OnError.REJECT_ALL):
        raise refuse(faults)


def imported(items: list[T], faults: Sequence[Fault]) -> Imported[T]:
    """Return the answer to an import."""
    return Imported(
        accepted=len(items),
        rejected=len(faults),
        items=items,
        errors=[RejectedRow(row=f.row, code=f.code, detail=_placed(f)) for f in faults],
    )


def _placed(fault: Fault) -> str:
    return (
        f"{fault.pointer}: {fault.detail}" if fault.row is None and fault.pointer else fault.detail
    )


def body_schemas(examples: Mapping[str, str]) -> dict[str, Any]:
    """Return OpenAPI's ``requestBody`` for files: media type to description."""
    # Client generators cannot distinguish a list from a file.
    schemas = {
        kind: {"type": "object" if kind.endswith("json") else "string", "description": text}
        for kind, text in examples.items()
    }
    return request_body(schemas | {ANY_FILE: BYTES})


def request_body(schemas: Mapping[str, Any]) -> dict[str, Any]:
    """Return OpenAPI's ``requestBody``, for ``openapi_extra=``: media type to schema."""
    content = {kind: {"schema": schema} for kind, schema in schemas.items()}
    return {"requestBody": {"required": True, "content": content}}
