"""Host names of the service, and the sites whose pages may change anything.

A browser on this machine, or in its network, lends its access to every page of the internet: a
page can post to the service, or let its own host name point to our address and so pass for one of
our pages. Browsers send the host name that was called and the origin of a request, and no page can
change these.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from typing import Final

from starlette.datastructures import Headers

from service.problems.kinds import ServiceError

READING: Final = ("GET", "HEAD", "OPTIONS")
_FOREIGN: Final = ("cross-site", "same-site")
_ANY: Final = "*"
_USUAL_PORTS: Final = (":80", ":443")


class Sites:
    """The service's own site, and those that are allowed to call it from a browser.

    Starlette's own check of hosts cannot read IPv6 addresses and sends no problem document.

    Parameters
    ----------
    hosts
        Host names of the service, without a port; "*" for any.
    origins
        Other sites whose pages may call it.
    """

    def __init__(self, hosts: Collection[str], origins: Collection[str]):
        self._hosts = hosts
        self._origins = origins

    def check(self, method: str, headers: Headers) -> None:
        """Raise 421 for a host name that is not ours, and 403 for a foreign page that writes."""
        host = headers.get("host", "")
        if not self._is_ours(host):
            raise ServiceError(
                "misdirected_request",
                f"{host[:80]!a} is not a name of this service (SLEWLINE_ALLOWED_HOSTS).",
            )
        if method not in READING and self._is_foreign(host, headers):
            raise ServiceError(
                "foreign_origin", "A page from another site may not change anything here."
            )

    def _is_ours(self, host: str) -> bool:
        name = _name_of(host)
        return _ANY in self._hosts or name in self._hosts or _is_address(name)

    def _is_foreign(self, host: str, headers: Headers) -> bool:
        origin, site = headers.get("origin"), headers.get("sec-fetch-site")
        if origin in self._origins:
            return False
        if site in _FOREIGN:
            return True
        if origin is None or site == "same-origin":
            return False  # behind a proxy the browser may know us by another name
        return _site(origin.partition("://")[2]) != _site(host)


def _name_of(host: str) -> str:
    """Return a Host header without its port.

    >>> _name_of("Localhost:8000"), _name_of("[::1]:8000"), _name_of("ops.example.")
    ('localhost', '::1', 'ops.example')
    """
    name, _, port = host.lower().rpartition(":")
    if not name or not port.isdecimal():
        name = host.lower()
    return name.removeprefix("[").removesuffix("]").removesuffix(".")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _site(host: str) -> str:
    """Return host and port, without a default port."""
    host = host.lower()
    for port in _USUAL_PORTS:
        host = host.removesuffix(port)
    return host
