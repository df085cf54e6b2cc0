"""The span that is planned."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from planner_core.domain.checks import require


@dataclass(frozen=True, slots=True, kw_only=True)
class Horizon:
    """The span to plan, and the only converter between instants and seconds.

    Attributes
    ----------
    start, end
        Aware instants in UTC; ``start`` is before ``end``.
    """

    start: datetime
    end: datetime

    def __post_init__(self) -> None:
        require(self.start.tzinfo is not None, "start", "needs a time zone")
        require(self.end.tzinfo is not None, "end", "needs a time zone")
        require(self.end > self.start, "end", "must be later than start")

    @property
    def duration_s(self) -> float:
        """Length of the horizon in seconds."""
        return (self.end - self.start).total_seconds()

    def instant(self, offset_s: float) -> datetime:
        """Return the UTC instant that lies ``offset_s`` after the start, to the millisecond.

        >>> day = Horizon(
        ...     start=datetime(2026, 1, 1, tzinfo=UTC), end=datetime(2026, 1, 2, tzinfo=UTC)
        ... )
        >>> day.instant(90.0004).isoformat()
        '2026-01-01T00:01:30+00:00'
        """
        return self.start.astimezone(UTC) + timedelta(milliseconds=round(offset_s * 1000.0))

    def offset_s(self, instant: datetime) -> float:
        """Return the seconds from the start to ``instant``."""
        return (instant - self.start).total_seconds()
