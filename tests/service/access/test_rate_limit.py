"""Requests are counted per key, or per address if there is no key."""

from __future__ import annotations

import pytest

from service.access import rate_limit
from service.access.rate_limit import RateLimiter
from service.settings import Settings
from tests.service.access.conftest import MakeDoor
from tests.service.problems import assert_problem

SLOWLY = {"rate_limit_per_s": 0.001, "rate_limit_burst": 3}


class Clock:
    """A clock that is set by hand."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_bucket_holds_a_burst_and_fills_at_its_rate() -> None:
    clock = Clock()
    limiter = RateLimiter(per_s=2.0, burst=3, clock=clock)
    assert [limiter.take("a") for _ in range(4)] == [0.0, 0.0, 0.0, 0.5]
    assert limiter.take("b") == 0.0
    clock.now_s += 0.25
    assert limiter.take("a") == 0.25
    clock.now_s += 0.25
    assert [limiter.take("a"), limiter.take("a")] == [0.0, 0.5]
    clock.now_s += 1000.0
    assert [limiter.take("a") for _ in range(4)] == [0.0, 0.0, 0.0, 0.5]


def test_the_number_of_buckets_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rate_limit, "MOST_CALLERS", 2)
    limiter = RateLimiter(per_s=1.0, burst=1, clock=Clock())
    for caller in ("a", "b", "a", "c"):
        limiter.take(caller)
    assert limiter.take("a") > 0.0
    assert limiter.take("b") == 0.0


def test_too_many_requests_are_refused_key_by_key(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, **SLOWLY) as door:
        first, second = door.key("read"), door.key("read")
        for _ in range(3):
            assert door.client.get("/v1/jobs", headers=first).status_code == 200
        refused = door.client.get("/v1/jobs", headers=first)
        assert_problem(refused, 429, "rate_limited")
        assert 0 < int(refused.headers["retry-after"]) <= 1000
        assert door.client.get("/v1/jobs", headers=second).status_code == 200


def test_without_a_key_the_address_counts_and_wrong_keys_do_too(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, **SLOWLY) as door:
        good = door.key("read")
        door.client.get("/version")
        assert_problem(door.client.get("/v1/jobs"), 401, "authentication_required")
        wrong = {"X-API-Key": "hunter2"}
        assert_problem(door.client.get("/v1/jobs", headers=wrong), 401, "invalid_key")
        assert_problem(door.client.get("/v1/jobs", headers=wrong), 429, "rate_limited")
        assert_problem(door.client.get("/version"), 429, "rate_limited")
        assert door.client.get("/health/live").status_code == 200
        assert door.client.get("/v1/jobs", headers=good).status_code == 200


def test_the_limit_is_off_on_this_machine_and_on_beyond_it() -> None:
    assert Settings().requests_per_s == 0.0
    assert Settings(host="0.0.0.0").requests_per_s == 50.0
    assert Settings(host="0.0.0.0", rate_limit_per_s=0.0).requests_per_s == 0.0
    assert Settings(rate_limit_per_s=7.0).requests_per_s == 7.0
