"""Texts in CSV files: spreadsheets execute them if they begin like a formula."""

from __future__ import annotations

import re
from typing import Final

# Excel also accepts the full-width forms of East Asian keyboards.
_RISKY: Final = re.compile(r"'*[=+\-@\t\r\uff1d\uff0b\uff0d\uff20]")


def guarded(text: str | None) -> str | None:
    """Return a text that no spreadsheet takes for a formula.

    >>> guarded("=1+1"), guarded("'=1"), guarded("T-1"), guarded(None)
    ("'=1+1", "''=1", 'T-1', None)
    """
    return f"'{text}" if text is not None and _RISKY.match(text) else text


def unguarded(cell: str) -> str:
    """Return the text that `guarded` was given.

    >>> [unguarded(guarded(text)) for text in ("=1", "'=1", "'tis", "T-1")]
    ['=1', "'=1", "'tis", 'T-1']
    """
    return cell[1:] if cell.startswith("'") and _RISKY.match(cell) else cell
