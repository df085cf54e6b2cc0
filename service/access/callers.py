"""Callers, and what they may do."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

LOCAL_OWNER: Final = "local"
"""Owner of everything done without a key, which only a server on loopback allows."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


class Scope(StrEnum):
    """What a key permits. Each scope includes those before it."""

    READ = "read"
    SUBMIT = "submit"
    APPROVE = "approve"
    ADMIN = "admin"

    def includes(self, other: Scope) -> bool:
        """Return whether this scope permits all that the other one does.

        >>> Scope.SUBMIT.includes(Scope.READ), Scope.SUBMIT.includes(Scope.ADMIN)
        (True, False)
        """
        order = list(Scope)
        return order.index(self) >= order.index(other)


@dataclass(frozen=True, slots=True, kw_only=True)
class Caller:
    """The sender of a request.

    Attributes
    ----------
    owner
        The owner of its jobs; several keys may share an owner.
    key_id, key_name
        None without a key.
    """

    owner: str
    scope: Scope
    key_id: str | None = None
    key_name: str | None = None

    @property
    def visible_owner(self) -> str | None:
        """Return the owner whose jobs this caller sees, or None for all owners."""
        return None if self.scope is Scope.ADMIN else self.owner


LOCAL_CALLER: Final = Caller(owner=LOCAL_OWNER, scope=Scope.ADMIN)
NOBODY: Final = Caller(owner="nobody", scope=Scope.READ)
"""The caller of what is open to all, for which no key is required."""


def is_plain_name(text: str) -> bool:
    """Return whether a text can name a key or an owner.

    >>> is_plain_name("flight-ops"), is_plain_name("a:b"), is_plain_name("")
    (True, False, False)
    """
    return _NAME.fullmatch(text) is not None
