"""Satellites and their element sets in the database."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Final, Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from planner_core.domain import Orbit, OrbitEphemeris
from planner_core.orbits.ingest import Entry
from service.db.rows import ElementSetRow, SatelliteRow
from service.db.session import take_turns
from service.problems.kinds import ServiceError
from service.stores.finding import alive
from service.wire.satellites import WholeSatellite

FIGURES: Final = ("agility", "sensor", "resources", "spacecraft")
"""A satellite's capabilities, and its type."""
_TURNS: Final = "satellites"
_LONGEST_NAME: Final = 200

Status = Literal["created", "elements_added", "unchanged"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedEntry:
    """The result for one record of a file."""

    satellite: SatelliteRow
    status: Status
    entry: Entry


def add_satellite(
    session: Session, body: WholeSatellite, elements: Orbit, orbit: dict[str, Any]
) -> SatelliteRow:
    """Store a new satellite with its first element set, parsed and in its tidy form.

    Raises
    ------
    ServiceError
        ``duplicate_norad_cat_id`` if another satellite has this catalogue number.
    """
    _require_new(session, elements.norad_cat_id)
    figures = body.model_dump(mode="json", include=set(FIGURES))
    row = SatelliteRow(name=body.name, norad_cat_id=elements.norad_cat_id, **figures)
    session.add(row)
    session.flush()
    add_elements(session, row.id, elements.epoch, orbit)
    return row


def _require_new(session: Session, norad_cat_id: int) -> None:
    # Number 0 means unknown.
    if norad_cat_id == 0:
        return
    take_turns(session, _TURNS)
    rival = session.scalar(alive(SatelliteRow).where(SatelliteRow.norad_cat_id == norad_cat_id))
    if rival is not None:
        raise ServiceError(
            "duplicate_norad_cat_id",
            f"The satellite {rival.id!r} already has the catalogue number {norad_cat_id}. Send its "
            "new elements there, or import them.",
        )


def add_elements(
    session: Session, satellite_id: str, epoch: datetime, orbit: dict[str, Any]
) -> ElementSetRow:
    """Store an element set, or return the same one if it is stored already."""
    same_epoch = sa.select(ElementSetRow).where(
        ElementSetRow.satellite_id == satellite_id, ElementSetRow.epoch == epoch
    )
    for stored in session.scalars(same_epoch):
        if stored.orbit == orbit:
            return stored
    row = ElementSetRow(satellite_id=satellite_id, epoch=epoch, orbit=orbit)
    session.add(row)
    session.flush()
    return row


def in_force(session: Session, satellite_ids: Iterable[str]) -> dict[str, ElementSetRow]:
    """Return each satellite's newest element set; of two with one epoch, the last stored."""
    newest = (
        sa.func.row_number()
        .over(
            partition_by=ElementSetRow.satellite_id,
            order_by=(ElementSetRow.epoch.desc(), ElementSetRow.id.desc()),
        )
        .label("newest")
    )
    ranked = (
        sa.select(ElementSetRow, newest)
        .where(ElementSetRow.satellite_id.in_(list(satellite_ids)))
        .subquery()
    )
    row = aliased(ElementSetRow, ranked)
    rows = session.scalars(sa.select(row).where(ranked.c.newest == 1))
    return {row.satellite_id: row for row in rows}


def import_entries(
    session: Session, entries: Sequence[Entry], figures: Mapping[str, Any]
) -> list[ImportedEntry]:
    """Store the records of a file, without duplicating known satellites.

    A satellite with a stored catalogue number gets the element set, unless it has one of
    that epoch. Number 0 means unknown, so the name then counts too. New satellites get
    these ``FIGURES``.
    """
    take_turns(session, _TURNS)
    known, epochs = _known_satellites(session), _known_epochs(session)
    new_elements: list[ElementSetRow] = []
    results = []
    for entry in entries:
        elements = entry.elements
        name = (elements.name or f"NORAD {elements.norad_cat_id}")[:_LONGEST_NAME]
        key = _key(elements.norad_cat_id, name)
        if isinstance(elements, OrbitEphemeris):
            key = _only_one_named(known, name) or key
        status: Status = "elements_added"
        if key not in known:
            known[key] = SatelliteRow(name=name, norad_cat_id=elements.norad_cat_id, **figures)
            session.add(known[key])
            status = "created"
        satellite = known[key]
        own_epoch = satellite.id, _tick(elements.epoch)
        if own_epoch in epochs:
            status = "unchanged"
        else:
            epochs.add(own_epoch)
            new_elements.append(
                ElementSetRow(satellite_id=satellite.id, epoch=elements.epoch, orbit=entry.orbit)
            )
        results.append(ImportedEntry(satellite=satellite, status=status, entry=entry))
    session.flush()  # the rows below refer to those of new satellites
    session.add_all(new_elements)
    return results


def _only_one_named(
    known: Mapping[tuple[int, str], SatelliteRow], name: str
) -> tuple[int, str] | None:
    """Return the key of the only satellite with a name; None if there is none or several."""
    keys = [key for key, row in known.items() if row.name == name]
    return keys[0] if len(keys) == 1 else None


def _known_satellites(session: Session) -> dict[tuple[int, str], SatelliteRow]:
    # Oldest first, so that of several with the same number the newest remains.
    rows = session.scalars(alive(SatelliteRow).order_by(SatelliteRow.id))
    return {_key(row.norad_cat_id, row.name): row for row in rows}


def _known_epochs(session: Session) -> set[tuple[str, int]]:
    pairs = session.execute(sa.select(ElementSetRow.satellite_id, ElementSetRow.epoch))
    return {(satellite_id, _tick(epoch)) for satellite_id, epoch in pairs}


def _tick(epoch: datetime) -> int:
    # A TLE gives its epoch to 864 microseconds; an OMM made from it may be off by one.
    return round((epoch - datetime(2000, 1, 1, tzinfo=UTC)) / timedelta(microseconds=864))


def _key(norad_cat_id: int, name: str) -> tuple[int, str]:
    return norad_cat_id, name if norad_cat_id == 0 else ""
