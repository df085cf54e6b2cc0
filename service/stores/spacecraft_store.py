"""Spacecraft types in the database, and bodies filled up from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import sqlalchemy as sa
from pydantic import BaseModel, ValidationError
from sqlalchemy.orm import Session

from planner_core.errors import Fault
from service.db.rows import SpacecraftRow
from service.problems.faults import faults_of_validation, refuse
from service.wire.spacecraft_types import BUILT_IN, filled, type_named_by

M = TypeVar("M", bound=BaseModel)


def alive() -> sa.Select[SpacecraftRow]:
    """Return the query of all types that have not been deleted."""
    return sa.select(SpacecraftRow).where(SpacecraftRow.deleted_at.is_(None))


def find(session: Session, spacecraft_id: str, *, to_change: bool = False) -> SpacecraftRow | None:
    """Return a stored type, its row locked where it is to change."""
    row = session.get(SpacecraftRow, spacecraft_id, with_for_update=to_change)
    return None if row is None or row.deleted_at is not None else row


def figures_of(session: Session, spacecraft_id: str) -> Mapping[str, Any] | None:
    """Return agility, sensor and resources of a type, built in or stored; None for no type."""
    if spacecraft_id in BUILT_IN:
        return BUILT_IN[spacecraft_id]
    row = find(session, spacecraft_id)
    return None if row is None else row.body


def completed(
    session: Session, given: Mapping[str, Any], shape: type[M], *, names_type: bool = True
) -> M:
    """Return a body with all figures, those of its type where it has none of its own.

    Parameters
    ----------
    given
        What a client has sent.
    names_type
        Whether the whole says which type it is of.

    Raises
    ------
    ServiceError
        422 where there is no such type, or where figures do not go together.
    """
    name = type_named_by(given)
    kind = figures_of(session, name)
    if kind is None:
        fault = Fault(
            code="unknown_spacecraft",
            detail=f"There is no spacecraft type {name!r}.",
            pointer="/spacecraft",
        )
        raise refuse([fault])
    return validated(filled(given, kind) | ({"spacecraft": name} if names_type else {}), shape)


def validated(whole: Mapping[str, Any], shape: type[M]) -> M:
    """Return a body of this shape; 422 with every fault where it is none."""
    try:
        return shape.model_validate(whole)
    except ValidationError as error:
        raise refuse(faults_of_validation(error, whole)) from None
