"""Whatever dies between a replan and its publication: frozen actions and promises are kept.

Two controllers replan the same plan and publish at once. Run like ``test_nothing_is_lost``.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from functools import partial
from typing import Final

import pytest

from service.jobs.supervisor import Supervisor
from tests.missions import Document, drawn_targets, paper_mission
from tests.service.jobs.chaos.api import Api
from tests.service.jobs.chaos.controllers import FREEZE, MOMENTS, Controller, Known
from tests.service.jobs.chaos.mischief import Mischief
from tests.service.jobs.chaos.test_nothing_is_lost import NUM_JOBS, SEED
from tests.service.jobs.conftest import Jobs

NUM_ROUNDS: Final = max(4, NUM_JOBS // 20)
NUM_TARGETS: Final = 60
HORIZON: Final = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T12:00:00Z"}
START: Final = datetime.fromisoformat("2019-01-01T00:00:00Z")
STEP: Final = timedelta(hours=8) / NUM_ROUNDS


class Harm:
    """Kills all workers, in every third round the API too, at a moment of each controller's round.

    Attributes
    ----------
    number
        The current round.
    """

    def __init__(self, mischief: Mischief, api: Api):
        self.done: Counter[str] = Counter()
        self.number = 0
        self._mischief, self._api = mischief, api
        self._lock = threading.Lock()

    def die(self, who: int, moment: str) -> None:
        """Kill if the moment has come, which is another one in each round."""
        if moment != MOMENTS[(self.number + 2 * who) % len(MOMENTS)]:
            return
        with self._lock:
            self._mischief.kill_workers()
            if self.number % 3 == 2:
                self._api.kill()
            self.done[moment] += 1


def test_nothing_frozen_differs_and_nothing_promised_is_bumped(
    jobs: Jobs, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = jobs.settings.model_copy(update={"workers": 2, "max_attempts": 1000})
    supervisor = Supervisor(settings)
    began_s = time.monotonic()
    with Api(settings) as api:
        mischief = Mischief(jobs, api, supervisor, SEED)
        harm = Harm(mischief, api)
        controllers = [Controller(api, SEED + i, partial(harm.die, i)) for i in range(2)]
        supervisor.start()
        try:
            chain, drafts = follow_the_day(controllers, mischief, harm)
            check_states(controllers[0], chain, drafts)
            for plan in [*chain, *drafts]:
                check_plan(controllers[0], plan)
        finally:
            supervisor.stop()
        refused = [code for controller in controllers for code in controller.refused]
    with capsys.disabled():
        print(
            f"\n{len(chain) - 1} replans published of {len(drafts)} and {len(refused)} refused in "
            f"{time.monotonic() - began_s:.0f} s; killed: {dict(harm.done)}, "
            f"other faults: {dict(mischief.done)}"
        )
    assert len(chain) > NUM_ROUNDS // 2
    assert harm.done.total() >= NUM_ROUNDS


def follow_the_day(
    controllers: list[Controller], mischief: Mischief, harm: Harm
) -> tuple[list[Known], list[Known]]:
    """Return the plans that were published one after the other, and all drafts of replans."""
    document: Document = paper_mission(drawn_targets(NUM_TARGETS), horizon=HORIZON)
    chain = [controllers[0].begin(document)]
    drafts: list[Known] = []
    # Meanwhile the database fails and processes freeze at any time.
    faults = threading.Thread(target=mischief.run, args=(max(1, NUM_ROUNDS // 6), 5.0))
    faults.start()
    with ThreadPoolExecutor(len(controllers)) as pool:
        for number in range(NUM_ROUNDS):
            harm.number, now = number, START + number * STEP
            asked = [pool.submit(each.replan, chain[-1], now) for each in controllers]
            found = [(c, a.result()) for c, a in zip(controllers, asked, strict=True)]
            ready = [(c, plan) for c, plan in found if plan is not None]
            drafts += [plan for _, plan in ready]
            for approved in [pool.submit(c.approve, plan) for c, plan in ready]:
                approved.result()
            published = [pool.submit(c.publish, plan, now + FREEZE) for c, plan in ready]
            winners = [
                plan for (_, plan), one in zip(ready, published, strict=True) if one.result()
            ]
            assert len(winners) == min(1, len(ready)), "two plans were published at once, or none"
            chain += winners
    faults.join()
    return chain, drafts


def check_states(controller: Controller, chain: list[Known], drafts: list[Known]) -> None:
    """Check that one plan is in force, earlier ones are superseded and the others are drafts."""
    expected = dict.fromkeys((plan.id for plan in drafts), "approved")
    expected |= dict.fromkeys((plan.id for plan in chain), "superseded")
    expected[chain[-1].id] = "published"
    assert controller.states() == expected


def check_plan(controller: Controller, plan: Known) -> None:
    """Compare a plan with its predecessor, and with all earlier promises."""
    actions = controller.actions(plan)
    assert plan.promised <= {action["target_id"] for action in actions}, "a promise was bumped"
    if plan.parent is None or plan.freeze_until is None:
        return
    before, after = (
        [(a["satellite_id"], a["mode"], a["target_id"], a["station_id"], a["start"], a["end"])
         for a in found if datetime.fromisoformat(a["start"]) < plan.freeze_until]
        for found in (controller.actions(plan.parent), actions)
    )  # fmt: skip
    assert after == before, "what was frozen differs"
