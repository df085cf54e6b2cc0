"""Satellites' orbits as OMM and OEM files, which the import accepts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Response
from sqlalchemy.orm import Session

from planner_core.domain import OrbitEphemeris
from planner_core.orbits import omm_writing
from planner_core.orbits.omm_writing import Outgoing
from service.api.accept import require_offered
from service.api.conditional import NOT_MODIFIED, etag_of, readable, sent
from service.api.deps import Call, CallDep
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
_OFFERED: Final = "Element sets are"


_FORMS: Final = {
    "json": ("application/json", omm_writing.write_json),
    "csv": ("text/csv", omm_writing.write_csv),
    "xml": ("application/xml", omm_writing.write_xml),
    "kvn": ("text/plain", omm_writing.write_kvn),
}
_RESPONSES: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "The messages.",
        "content": {media_type: {} for media_type, _ in _FORMS.values()},
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

    `POST /v1/satellites/import` accepts the file under the media type of this answer.
    """
    require_offered(suffix, _FORMS, _OFFERED)
    with call.database.reading() as session:
        rows = session.scalars(alive(SatelliteRow).order_by(SatelliteRow.id))
        parts = rows.partitions(_AT_ONCE)
        messages = [message for part in parts for message in _messages(session, part)]
    return _answer(call, suffix, messages, "satellites")


@router.get(
    "/{satellite_id}/omm.{suffix}",
    response_class=Response,
    responses={**_RESPONSES, **problem_responses(404)},
)
def get_omm(satellite_id: str, suffix: Suffix, call: CallDep) -> Response:
    """Return the element set in force of one satellite."""
    with call.database.reading() as session:
        row = find_satellite(session, satellite_id)
        require_offered(suffix, _FORMS, _OFFERED)
        messages = _messages(session, [row])
    if not messages:
        detail = f"The orbit of {row.name!r} is an ephemeris, without elements: ask for oem.kvn."
        raise ServiceError("not_acceptable", detail)
    return _answer(call, suffix, messages, satellite_id)


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
    return _sent(call, text, "text/plain", f"{satellite_id}.oem.kvn")


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


def _answer(call: Call, suffix: str, messages: Sequence[Outgoing], name: str) -> Response:
    media_type, write = _FORMS[suffix]
    return _sent(call, write(messages), media_type, f"{name}.omm.{suffix}")


def _sent(call: Call, text: str, media_type: str, file_name: str) -> Response:
    headers = {"ETag": etag_of(text), "Content-Disposition": f'inline; filename="{file_name}"'}
    return sent(call.request, text, media_type, headers)
