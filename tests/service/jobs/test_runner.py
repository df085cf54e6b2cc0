"""A solver runs in a process of its own, within its limits, and always ends."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from planner_core.budget import Progress
from service.jobs import grace
from service.jobs import runner as runner_module
from service.jobs.child import Answered, Ending, Refused, Stopped
from service.jobs.plan_request import Parcel, PlanRequest
from service.jobs.runner import Abandoned, Limits, Lost, Order, Runner
from tests.patience import wait_for_the_end_of
from tests.service.jobs.work import WORK


class Watcher:
    """Counts ticks, keeps progress, and gives an order from the first progress on."""

    def __init__(self, order: Order = Order.GO_ON):
        self.order = order
        self.seen: list[Progress] = []

    def tick(self, progress: Progress | None) -> Order:
        if progress is not None:
            self.seen.append(progress)
        return self.order if self.seen else Order.GO_ON


@pytest.fixture(scope="module")
def runner() -> Runner:
    warm = Runner(WORK)
    warm.warm_up()
    return warm


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "starts.log"


@pytest.fixture(autouse=True)
def no_process_is_left(log: Path) -> Iterator[None]:
    """Check that however a run ends, its process is gone."""
    yield
    for line in log.read_text().splitlines():
        wait_for_the_end_of(int(line.split()[-1]))


def run(
    runner: Runner,
    log: Path,
    solver: str,
    watcher: Watcher | None = None,
    *,
    time_s: float = 60.0,
    memory_mb: int = 2048,
    opportunities: Parcel | None = None,
) -> Ending | Abandoned | Lost:
    request = PlanRequest(
        job_id="j1",
        scenario_sha256="0" * 64,
        content="{}",
        solver=solver,
        params={"log": str(log)},
        seed=0,
        limits={},
        opportunity_block=opportunities or Parcel(None),
    )
    limits = Limits(time_s=time_s, memory_mb=memory_mb)
    return runner.run(request, limits, tick_s=0.05, tick=(watcher or Watcher()).tick)


def test_an_answer_comes_back(runner: Runner, log: Path) -> None:
    ending = run(runner, log, "answer")
    assert isinstance(ending, Answered)
    assert json.loads(ending.answer.timeline)["job"] == "j1"


def test_the_worker_does_not_keep_what_only_the_solver_needs(runner: Runner, log: Path) -> None:
    parcel = Parcel(b"block")
    ending = run(runner, log, "answer", opportunities=parcel)
    assert isinstance(ending, Answered)
    assert ending.answer.opportunity_block is None  # the solver had it
    assert parcel.take() is None


def test_a_search_that_honours_its_budget_keeps_its_plan_at_the_time_limit(
    runner: Runner, log: Path
) -> None:
    watcher = Watcher()
    ending = run(runner, log, "search", watcher, time_s=0.5)
    assert isinstance(ending, Answered)
    assert ending.answer.termination == "time_limit"
    rewards = [progress.reward for progress in watcher.seen]
    assert len(rewards) > 1
    assert rewards == sorted(rewards, key=lambda reward: reward or 0.0)


@pytest.mark.parametrize(
    ("solver", "limit", "value"),
    [("deaf", "STALL_S", 0.2), ("endless", "GRACE_CPU_S", {"solve": 0.2})],
    ids=["does nothing", "computes"],
)
def test_a_search_that_ignores_its_time_limit_is_killed(
    runner: Runner, log: Path, monkeypatch: pytest.MonkeyPatch,
    solver: str, limit: str, value: object,
) -> None:  # fmt: skip
    monkeypatch.setattr(grace, limit, value)
    ending = run(runner, log, solver, time_s=0.2)
    assert isinstance(ending, Refused)
    assert (ending.code, ending.detail) == ("time_limit", "No plan within the limit of 0.2 s.")


def test_who_gets_little_of_the_machine_has_longer_to_hand_over_its_plan(
    runner: Runner, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends two seconds of the clock after its limit, but has computed for less than one."""
    monkeypatch.setattr(grace, "GRACE_CPU_S", {"solve": 1.0})
    ending = run(runner, log, "starved", time_s=0.1)
    assert isinstance(ending, Answered)


def test_a_cancelled_search_keeps_its_best_plan(runner: Runner, log: Path) -> None:
    ending = run(runner, log, "search", Watcher(Order.CANCEL))
    assert isinstance(ending, Answered)
    assert ending.answer.termination == "cancelled"


def test_a_search_that_ignores_cancelling_is_killed(
    runner: Runner, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner_module, "CANCEL_GRACE_S", 0.2)
    assert run(runner, log, "deaf", Watcher(Order.CANCEL)) == Stopped()


def test_a_cancelled_search_that_is_being_verified_gets_the_time_for_it(
    runner: Runner, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner_module, "CANCEL_GRACE_S", 0.2)
    ending = run(runner, log, "slow_to_verify", Watcher(Order.CANCEL))
    assert isinstance(ending, Answered)
    assert ending.answer.termination == "cancelled"


def test_work_that_stops_without_a_plan_at_the_time_limit_is_refused(
    runner: Runner, log: Path
) -> None:
    ending = run(runner, log, "no_plan", time_s=0.2)
    assert isinstance(ending, Refused)
    assert ending.code == "time_limit"


def test_work_that_stops_without_a_plan_when_cancelled_is_stopped(
    runner: Runner, log: Path
) -> None:
    assert run(runner, log, "no_plan", Watcher(Order.CANCEL)) == Stopped()


def test_an_abandoned_run_ends_without_an_answer(runner: Runner, log: Path) -> None:
    assert run(runner, log, "search", Watcher(Order.ABANDON)) == Abandoned()


def test_a_process_over_its_memory_limit_is_killed(runner: Runner, log: Path) -> None:
    ending = run(runner, log, "hog", memory_mb=700)
    assert isinstance(ending, Refused)
    assert ending.code == "memory_limit"
    assert "its limit is 700 MB" in ending.detail


def test_a_process_that_crashes_is_told_by_its_signal(runner: Runner, log: Path) -> None:
    ending = run(runner, log, "crash")
    assert ending == Refused(
        "solver_crashed", "The solver's process ended unexpectedly (signal 11)."
    )


def test_wrong_data_is_refused_with_its_own_code(runner: Runner, log: Path) -> None:
    assert run(runner, log, "refuse") == Refused("no_such_orbit", "The orbit is not one.")


def test_a_bug_is_an_internal_error_that_tells_nothing_of_the_inside(
    runner: Runner, log: Path
) -> None:
    ending = run(runner, log, "bug")
    assert isinstance(ending, Refused)
    assert ending.code == "internal_error"
    assert "inner details" not in ending.detail


def test_an_answer_counts_even_when_its_process_is_gone_before_it_is_heard(
    runner: Runner, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker may be delayed; limits are judged after the last messages have been read."""

    class HeldUp(Watcher):
        def tick(self, progress: Progress | None) -> Order:
            if not self.seen:
                time.sleep(0.5)
            return super().tick(progress)

    monkeypatch.setattr(grace, "GRACE_CPU_S", {"access": 0.0, "solve": 0.0})
    ending = run(runner, log, "search", HeldUp(), time_s=0.2)
    assert isinstance(ending, Answered)
    assert ending.answer.termination == "time_limit"
