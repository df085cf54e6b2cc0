"""How long a database may take, for whoever must not import one to know it."""

from __future__ import annotations

from typing import Final

DEFAULT_TIMEOUT_S: Final = 10.0
"""For a statement on PostgreSQL."""
