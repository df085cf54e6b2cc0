"""Which names lead here, and whose pages may change anything.

Being on this machine, or in its network, is a credential that a browser lends to every page of
the internet: such a page posts to us, or has a name of its own lead to our address and is then
taken for one of ours. Browsers say which name was called and where a request comes from, and no
page can change what they say.
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

    Starlette's own check of hosts cannot read IPv6 addresses and answers no problem document.

    Parameters
    ----------
    hosts
        Names, without a port, that lead here; "*" for any.
    origins
        Other sites whose pages may call.
    """

    def __init__(self, hosts: Collection[str], origins: Collection[str]):
        self._hosts = hosts
        self._origins = origins

    def check(self, method: str, headers: Headers) -> None:
        """Raise 421 for a name that is not ours, and 403 for a foreign page that writes."""
        host = headers.get("host", "")
        if not self._is_ours(host):
            raise ServiceError(
                "misdirected_request",
                f"{host[:80]!a} is no name of this service (SLEWLINE_ALLOWED_HOSTS).",
            )
        if method not in READING and self._is_foreign(host, headers):
            raise ServiceError(
                "foreign_origin", "A page of another site may not change anything here."
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
    """Return host and port, without the port that goes without saying."""
    host = host.lower()
    for port in _USUAL_PORTS:
        host = host.removesuffix(port)
    return host
