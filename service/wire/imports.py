"""Answers to imports of files."""

from __future__ import annotations

from typing import Generic, TypeVar

from pydantic import Field

from service.wire.base import Wire

T = TypeVar("T")


class RejectedRow(Wire):
    """A record that was not stored, and why."""

    row: int | None = Field(description="Line of the file, from 1; null in JSON and XML.")
    code: str
    detail: str


class Imported(Wire, Generic[T]):
    """The records that an import stored, and those it did not."""

    accepted: int
    rejected: int
    items: tuple[T, ...]
    errors: tuple[RejectedRow, ...]
