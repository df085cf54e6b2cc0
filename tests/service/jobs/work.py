"""Work for solver processes in tests: the request's ``solver`` names one."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import psutil

from planner_core.budget import Budget, Progress
from planner_core.errors import Cancelled, InvalidScenario
from service.answers.chunks import target_chunks
from service.jobs.plan_request import PlanAnswer, PlanRequest
from service.jobs.runner import Work
from tests.patience import PATIENCE_S
from tests.service.answers import chunks_of_timeline

_FOREVER_S = 3 * PATIENCE_S
_SPAN = {"start": "2026-03-01T00:00:00.000Z", "end": "2026-03-02T00:00:00.000Z"}
EMPTY = {
    "schema_version": "1.0",
    "scenario_sha256": "0" * 64,
    "plan_sha256": "0" * 64,
    "solver": {"name": "answer", "version": "0", "params": {}, "seed": 0},
    "horizon": _SPAN,
    "dynamics": "physical",
    "use_resources": False,
    "runtime_s": dict.fromkeys(("access", "compile", "solve", "verify"), 0.0),
    "validity": "valid",
    "violations": [],
    "totals": {
        **dict.fromkeys(("reward", "collects", "contacts"), 0),
        **dict.fromkeys(("bound", "gap", "bound_proof", "downlinked_mbit", "downlinked_fraction")),
        **dict.fromkeys(("battery_min_fraction", "recorder_max_fraction")),
        "targets": dict.fromkeys(("downlinked", "collected", "unscheduled", "excluded"), 0),
    },
    "warnings": [],
    "models": {},
    "satellites": [],
}
"""An empty timeline with every field that readers rely on."""

WORK = Work(function="tests.service.jobs.work:run", preload="tests.service.jobs.work")


def run(request: PlanRequest, budget: Budget) -> PlanAnswer:
    """Do what the solver's name says; log each start if the params ask for it."""
    if "log" in request.params:
        with Path(request.params["log"]).open("a") as log:
            log.write(f"{request.job_id} {request.solver} {os.getpid()}\n")
    match request.solver:
        case "answer" | "rule":
            return answer(request, "horizon_complete")
        case "search" | "forward_search":
            return search(request, budget)
        case "deaf":
            budget.report(Progress(phase="solve", fraction=0.5))
            time.sleep(_FOREVER_S)
        case "endless":
            budget.report(Progress(phase="solve", fraction=0.5))
            while True:
                pass
        case "starved":
            budget.report(Progress(phase="solve", fraction=0.5))
            compute_now_and_then(seconds=2.0)
            return answer(request, "time_limit")
        case "no_plan":
            while not budget.is_spent():
                budget.report(Progress(phase="access", fraction=0.1))
                time.sleep(0.01)
            raise Cancelled
        case "slow_to_verify":
            found = search(request, budget)
            budget.report(Progress(phase="verify", fraction=0.0))
            time.sleep(1.0)
            return found
        case "hog":
            # Far beyond the limits of the tests, but less than the machine has: the watching
            # process may be frozen or late.
            hoard = [bytearray(os.urandom(1 << 20)) * 16 for _ in range(200)]
            time.sleep(60.0)
            return answer(request, str(len(hoard)))
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "kill_worker":
            fork_server = psutil.Process().parent()
            assert fork_server is not None
            worker = fork_server.parent()
            assert worker is not None
            worker.kill()
            time.sleep(_FOREVER_S)
        case "kill_fork_server":
            starts = Path(request.params["log"]).read_text()
            if starts.count(request.job_id) >= int(request.params.get("survives", 9)):
                return answer(request, "horizon_complete")
            fork_server = psutil.Process().parent()
            assert fork_server is not None
            fork_server.kill()
            time.sleep(_FOREVER_S)
        case "refuse":
            raise InvalidScenario("no_such_orbit", "The orbit is not one.", pointer="/satellites")
        case "bug":
            raise KeyError("a fault of ours, with inner details")
    raise AssertionError(request.solver)


def compute_now_and_then(*, seconds: float) -> None:
    """Compute as a process that gets a small share of the machine."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        for _ in range(20_000):
            pass
        time.sleep(0.05)


def search(request: PlanRequest, budget: Budget) -> PlanAnswer:
    """Improve until the budget is spent, or until the file named by the params exists."""
    steps = 0
    until = Path(request.params.get("until", "/nonexistent"))
    while not (budget.is_spent() or until.exists()):
        steps += 1
        budget.report(Progress(phase="solve", fraction=0.5, reward=float(steps)))
        time.sleep(0.01)
    return answer(request, budget.ending(is_optimal=False, is_close=False).value)


def answer(request: PlanRequest, termination: str) -> PlanAnswer:
    """Return a small answer that names its job and its run."""
    timeline = EMPTY | {"job": request.job_id, "run": request.run, "termination": termination}
    targets = [{"target_id": "t0", "outcome": "collected", "reason": None}]
    return PlanAnswer(
        chunks=(*chunks_of_timeline(timeline), *target_chunks(targets)),
        termination=termination,
        reward=1.0,
        opportunity_block=None if request.opportunity_block.take() else b"block",
    )
