"""Opportunities for readers: computed once per scenario, stored, and kept at hand.

Jobs store the same block, so that whoever comes first computes it for all.
"""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from planner_core.build import ScenarioOpportunities, compute_opportunities
from planner_core.domain import Scenario
from planner_core.solvers.base import Budget
from service import opportunity_store
from service.api.problems import ServiceError
from service.db.rows import ScenarioRow
from service.db.session import Database
from service.translate import scenario_from_content

_KEPT = 4
_WAIT_S = 20.0
_ASK_AGAIN_S = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Described:
    """A scenario and its opportunities."""

    scenario: Scenario
    computed: ScenarioOpportunities


class OpportunityReader:
    """Reads or computes opportunities, one scenario at a time, beside the requests.

    A request waits for a while and is then told to ask again; the work goes on. Scenarios
    are told apart by their hash, so that what is kept never goes stale.
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="opportunities")
        self._budget = Budget()
        self._lock = threading.Lock()
        self._known: OrderedDict[str, Future[Described]] = OrderedDict()

    def get(self, database: Database, scenario_id: str, sha256: str) -> Described:
        """Return a scenario's opportunities; 503 ``still_computing`` where that takes long."""
        future = self._future(database, scenario_id, sha256)
        try:
            return future.result(timeout=_WAIT_S)
        except TimeoutError:
            raise ServiceError(
                "still_computing",
                "The opportunities of this scenario are being computed.",
                headers={"Retry-After": str(_ASK_AGAIN_S)},
            ) from None

    def close(self) -> None:
        """Stop the work under way."""
        self._budget.cancel()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _future(self, database: Database, scenario_id: str, sha256: str) -> Future[Described]:
        with self._lock:
            future = self._known.get(sha256)
            if future is None or (future.done() and future.exception() is not None):
                future = self._pool.submit(self._read, database, scenario_id, sha256)
                self._known[sha256] = future
            self._known.move_to_end(sha256)
            if len(self._known) > _KEPT:
                self._known.popitem(last=False)
            return future

    def _read(self, database: Database, scenario_id: str, sha256: str) -> Described:
        with database.reading() as session:
            content = session.get_one(ScenarioRow, scenario_id).content
            block = opportunity_store.load(session, sha256)
        scenario = scenario_from_content(json.loads(content))
        if block is not None:
            computed = ScenarioOpportunities.from_bytes(block)
            return Described(scenario=scenario, computed=computed)
        computed = compute_opportunities(scenario, self._budget)
        with database.transaction() as session:
            opportunity_store.save(session, sha256, computed.to_bytes())
        return Described(scenario=scenario, computed=computed)
