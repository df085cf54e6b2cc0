"""Clients of real services: one as ``slewline serve`` runs it, and one with a queue only."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from service.client import Client
from tests.service.client.trouble import Proxy, proxy_before
from tests.service.conftest import Service
from tests.service.jobs.conftest import client as queue_http
from tests.service.jobs.conftest import jobs, template_url, workers
from tests.service.serving import serving

__all__ = ["jobs", "queue_http", "template_url", "workers"]


@pytest.fixture(scope="package")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a whole service with workers, for all tests."""
    with serving(tmp_path_factory.mktemp("served"), "serve", "--workers", "1") as (_, line):
        yield line.split()[-1]


@pytest.fixture
def whole(served: str) -> Iterator[Client]:
    """A client of the whole service."""
    with Client(served) as client:
        yield client


@pytest.fixture
def stored(service: Service) -> Iterator[Client]:
    """A client of a service with an empty database, without a queue."""
    with Client(str(service.client.base_url)) as client:
        yield client


@pytest.fixture
def proxy(queue_http: httpx.Client) -> Iterator[Proxy]:
    """A proxy before the service with a queue, which has no workers unless a test starts one."""
    with proxy_before(str(queue_http.base_url).rstrip("/")) as proxy:
        yield proxy


@pytest.fixture
def patient(proxy: Proxy) -> Iterator[Client]:
    """A client that reaches the service with a queue through the proxy."""
    with Client(proxy.url, patience_s=20.0) as client:
        yield client


@pytest.fixture(autouse=True)
def _no_settings_of_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SLEWLINE_URL", "SLEWLINE_KEY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder for downloads."""
    place = tmp_path / "downloads"
    place.mkdir()
    return place
