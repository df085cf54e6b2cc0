"""Spacecraft types in the database, and bodies completed from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel
from sqlalchemy.orm import Session

from service.db.rows import SpacecraftRow
from service.problems.faults import refuse_one, validated
from service.stores.finding import find
from service.wire.spacecraft_types import BUILT_IN, filled, type_named_by

M = TypeVar("M", bound=BaseModel)


def figures_of(session: Session, spacecraft_id: str) -> Mapping[str, Any] | None:
    """Return agility, sensor and resources of a built-in or stored type; None if unknown."""
    if spacecraft_id in BUILT_IN:
        return BUILT_IN[spacecraft_id]
    row = find(session, SpacecraftRow, spacecraft_id)
    return None if row is None else row.body


def completed(
    session: Session, given: Mapping[str, Any], shape: type[M], *, names_type: bool = True
) -> M:
    """Return a body with all figures, taken from its type if it has none of its own.

    Parameters
    ----------
    given
        The body sent by a client.
    names_type
        Whether the result names its type.

    Raises
    ------
    ServiceError
        422 if there is no such type, or if figures do not fit together.
    """
    name = type_named_by(given)
    kind = figures_of(session, name)
    if kind is None:
        detail = f"There is no spacecraft type {name!r}."
        raise refuse_one("unknown_spacecraft", detail, "/spacecraft")
    return validated(shape, filled(given, kind) | ({"spacecraft": name} if names_type else {}))
