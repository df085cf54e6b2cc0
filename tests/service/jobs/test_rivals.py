"""Things that many clients want at once and only one can have, on each database."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import httpx

from tests.service.factories import satellite, tle


def test_of_many_who_take_a_catalogue_number_one_gets_it(client: httpx.Client) -> None:
    def take(number: int) -> int:
        return client.post("/v1/satellites", json=satellite(tle=tle(number))).status_code

    numbers = range(90_001, 90_021)
    with ThreadPoolExecutor(8) as threads:
        statuses = list(threads.map(take, [number for number in numbers for _ in range(8)]))
    assert Counter(statuses) == {201: len(numbers), 409: 7 * len(numbers)}
