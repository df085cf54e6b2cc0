"""Headers that keep browsers from using an answer in ways it is not meant for."""

from __future__ import annotations

from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

SECURITY_HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
}
"""Set on every answer, unless it has its own, as a page with styles must."""

_RAW: Final = [(n.lower().encode(), v.encode()) for n, v in SECURITY_HEADERS.items()]
# Only the client that asked may cache it, and reuse it only while its ETag is valid.
_PRIVATE: Final = (b"cache-control", b"private, no-cache")
_PERSONAL: Final = "/v1/"


class SecurityHeaders:
    """Add the headers that an answer does not have yet."""

    def __init__(self, app: ASGIApp):
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = message.setdefault("headers", [])
                given = {name.lower() for name, _ in headers}
                headers.extend(pair for pair in _RAW if pair[0] not in given)
                if scope["path"].startswith(_PERSONAL) and _PRIVATE[0] not in given:
                    headers.append(_PRIVATE)
            await send(message)

        await self.app(scope, receive, send_with_headers)
