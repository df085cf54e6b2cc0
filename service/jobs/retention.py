"""Deleting old data, a little at a time."""

from __future__ import annotations

import time
from typing import Final

from service.db import clock
from service.db.session import Database
from service.stores import deletion

_DAY_S: Final = 86_400.0
_PAUSE_S: Final = 60.0
"""Pause after a look at the database that found nothing old enough."""


class Retention:
    """Deletes jobs, comparisons and scenarios of one database when they are old enough."""

    def __init__(self, database: Database, days: float | None):
        self._database = database
        self._days = days
        self._next_s = 0.0

    def run(self) -> None:
        """Delete some, if it is time to look again."""
        if self._days is None or time.monotonic() < self._next_s:
            return
        with self._database.transaction() as session:
            before = clock.now(session, -self._days * _DAY_S)
            num_deleted = deletion.sweep(session, before)
        if num_deleted == 0:
            self._next_s = time.monotonic() + _PAUSE_S
