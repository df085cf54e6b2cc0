"""Requests that share a query: each gets an answer no older than itself, and its own answer."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import pytest

from service.api.batched import BatchedQueries


@dataclass(slots=True)
class Source:
    """A changing value; a query of it can be delayed after it has read."""

    value: int = 0
    queries: list[list[str]] = field(default_factory=list)
    has_read: threading.Event = field(default_factory=threading.Event)
    may_go_on: threading.Event = field(default_factory=threading.Event)

    def ask(self, keys: Sequence[str]) -> Mapping[str, str]:
        self.queries.append(list(keys))
        value = self.value
        self.has_read.set()
        assert self.may_go_on.wait(30.0)
        if value < 0:
            raise OSError(f"no value {value}")
        return {key: f"{key}{value}" for key in keys if key != "absent"}

    async def until_read(self) -> None:
        assert await asyncio.to_thread(self.has_read.wait, 30.0)


@pytest.fixture
def source() -> Source:
    return Source()


def test_those_who_ask_while_a_query_runs_share_the_next_one(source: Source) -> None:
    source.may_go_on.set()

    async def ask() -> list[str | None]:
        together = BatchedQueries(source.ask)
        return await asyncio.gather(*map(together.get, ("b", "a", "b", "absent", "a")))

    assert asyncio.run(ask()) == ["b0", "a0", "b0", None, "a0"]
    assert source.queries == [["b"], ["a", "b", "absent"]]


def test_no_answer_is_older_than_its_question(source: Source) -> None:
    """A request during a query waits for the next one: the current one has already read."""

    async def ask() -> tuple[str | None, ...]:
        together = BatchedQueries(source.ask)
        first = asyncio.create_task(together.get("a"))
        await source.until_read()
        source.value = 1
        later = [asyncio.create_task(together.get(key)) for key in ("a", "b")]
        await asyncio.sleep(0)
        assert len(source.queries) == 1
        source.may_go_on.set()
        return await first, *[await one for one in later]

    assert asyncio.run(ask()) == ("a0", "a1", "b1")
    assert source.queries == [["a"], ["a", "b"]]


def test_an_error_is_told_to_all_who_asked_and_to_nobody_later(source: Source) -> None:
    source.may_go_on.set()

    async def ask() -> tuple[list[object], str | None]:
        together = BatchedQueries(source.ask)
        source.value = -1
        failed = await asyncio.gather(*map(together.get, "ab"), return_exceptions=True)
        source.value = 2
        return [str(each) for each in failed], await together.get("a")

    assert asyncio.run(ask()) == (["no value -1"] * 2, "a2")


def test_who_goes_away_takes_no_answer_along(source: Source) -> None:
    async def ask() -> str | None:
        together = BatchedQueries(source.ask)
        leaving, staying = (asyncio.create_task(together.get(key)) for key in "ab")
        await source.until_read()
        leaving.cancel()
        source.may_go_on.set()
        answer = await staying
        assert leaving.cancelled()
        return answer

    assert asyncio.run(ask()) == "b0"


def test_any_number_of_keys_is_asked_for_in_queries_that_have_room(source: Source) -> None:
    source.may_go_on.set()
    keys = [f"k{number}-" for number in range(1_234)]

    async def ask() -> list[str | None]:
        together = BatchedQueries(source.ask)
        return await asyncio.gather(*map(together.get, keys))

    assert asyncio.run(ask()) == [f"{key}0" for key in keys]
    assert max(map(len, source.queries)) <= 500
    assert sorted(key for query in source.queries for key in query) == sorted(keys)


def test_what_nobody_should_wait_for_is_asked_without_a_pause(source: Source) -> None:
    source.may_go_on.set()

    async def not_before_s(together: BatchedQueries[str, str]) -> float:
        await asyncio.gather(*(together.get(f"k{number}-") for number in range(50)))
        return together._not_before_s - asyncio.get_running_loop().time()

    assert asyncio.run(not_before_s(BatchedQueries(source.ask, longest_pause_s=0.0))) <= 0.0
    assert asyncio.run(not_before_s(BatchedQueries(source.ask, longest_pause_s=9e9))) > 0.0
