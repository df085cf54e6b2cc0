"""PostgreSQL: no call waits for ever, on whichever side it is that has gone silent.

A server that refuses or breaks connections says so. One that accepts them and never answers
does not (it is frozen, or its disk is), nor does a network that swallows packets.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Final

import psycopg
import sqlalchemy as sa
from psycopg.errors import _WaitTimeout

from service.db.timeouts import DEFAULT_TIMEOUT_S

CONNECT_WITHIN_S: Final = 5

_LATER_THAN_SERVER_S: Final = 2.0
_IDLE_IN_TRANSACTION_S: Final = 60
# TCP gives a peer up that sends nothing, not even acknowledgements, for about this long.
_SILENCE_S: Final = 15


def make_postgresql_engine(
    url: str, timeout_s: float | None = DEFAULT_TIMEOUT_S, **options: Any
) -> sa.Engine:
    """Return an engine whose calls end: with an answer, or with an ``OperationalError``.

    Parameters
    ----------
    url
        SQLAlchemy URL. What its query says of connections goes before what is set here.
    timeout_s
        How long a statement may take; the server ends it then, and a little later we no longer
        wait. None for as long as it takes.
    options
        More for ``sa.create_engine``.
    """
    address = sa.make_url(url)
    engine = sa.create_engine(url, **{"pool_pre_ping": True, **options})

    def connect(
        _dialect: object, _record: object, arguments: list[Any], parameters: dict[str, Any]
    ) -> psycopg.Connection[Any]:
        own = parameters.get("options", "")
        told = {"options": f"{_session(timeout_s)} {own}".strip()}
        given = {"connect_timeout": CONNECT_WITHIN_S, **_SILENCE, **parameters, **told}
        connection = _PatientOnlySoLong.connect(*arguments, **given)
        connection.answer_within_s = None if timeout_s is None else timeout_s + _LATER_THAN_SERVER_S
        return connection

    if address.get_driver_name() == "psycopg":
        sa.event.listen(engine, "do_connect", connect)
    return engine


_SILENCE: Final = {
    "keepalives_idle": _SILENCE_S // 3,
    "keepalives_interval": _SILENCE_S // 3,
    "keepalives_count": 2,
    "tcp_user_timeout": _SILENCE_S * 1000,
}


def _session(timeout_s: float | None) -> str:
    """Return what the server is told: to notice as well when we have gone, and free our locks."""
    settings = {f"tcp_{name.removeprefix('tcp_')}": value for name, value in _SILENCE.items()}
    if timeout_s is not None:
        settings["statement_timeout"] = round(timeout_s * 1000)
        settings["idle_in_transaction_session_timeout"] = _IDLE_IN_TRANSACTION_S * 1000
    return " ".join(f"-c {name}={value}" for name, value in settings.items())


class _PatientOnlySoLong(psycopg.Connection[Any]):
    """A connection that is given up when the server does not answer.

    Neither the server's own time limits nor TCP notice a server that is frozen: its kernel goes
    on acknowledging what arrives.
    """

    answer_within_s: float | None = None
    _is_listening = False

    def wait(self, gen: Any, interval: float = 0.1, timeout: float | None = None) -> Any:
        """Wait for the server, but not for ever."""
        if timeout is not None or self.answer_within_s is None or self._is_listening:
            return super().wait(gen, interval, timeout)
        try:
            return super().wait(gen, interval, self.answer_within_s)
        except _WaitTimeout:
            # What it may yet say would be taken for the answer to the next question.
            self.pgconn.finish()
            raise psycopg.OperationalError(
                f"the server has not answered for {self.answer_within_s:g} s"
            ) from None

    def notifies(
        self, *, timeout: float | None = None, stop_after: int | None = None
    ) -> Generator[psycopg.Notify]:
        """Yield notifications; between them there may well be silence."""
        self._is_listening = True
        try:
            yield from super().notifies(timeout=timeout, stop_after=stop_after)
        finally:
            self._is_listening = False
