"""The database's time limit, for modules that must not import the database."""

from __future__ import annotations

from typing import Final

DEFAULT_TIMEOUT_S: Final = 10.0
"""For a statement on PostgreSQL."""
