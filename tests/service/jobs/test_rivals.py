"""What many want at once and one can have, on each database."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import httpx

from tests.service.factories import satellite, tle


def test_of_many_who_take_a_catalogue_number_one_gets_it(client: httpx.Client) -> None:
    def take(_: int) -> int:
        return client.post("/v1/satellites", json=satellite(tle=tle())).status_code

    with ThreadPoolExecutor(8) as threads:
        statuses = sorted(threads.map(take, range(16)))
    assert statuses == [201] + [409] * 15
