"""PostgreSQL: no call waits for ever, whichever side has gone silent.

A server that refuses or breaks connections reports it. A server that accepts them and never
answers (it or its disk is frozen) does not, nor does a network that drops packets.
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
# TCP gives up on a peer that sends nothing, not even acknowledgements, for about this long.
_SILENCE_S: Final = 15


def make_postgresql_engine(
    url: str, timeout_s: float | None = DEFAULT_TIMEOUT_S, **options: Any
) -> sa.Engine:
    """Return an engine whose calls always end, with an answer or an ``OperationalError``.

    Parameters
    ----------
    url
        SQLAlchemy URL. Connection options in its query override those set here.
    timeout_s
        Time limit of a statement, enforced by the server; the client stops waiting a little
        later. None for no limit.
    options
        Further options for ``sa.create_engine``.
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
    """Return options that make the server, too, notice a lost client and free its locks."""
    settings = {f"tcp_{name.removeprefix('tcp_')}": value for name, value in _SILENCE.items()}
    if timeout_s is not None:
        settings["statement_timeout"] = round(timeout_s * 1000)
        settings["idle_in_transaction_session_timeout"] = _IDLE_IN_TRANSACTION_S * 1000
    return " ".join(f"-c {name}={value}" for name, value in settings.items())


class _PatientOnlySoLong(psycopg.Connection[Any]):
    """A connection that is given up if the server does not answer.

    Neither the server's own time limits nor TCP notice a frozen server: its kernel keeps
    acknowledging what arrives.
    """

    answer_within_s: float | None = None
    _is_listening = False

    def wait(self, gen: Any, interval: float = 0.1, timeout: float | None = None) -> Any:
        """Wait for the server, up to the time limit."""
        if timeout is not None or self.answer_within_s is None or self._is_listening:
            return super().wait(gen, interval, timeout)
        try:
            return super().wait(gen, interval, self.answer_within_s)
        except _WaitTimeout:
            # A late answer would be taken for the answer to the next query.
            self.pgconn.finish()
            raise psycopg.OperationalError(
                f"the server has not answered for {self.answer_within_s:g} s"
            ) from None

    def notifies(
        self, *, timeout: float | None = None, stop_after: int | None = None
    ) -> Generator[psycopg.Notify]:
        """Yield notifications; long silence between them is normal."""
        self._is_listening = True
        try:
            yield from super().notifies(timeout=timeout, stop_after=stop_after)
        finally:
            self._is_listening = False
