"""Satellites' orbits as Orbit Mean-Elements Messages: files that the import takes back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Request, Response
from sqlalchemy.orm import Session

from planner_core.domain import OrbitEphemeris
from planner_core.orbits import omm_writing
from planner_core.orbits.omm_writing import Outgoing
from service.api.accept import require_offered
from service.api.conditional import NOT_MODIFIED, etag_of, readable, sent
from service.api.deps import CallDep
from service.api.errors import problem_responses
from service.api.satellites import find_satellite
from service.db.rows import SatelliteRow
from service.problems.kinds import ServiceError
from service.scenarios.translate import orbit_from
from service.stores import satellite_store as store
from service.stores.finding import alive
from service.wire.satellites import OrbitIn

router = APIRouter(prefix="/v1/satellites", tags=["satellites"])

_AT_ONCE: Final = 500


@dataclass(frozen=True, slots=True)
class _Form:
    media_type: str
    write: Callable[[Sequence[Outgoing]], str]


_FORMS: Final = {
    "json": _Form("application/json", omm_writing.write_json),
    "csv": _Form("text/csv", omm_writing.write_csv),
    "xml": _Form("application/xml", omm_writing.write_xml),
    "kvn": _Form("text/plain", omm_writing.write_kvn),
}
_RESPONSES: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "The messages.",
        "content": {form.media_type: {} for form in _FORMS.values()},
    },
    **NOT_MODIFIED,
    **problem_responses(406),
}

Suffix = Annotated[
    str, Path(description=f"Form of the file: {', '.join(_FORMS)}.", examples=list(_FORMS))
]


@router.get("/omm.{suffix}", response_class=Response, responses=_RESPONSES)
def get_all_omm(suffix: Suffix, call: CallDep) -> Response:
    """Return the element set in force of every satellite, oldest satellite first.

    Satellites whose orbit is an ephemeris are left out.

    `POST /v1/satellites/import` takes the file back, with the media type that it comes in.
    """
    form = _form_of(suffix)
    with call.database.reading() as session:
        rows = session.scalars(alive(SatelliteRow).order_by(SatelliteRow.id)).all()
        messages = [
            message
            for first in range(0, len(rows), _AT_ONCE)
            for message in _messages(session, rows[first : first + _AT_ONCE])
        ]
    return _answer(call.request, form, messages, f"satellites.omm.{suffix}")


@router.get(
    "/{satellite_id}/omm.{suffix}",
    response_class=Response,
    responses={**_RESPONSES, **problem_responses(404)},
)
def get_omm(satellite_id: str, suffix: Suffix, call: CallDep) -> Response:
    """Return the element set in force of one satellite."""
    with call.database.reading() as session:
        row = find_satellite(session, satellite_id)
        form = _form_of(suffix)
        messages = _messages(session, [row])
    if not messages:
        detail = f"The orbit of {row.name!r} is an ephemeris, without elements: ask for oem.kvn."
        raise ServiceError("not_acceptable", detail)
    return _answer(call.request, form, messages, f"{satellite_id}.omm.{suffix}")


@router.get(
    "/{satellite_id}/oem.kvn",
    response_class=Response,
    responses={
        200: {"description": "The message.", "content": {"text/plain": {}}},
        **readable(406),
    },
)
def get_oem(satellite_id: str, call: CallDep) -> Response:
    """Return the ephemeris in force of one satellite, as an Orbit Ephemeris Message."""
    with call.database.reading() as session:
        row = find_satellite(session, satellite_id)
        orbit = store.in_force(session, [row.id])[row.id].orbit
    if "oem" not in orbit:
        raise ServiceError(
            "not_acceptable", f"The orbit of {row.name!r} is an element set: ask for omm.json."
        )
    text = "\n".join([*orbit["oem"], ""])
    return _sent(call.request, text, "text/plain", f"{satellite_id}.oem.kvn")


def _form_of(suffix: str) -> _Form:
    require_offered(suffix, _FORMS, "Element sets are")
    return _FORMS[suffix]


def _messages(session: Session, rows: Sequence[SatelliteRow]) -> list[Outgoing]:
    in_force = store.in_force(session, [row.id for row in rows])
    messages = []
    for row in rows:
        stored = in_force[row.id]
        elements = orbit_from(OrbitIn(**stored.orbit)).elements
        if isinstance(elements, OrbitEphemeris):
            continue  # states over time have no mean elements
        # A TLE has no name of its own.
        named = replace(elements, name=elements.name or row.name)
        messages.append(Outgoing(elements=named, created_at=stored.created_at))
    return messages


def _answer(
    request: Request, form: _Form, messages: Sequence[Outgoing], file_name: str
) -> Response:
    return _sent(request, form.write(messages), form.media_type, file_name)


def _sent(request: Request, text: str, media_type: str, file_name: str) -> Response:
    headers = {
        "ETag": etag_of(text),
        "Content-Disposition": f'inline; filename="{file_name}"',
    }
    return sent(request, text, media_type, headers)
