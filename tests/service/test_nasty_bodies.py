"""Whatever is sent, the answer is a problem document, and the server's memory stays limited."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import httpx
import psutil
import pytest

from tests.fuzz.nasty import JSON, NASTIES
from tests.fuzz.odd_values import ODD_FILES
from tests.service.factories import post, satellite
from tests.service.problems import assert_problem
from tests.service.serving import serving

SIZE: Final = 200_000
IMPORTS: Final = ("/v1/satellites/import", "/v1/ground-stations/import", "/v1/target-catalogs")
SHAPED: Final = (
    "/v1/satellites",
    "/v1/ground-stations",
    "/v1/scenarios",
    "/v1/jobs",
    "/v1/comparisons",
    "/v1/webhooks",
)
MEGABYTE: Final = 1_000_000


def send(
    client: httpx.Client, path: str, data: bytes | Iterator[bytes], kind: str, **headers: str
) -> httpx.Response:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return client.post(path, content=data, headers={"Content-Type": kind} | named)


@pytest.mark.parametrize("path", IMPORTS)
def test_a_nasty_file_is_imported_or_refused(client: httpx.Client, path: str) -> None:
    files = [(kinds, data) for _, kinds, data in ODD_FILES]
    files += [(file.kinds, file.make(SIZE)) for file in NASTIES]
    for kinds, data in files:
        for kind in kinds:
            answer = send(client, path, data, kind)
            assert answer.is_success or 400 <= answer.status_code < 500, (kind, data[:200])


@pytest.mark.parametrize("path", SHAPED)
def test_a_nasty_body_is_refused(client: httpx.Client, path: str) -> None:
    bodies = [data for _, kinds, data in ODD_FILES if JSON in kinds]
    bodies += [file.make(SIZE) for file in NASTIES if JSON in file.kinds]
    for data in bodies:
        answer = send(client, path, data, JSON)
        assert_problem(answer, 422, answer.json()["code"])


@pytest.mark.parametrize("call", ["opportunities", "orders"])
@pytest.mark.parametrize("size", [10_000, SIZE])
def test_a_nasty_body_never_reaches_the_library_of_stapi(
    client: httpx.Client, call: str, size: int
) -> None:
    post(client, "/v1/satellites", satellite())
    bodies = [data for _, kinds, data in ODD_FILES if JSON in kinds]
    bodies += [file.make(size) for file in NASTIES if JSON in file.kinds]
    known = b'{"datetime":"2026-11-23T00:00:00Z/2026-11-24T00:00:00Z","geometry":%s,"filter":%s}'
    point, deep = b'{"type":"Point","coordinates":[8,47]}', b'{"op":"not","args":[' * 400
    bodies += [known % (b"{}", b"{}"), known % (point, deep + b"1" + b"]}" * 400)]
    with httpx.Client(base_url=client.base_url, timeout=60) as plain:
        for data in bodies:
            answer = send(plain, f"/stapi/products/paper/{call}", data, JSON)
            assert_problem(answer, answer.status_code, answer.json()["code"])
            assert answer.status_code in (400, 413, 422), (answer.status_code, data[:200])


@pytest.mark.parametrize("path", [*IMPORTS, *SHAPED])
def test_a_compressed_body_is_refused_unread(client: httpx.Client, path: str) -> None:
    answer = send(client, path, b"\x1f\x8b", JSON, Content_Encoding="gzip")
    assert_problem(answer, 415, "unsupported_media_type")
    assert answer.headers["accept-encoding"] == "identity"


def test_more_values_than_memory_is_meant_for_are_refused_on_the_way(client: httpx.Client) -> None:
    for path in (*IMPORTS[:1], *IMPORTS[2:], *SHAPED):
        answer = send(client, path, b"[" + b"[]," * MEGABYTE + b"[]]", JSON)
        assert_problem(answer, 413, "body_too_large")


@pytest.mark.parametrize(
    "paths",
    [
        (IMPORTS[0], SHAPED[0]),
        pytest.param((*IMPORTS[1:], *SHAPED[1:]), marks=pytest.mark.full_size),
    ],
    ids=["one of each", "the others"],
)
def test_a_body_over_the_limit_takes_no_memory(tmp_path: Path, paths: tuple[str, ...]) -> None:
    with (
        serving(tmp_path, "api") as (process, line),
        httpx.Client(base_url=line.split()[-1], timeout=60, trust_env=False) as client,
    ):
        for path in paths:
            assert send(client, path, b"[]", JSON).status_code == 422
        most = psutil.Process(process.pid).memory_info().vms + 80 * MEGABYTE
        resource.prlimit(process.pid, resource.RLIMIT_AS, (most, most))
        for path in paths:
            endless = (b" " * MEGABYTE for _ in range(100))
            assert_problem(send(client, path, b" " * 100 * MEGABYTE, JSON), 413, "body_too_large")
            assert_problem(send(client, path, endless, JSON), 413, "body_too_large")
