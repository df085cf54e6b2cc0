"""Limits of request bodies, enforced while they arrive, before anything parses them."""

from __future__ import annotations

import asyncio
from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems.kinds import ServiceError

PART_WITHIN_S: Final = 20.0
"""Longest wait for a part of a body."""
BODY_WITHIN_S: Final = 300.0
"""Longest wait for all parts of a body together."""
MOST_VALUES: Final = 1_000_000
"""Most objects and lists in a JSON body. An empty one takes two bytes, and eighty when parsed."""
MOST_COMMAS: Final = 5_000_000
"""Most commas between the values in it: a number takes two bytes, and thirty when parsed."""

_BEFORE_JSON: Final = b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n"
"""Byte-order marks and white space, in any encoding."""


class BodyLimit:
    """Refuse bodies over the limit: at once if the length is declared, else while they arrive.

    Compressed ones are refused too: a small one may expand to any size.
    """

    def __init__(self, app: ASGIApp, max_bytes: int):
        self.app = app
        self.max_bytes = max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        coding = headers.get("content-encoding", "identity").strip().lower()
        if coding not in ("", "identity"):
            detail = f"Content-Encoding is {coding[:80]!a}; send the body unencoded."
            accepted = {"Accept-Encoding": "identity"}
            raise ServiceError("unsupported_media_type", detail, headers=accepted)
        declared = headers.get("content-length", "")
        if declared.isdigit() and int(declared) > self.max_bytes:
            raise HTTPException(413, self._too_many_bytes())
        is_json = "json" in headers.get("content-type", "").lower()
        opening = b""
        num_bytes = num_values = num_commas = 0
        in_time = _InTime(asyncio.get_running_loop())

        async def receive_within_limit() -> Message:
            nonlocal num_bytes, num_values, num_commas, opening
            message = await in_time(receive)
            part = message.get("body", b"")
            num_bytes += len(part)
            if num_bytes > self.max_bytes:
                raise HTTPException(413, self._too_many_bytes())
            # A file whose form is detected from its content may be JSON as well.
            opening = opening or part.lstrip(_BEFORE_JSON)[:1]
            num_values += part.count(b"[") + part.count(b"{")
            num_commas += part.count(b",")
            if is_json or opening in (b"[", b"{"):
                if num_values > MOST_VALUES:
                    detail = f"The body has more than {MOST_VALUES} objects and lists."
                    raise HTTPException(413, detail)
                if num_commas > MOST_COMMAS:
                    raise HTTPException(413, f"The body has more than {MOST_COMMAS} values.")
            return message

        await self.app(scope, receive_within_limit, send)

    def _too_many_bytes(self) -> str:
        return f"The body is larger than {self.max_bytes} bytes."


class _InTime:
    """Waits for the parts of a body for a limited time, and without limit after the last."""

    def __init__(self, clock: asyncio.AbstractEventLoop):
        self._clock = clock
        self._left_s = BODY_WITHIN_S
        self._is_whole = False

    async def __call__(self, receive: Receive) -> Message:
        """Return the next message; 408 if it does not come in time."""
        if self._is_whole:
            return await receive()
        began_s = self._clock.time()
        try:
            async with asyncio.timeout(min(self._left_s, PART_WITHIN_S)):
                message = await receive()
        except TimeoutError:
            raise HTTPException(408, "The body did not arrive in time.") from None
        # Only waiting counts, not the time that the service takes to process a part.
        self._left_s -= self._clock.time() - began_s
        self._is_whole = not message.get("more_body", False)
        return message
