"""The courier: a thread in each worker that sends due deliveries."""

from __future__ import annotations

import asyncio
import logging
import random
import ssl
import threading
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from functools import cached_property
from typing import Final, TypeVar

import httpcore
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from standardwebhooks.webhooks import Webhook

import planner_core
from service.db.failures import why_unavailable
from service.db.session import Database
from service.webhooks import outbox
from service.webhooks.addresses import AddressRefused, PublicOnly
from service.webhooks.outbox import Parcel

log = logging.getLogger(__name__)
T = TypeVar("T")

RETRY_AFTER_S: Final = (5.0, 300.0, 1800.0, 7200.0, 18000.0, 36000.0, 50400.0, 72000.0, 86400.0)
"""Waits between attempts, as proposed by Standard Webhooks; three days in total."""

_MOST_AT_ONCE: Final = 64
_MOST_OF_AN_OWNER: Final = 4
_ANSWER_WITHIN_S: Final = 20.0
_LONGEST_WAIT_S: Final = 86400.0
_STOP_WITHIN_S: Final = 5.0
_GONE: Final = 410
_SWEEP_EVERY_S: Final = 3600.0


class Courier:
    """Sends deliveries until told to stop.

    Parameters
    ----------
    look_every_s
        How often to look in the database for due deliveries.
    private
        Whether addresses in the service's own network are allowed.
    retry_after_s
        Waits between attempts; after the last one, a delivery has failed.
    """

    def __init__(
        self,
        database: Database,
        *,
        look_every_s: float,
        private: bool,
        retry_after_s: tuple[float, ...] = RETRY_AFTER_S,
    ):
        self._database = database
        self._look_every_s = look_every_s
        self._backend = httpcore.AnyIOBackend() if private else PublicOnly()
        self._retry_after_s = retry_after_s
        self._busy: dict[str, str] = {}
        self._stopping = threading.Event()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._work()), name="courier", daemon=True
        )

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End. Deliveries under way come due again, for any courier."""
        self._stopping.set()
        # The thread may be waiting for a hanging database; its work is no longer needed.
        self._thread.join(_STOP_WITHIN_S)

    async def _work(self) -> None:
        sending: set[asyncio.Task[None]] = set()
        next_sweep_s = 0.0
        while not self._stopping.is_set():
            room = _MOST_AT_ONCE - len(sending)
            for parcel in await self._take(room) if room else ():
                self._busy[parcel.webhook_id] = parcel.owner
                task = asyncio.create_task(self._deliver(parcel))
                sending.add(task)
                task.add_done_callback(sending.discard)
            if time.monotonic() >= next_sweep_s:
                next_sweep_s = time.monotonic() + _SWEEP_EVERY_S
                await self._in_database(outbox.sweep)
            await asyncio.sleep(self._look_every_s)
        for task in sending:
            task.cancel()
        await asyncio.gather(*sending, return_exceptions=True)

    async def _take(self, room: int) -> list[Parcel]:
        if not await asyncio.to_thread(self._is_any_due):
            return []
        busy = dict(self._busy)
        taken = await self._in_database(
            lambda s: outbox.take(s, busy=busy, limit=room, of_an_owner=_MOST_OF_AN_OWNER)
        )
        return taken or []

    def _is_any_due(self) -> bool:
        """Look without a transaction, since usually nothing is due and writers would wait."""
        try:
            with self._database.asking() as connection:
                return outbox.is_any_due(connection)
        except SQLAlchemyError:
            return True  # taking the deliveries will report the error

    async def _in_database(self, work: Callable[[Session], T]) -> T | None:
        """Run one transaction; None if the database cannot serve, for another try later."""
        try:
            return await asyncio.to_thread(self._transact, work)
        except SQLAlchemyError as error:
            # After any error, deliveries stay due, and the courier goes on.
            log.warning("webhooks wait: %s", why_unavailable(error) or error, exc_info=True)
            return None

    def _transact(self, work: Callable[[Session], T]) -> T:
        with self._database.transaction() as session:
            return work(session)

    async def _deliver(self, parcel: Parcel) -> None:
        try:
            status, headers = await self._post(parcel)
        except TimeoutError:
            why = f"There was no answer within {_ANSWER_WITHIN_S:.0f} s."
            await self._failed(parcel, why, None, {})
        except AddressRefused as error:
            await self._failed(parcel, str(error), None, {})
        # UnicodeError: an invalid host name.
        except (OSError, UnicodeError, httpcore.NetworkError, httpcore.ProtocolError) as error:
            await self._failed(parcel, f"{type(error).__name__}: {error}", None, {})
        else:
            if 200 <= status < 300:
                await self._in_database(lambda s: outbox.arrived(s, parcel, status))
            else:
                await self._failed(parcel, f"The receiver answered {status}.", status, headers)
        finally:
            self._busy.pop(parcel.webhook_id, None)

    async def _post(self, parcel: Parcel) -> tuple[int, dict[str, str]]:
        """Send one request, without following redirects or reading the answer's body."""
        now = datetime.now(UTC)
        signature = Webhook(parcel.secret).sign(parcel.id, now, parcel.payload)
        headers: dict[bytes | str, bytes | str] = {
            "Content-Type": "application/json",
            "User-Agent": f"Slewline/{planner_core.__version__}",
            "webhook-id": parcel.id,
            "webhook-timestamp": str(int(now.timestamp())),
            "webhook-signature": signature,
        }
        body = parcel.payload.encode()
        pool = httpcore.AsyncConnectionPool(
            ssl_context=self._tls, max_connections=1, network_backend=self._backend
        )
        async with (
            asyncio.timeout(_ANSWER_WITHIN_S),
            pool,
            pool.stream("POST", parcel.url, headers=headers, content=body) as answer,
        ):
            told = {k.decode("latin-1").lower(): v.decode("latin-1") for k, v in answer.headers}
            return answer.status, told

    @cached_property
    def _tls(self) -> ssl.SSLContext:
        return ssl.create_default_context()

    async def _failed(
        self, parcel: Parcel, why: str, status: int | None, headers: Mapping[str, str]
    ) -> None:
        log.warning(
            "a webhook was not delivered: %s",
            why,
            extra={"webhook_id": parcel.webhook_id, "delivery_id": parcel.id},
        )
        if status == _GONE:
            await self._in_database(lambda s: outbox.disable(s, parcel.webhook_id, why))
            return
        again_s = self._again_s(parcel.attempt, headers)
        await self._in_database(lambda s: outbox.failed(s, parcel, why, status, again_s=again_s))

    def _again_s(self, attempt: int, headers: Mapping[str, str]) -> float | None:
        if attempt > len(self._retry_after_s):
            return None
        # Random, so that a receiver that recovers does not get all deliveries at once.
        wait_s = self._retry_after_s[attempt - 1] * random.uniform(1.0, 1.2)
        return min(max(wait_s, retry_after_s(headers)), _LONGEST_WAIT_S * 1.2)


def retry_after_s(headers: Mapping[str, str]) -> float:
    """Return how long an answer asks to wait; 0 if it does not, or is unreadable.

    >>> retry_after_s({"retry-after": "120"}), retry_after_s({"retry-after": "soon"})
    (120.0, 0.0)
    """
    text = headers.get("retry-after", "")
    if text.isdecimal() and len(text) < 10:
        return float(text)
    try:
        return max(0.0, (parsedate_to_datetime(text) - datetime.now(UTC)).total_seconds())
    except (ValueError, TypeError):
        return 0.0
