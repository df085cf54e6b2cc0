"""Tokens: what a key looks like, what is stored of it, and what a log may show of it.

A token is ``slw_<id>_<secret>``. The prefix lets scanners recognise a leaked token, and the id
finds the key without the secret.
"""

from __future__ import annotations

import hashlib
import re
import secrets
from typing import Final

_PREFIX: Final = "slw"
_TOKEN = re.compile(rf"{_PREFIX}_([0-9a-f]{{12}})_[0-9a-f]{{48}}")
# Also a truncated or mistyped token, since most of its secret may be right.
_LOOKS_LIKE_ONE = re.compile(rf"({_PREFIX}_[0-9a-f]{{12}})_\w+")


def new_token() -> tuple[str, str]:
    """Return the id and the token of a new key, whose secret has 192 random bits."""
    key_id = secrets.token_hex(6)
    return key_id, f"{_PREFIX}_{key_id}_{secrets.token_hex(24)}"


def key_id_of(token: str) -> str | None:
    """Return the id in a token, or None if it is not one of our tokens.

    >>> key_id_of("slw_0123456789ab_" + 48 * "0"), key_id_of("hunter2")
    ('0123456789ab', None)
    """
    match = _TOKEN.fullmatch(token)
    return None if match is None else match[1]


def digest_of(token: str) -> str:
    """Return the digest that is stored of a token.

    A plain SHA-256 is enough: nobody can try 192 random bits. Slow and salted hashes protect
    passwords, which can be guessed.
    """
    return hashlib.sha256(token.encode()).hexdigest()


def masked(text: str) -> str:
    """Return the text with the secret of each token in it hidden.

    >>> masked("no slw_0123456789ab_" + 48 * "0" + " here")
    'no slw_0123456789ab_*** here'
    """
    return _LOOKS_LIKE_ONE.sub(r"\1_***", text)
