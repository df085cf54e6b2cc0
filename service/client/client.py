"""The client: an address, a key, and the resources of the service."""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Iterator
from typing import Final, Self

import httpx

import planner_core
from service.client.comparisons import Comparisons
from service.client.forecasts import Forecasts
from service.client.ground_stations import GroundStations
from service.client.jobs import Jobs
from service.client.outages import Outages
from service.client.plans import Plans
from service.client.satellites import Satellites
from service.client.scenarios import Scenarios
from service.client.spacecraft import SpacecraftTypes
from service.client.target_catalogs import TargetCatalogs, Targets
from service.client.transport import Transport, held, path_of
from service.client.webhooks import Webhooks
from service.wire.operations import Ready, Version
from service.wire.operations import SolverOut as Solver

DEFAULT_URL: Final = "http://127.0.0.1:8000"
_KEY = re.compile(r"[\x21-\x7e]+")


class Client:
    """A client of one service. Threads may share it.

    Parameters
    ----------
    url, key
        The service's address and the API key; by default those in the environment variables
        ``SLEWLINE_URL`` and ``SLEWLINE_KEY``, or a service on this machine.
    timeout_s
        How long to wait for the next part of an answer.
    patience_s
        How long to resend a request that is lost, or that the service cannot take now.
    """

    def __init__(
        self,
        url: str | None = None,
        key: str | None = None,
        *,
        timeout_s: float = 60.0,
        patience_s: float = 60.0,
    ):
        address = _address(url or os.environ.get("SLEWLINE_URL") or DEFAULT_URL)
        secret = key if key is not None else os.environ.get("SLEWLINE_KEY")
        headers = {"User-Agent": f"slewline-client/{planner_core.__version__}"}
        if secret:
            headers["Authorization"] = f"Bearer {_sendable(secret)}"
        self._http = httpx.Client(
            base_url=address,
            headers=headers,
            timeout=timeout_s,
            trust_env=not _is_this_machine(address.host),  # a proxy cannot reach this machine
        )
        self._transport = Transport(self._http, patience_s=patience_s)
        self.satellites = Satellites(self._transport)
        self.ground_stations = GroundStations(self._transport)
        self.spacecraft = SpacecraftTypes(self._transport)
        self.outages = Outages(self._transport)
        self.target_catalogs = TargetCatalogs(self._transport)
        self.targets = Targets(self._transport)
        self.forecasts = Forecasts(self._transport)
        self.scenarios = Scenarios(self._transport)
        self.jobs = Jobs(self._transport)
        self.comparisons = Comparisons(self._transport)
        self.plans = Plans(self._transport, self.jobs)
        self.webhooks = Webhooks(self._transport)

    @property
    def url(self) -> str:
        """The service's address."""
        return self._transport.address

    def solvers(self) -> Iterator[Solver]:
        """Yield the service's solvers."""
        return self._transport.pages(path_of("solvers"), Solver)

    def solver(self, name: str) -> Solver:
        """Return one solver."""
        return self._transport.get(path_of("solvers", name), Solver)

    def version(self) -> Version:
        """Return the versions of what runs there."""
        return self._transport.get("/version", Version)

    def ready(self) -> Ready:
        """Return the service's readiness; a ``ServiceError`` at once if it is not ready."""
        return held(Ready, self._transport.request("GET", "/health/ready", patience_s=0.0))

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Client({self.url!r})"


def _address(url: str) -> httpx.URL:
    try:
        address = httpx.URL(url)
    except httpx.InvalidURL as error:
        raise ValueError(f"the service's URL cannot be read: {error}") from error
    if address.scheme not in ("http", "https") or not address.host:
        raise ValueError("the service's URL must begin with http:// or https://")
    return address


def _sendable(key: str) -> str:
    # httpx would quote the key in its error message.
    if not _KEY.fullmatch(key):
        raise ValueError("the API key contains invalid characters, perhaps a line break")
    return key


def _is_this_machine(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
