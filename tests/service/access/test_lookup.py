"""One question for all who ask the same at a time; guesses hold up no key."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from service.access import lookup
from service.access.callers import Caller, Scope
from service.access.lookup import KeyLookup
from service.db.session import Database
from tests.patience import PATIENCE_S

CALLER = Caller(owner="owner", scope=Scope.READ, key_id="k1", key_name="laptop")


class Keys:
    """Keys that are looked up as slowly as a test wants."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.good = {"good"}
        self.let_go = threading.Event()

    def find(self, _database: Database, token: str) -> Caller | None:
        self.asked.append(token)
        assert self.let_go.wait(PATIENCE_S)
        if token == "broken":
            raise RuntimeError("no database")
        return CALLER if token in self.good else None


@pytest.fixture
def keys(monkeypatch: pytest.MonkeyPatch) -> Keys:
    keys = Keys()
    monkeypatch.setattr(lookup, "_find", keys.find)
    return keys


def run(work: Callable[[KeyLookup, Any], Coroutine[None, None, None]]) -> None:
    asyncio.run(asyncio.wait_for(work(KeyLookup(), None), PATIENCE_S))


async def asked(keys: Keys, number: int) -> None:
    while len(keys.asked) < number:
        await asyncio.sleep(0.001)


def test_those_who_carry_the_same_key_at_a_time_share_one_question(keys: Keys) -> None:
    async def work(key_lookup: KeyLookup, database: Any) -> None:
        many = [asyncio.ensure_future(key_lookup.find(database, "good")) for _ in range(500)]
        await asked(keys, 1)
        many[0].cancel()
        keys.let_go.set()
        answers = await asyncio.gather(*many, return_exceptions=True)
        assert isinstance(answers[0], asyncio.CancelledError)
        assert answers[1:] == [CALLER] * 499
        assert keys.asked == ["good"]
        # An answer is kept for nobody who comes later.
        keys.good.clear()
        assert await key_lookup.find(database, "good") is None
        assert keys.asked == ["good", "good"]

    run(work)


def test_any_number_of_guesses_leaves_threads_to_good_keys(keys: Keys) -> None:
    async def work(key_lookup: KeyLookup, database: Any) -> None:
        keys.let_go.set()
        assert await key_lookup.find(database, "good") == CALLER
        keys.let_go.clear()
        guesses = [
            asyncio.ensure_future(key_lookup.find(database, f"guess {number}"))
            for number in range(200)
        ]
        await asked(keys, 3)
        known = asyncio.ensure_future(key_lookup.find(database, "good"))
        await asked(keys, 4)
        assert keys.asked[3] == "good"
        keys.let_go.set()
        assert await known == CALLER
        assert await asyncio.gather(*guesses) == [None] * 200

    run(work)


def test_a_key_that_cannot_be_looked_up_is_looked_up_again(keys: Keys) -> None:
    async def work(key_lookup: KeyLookup, database: Any) -> None:
        keys.let_go.set()
        for _ in range(2):
            with pytest.raises(RuntimeError):
                await key_lookup.find(database, "broken")
        assert keys.asked == ["broken", "broken"]

    run(work)


def test_only_so_many_keys_are_remembered(keys: Keys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lookup, "_MOST_KNOWN", 2)
    keys.good |= {"a", "b", "c"}

    async def work(key_lookup: KeyLookup, database: Any) -> None:
        keys.let_go.set()
        for token in ("a", "b", "c", "a"):
            assert await key_lookup.find(database, token) == CALLER
        assert len(key_lookup._known) == 2

    run(work)
