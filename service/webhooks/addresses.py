"""Where a webhook may lead: not into the service's own network.

Whoever can set an address here makes the service send requests from inside: to a cloud's
metadata, a database's port, or a neighbour without a password.
"""

from __future__ import annotations

import asyncio
import ipaddress
import socket
from collections.abc import Iterable
from typing import Final
from urllib.parse import urlsplit

import httpcore

from service.wire.webhooks import LONGEST_URL

Address = ipaddress.IPv4Address | ipaddress.IPv6Address

_TRY_OTHERS_AFTER_S: Final = 3.0
_THIS_MACHINE: Final = ("localhost", "localhost.localdomain", "ip6-localhost")
# Gateways of some networks turn these into IPv4 addresses: translation (RFC 6052, 8215),
# site-local (RFC 3879), IPv4-compatible (RFC 4291), IPv4-translated (RFC 2765).
_NOT_PUBLIC: Final = tuple(
    map(
        ipaddress.IPv6Network,
        ("64:ff9b::/96", "64:ff9b:1::/48", "fec0::/10", "::/96", "::ffff:0:0:0/96"),
    )
)


class AddressRefused(Exception):
    """The address is private, or not an address at all; the message says which."""


def is_public(address: Address) -> bool:
    """Return whether an address is on the public internet, however it is embedded.

    >>> [is_public(ipaddress.ip_address(a)) for a in ("9.9.9.9", "10.0.0.1", "::ffff:127.0.0.1")]
    [True, False, False]
    """
    if isinstance(address, ipaddress.IPv6Address):
        inner = address.ipv4_mapped or address.sixtofour
        if inner is not None:
            return is_public(inner)
        if any(address in network for network in _NOT_PUBLIC):
            return False
    return address.is_global and not address.is_multicast


def require_good_url(url: str, *, private: bool) -> None:
    """Refuse an address that can never be called, before any attempt.

    Parameters
    ----------
    private
        Whether addresses in the service's own network, and HTTP without TLS, are allowed.

    Raises
    ------
    AddressRefused
        Names are resolved only at each delivery, since their addresses may change.
    """
    try:
        parts = urlsplit(url)
        host, _ = parts.hostname, parts.port
    except ValueError as error:
        raise AddressRefused(f"{url!r} is not a URL: {error}.") from None
    if len(url) > LONGEST_URL or not url.isascii() or not url.isprintable() or " " in url:
        raise AddressRefused(
            f"A webhook's URL may have at most {LONGEST_URL} printable ASCII characters."
        )
    if parts.scheme not in ("https", "http") or not host:
        raise AddressRefused(f"{url!r} is not a URL such as https://ops.example/slewline.")
    if parts.username is not None or parts.fragment:
        raise AddressRefused("A webhook's URL may not have a user, password or fragment.")
    if private:
        return
    if parts.scheme != "https":
        raise AddressRefused("Webhooks may only go to https:// addresses.")
    if host in _THIS_MACHINE:
        raise AddressRefused(_refusal(host, host))
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return
    _require_public(host, [address])


def _require_public(host: str, addresses: Iterable[Address]) -> None:
    for address in addresses:
        if not is_public(address):
            raise AddressRefused(_refusal(host, str(address)))


def _refusal(host: str, address: str) -> str:
    leads = "is" if host == address else f"leads to {address}, which is"
    return f"{host} {leads} not on the public internet (SLEWLINE_WEBHOOK_PRIVATE_ADDRESSES)."


class PublicOnly(httpcore.AnyIOBackend):
    """Connects to public addresses only.

    The name is resolved once, here, and the connection is made to the address that was
    checked, so that the name cannot lead elsewhere in between.
    """

    async def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[httpcore.SOCKET_OPTION] | None = None,
    ) -> httpcore.AsyncNetworkStream:
        """Connect to the first address that answers; ``AddressRefused`` if any is private."""
        found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
        addresses = [ipaddress.ip_address(entry[4][0]) for entry in found]
        _require_public(host, addresses)
        *others, last = map(str, addresses)
        for address in others:
            try:
                return await super().connect_tcp(
                    address, port, _TRY_OTHERS_AFTER_S, local_address, socket_options
                )
            except (httpcore.ConnectError, httpcore.ConnectTimeout):
                continue
        return await super().connect_tcp(last, port, timeout, local_address, socket_options)
