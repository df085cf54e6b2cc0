"""The limits of a body, kept while it comes in: nothing has been read of what is too large."""

from __future__ import annotations

import asyncio
from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems.kinds import ServiceError

PART_WITHIN_S: Final = 20.0
"""Between two parts of a body."""
BODY_WITHIN_S: Final = 300.0
"""From the first part that is waited for to the last."""
MOST_VALUES: Final = 1_000_000
"""Objects and lists in one JSON body. An empty one is two bytes, and eighty once it is read."""
MOST_COMMAS: Final = 5_000_000
"""Between its values: a number takes two bytes, and thirty once it is read."""

_BEFORE_JSON: Final = b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n"
"""Marks of an encoding and space, in any of them."""


class BodyLimit:
    """Refuse bodies over the limit: at once where the length is declared, else on the way.

    Compressed ones are refused too: a small one may hold any amount.
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
            detail = f"Content-Encoding is {coding[:80]!a}; send the body as it is."
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
            # A file that tells its form itself may be JSON as well.
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
    """Waits for the parts of a body, not for ever; who has sent all may be silent."""

    def __init__(self, clock: asyncio.AbstractEventLoop):
        self._clock = clock
        self._left_s = BODY_WITHIN_S
        self._is_whole = False

    async def __call__(self, receive: Receive) -> Message:
        """Return the next message; 408 where it does not come."""
        if self._is_whole:
            return await receive()
        began_s = self._clock.time()
        try:
            async with asyncio.timeout(min(self._left_s, PART_WITHIN_S)):
                message = await receive()
        except TimeoutError:
            raise HTTPException(408, "The body did not come in time.") from None
        # Only waiting counts: what is done with a part in between is not the client's fault.
        self._left_s -= self._clock.time() - began_s
        self._is_whole = not message.get("more_body", False)
        return message
