"""Keys from the environment, for containers that are set up without a command line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from service.access.callers import Caller, Scope, is_plain_name
from service.access.tokens import digest_of

SHORTEST_TOKEN: Final = 32
_TOKEN = re.compile(r"[A-Za-z0-9._~+/=-]+")


@dataclass(frozen=True, slots=True)
class StaticKeys:
    """The keys in the setting; only digests of their tokens are kept."""

    by_digest: dict[str, Caller]

    @classmethod
    def parse(cls, text: str) -> StaticKeys:
        """Return the keys of ``name:scope:token,...``; each name is also the owner.

        Raises
        ------
        ValueError
            With the number of the wrong entry, but never its token.
        """
        entries = [entry.strip() for entry in text.split(",") if entry.strip()]
        found = [_parse(entry, number) for number, entry in enumerate(entries, start=1)]
        if len(dict(found)) < len(found):
            raise ValueError("two entries have the same token")
        return cls(dict(found))

    def find(self, token: str) -> Caller | None:
        """Return the caller with this token."""
        # The time of a lookup by digest reveals nothing about the token.
        return self.by_digest.get(digest_of(token))

    def __bool__(self) -> bool:
        return bool(self.by_digest)


def _parse(entry: str, number: int) -> tuple[str, Caller]:
    name, scope, token = ([*entry.split(":", 2), "", ""])[:3]
    if not is_plain_name(name) or scope not in set(Scope):
        raise ValueError(
            f"entry {number} must be name:scope:token, with a scope of {', '.join(Scope)}"
        )
    if len(token) < SHORTEST_TOKEN or not _TOKEN.fullmatch(token):
        raise ValueError(
            f"entry {number} needs a token of {SHORTEST_TOKEN} or more letters, digits and ._~+/=-"
        )
    caller = Caller(owner=name, scope=Scope(scope), key_id=f"env:{name}:{scope}", key_name=name)
    return digest_of(token), caller
