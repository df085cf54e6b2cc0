"""When a client had better ask again for something that is not done yet."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Final

from service.wire.jobs import ACTIVE

SOON_S: Final = 1
_LATEST_S: Final = 5
_SHARE: Final = 0.2


def seconds_until(state: str, created_at: datetime) -> int | None:
    """Return what ``Retry-After`` says of a job; None where it has ended.

    A job that has waited long will not start in this second: to ask after a fifth of what it has
    waited costs little time, and spares the service most calls of those who follow a long queue.

    >>> from datetime import timedelta
    >>> ago = [datetime.now(UTC) - timedelta(seconds=waited_s) for waited_s in (0, 16, 600)]
    >>> [seconds_until("queued", created_at) for created_at in ago]
    [1, 3, 5]
    >>> seconds_until("running", ago[2]), seconds_until("succeeded", ago[2])
    (1, None)
    """
    if state not in ACTIVE:
        return None
    if state != "queued":
        return SOON_S
    # The clock is the database's there and ours here: a second matters little.
    waited_s = (datetime.now(UTC) - created_at).total_seconds()
    return min(_LATEST_S, max(SOON_S, int(_SHARE * waited_s)))
