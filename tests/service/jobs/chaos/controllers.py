"""Controllers who replan a day and publish the result, through every outage."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any, Final

from service.db.ids import new_id
from service.wire.instants import instant_text
from tests.missions import Document
from tests.service.jobs.chaos.api import Api

MOMENTS: Final = ("asked", "running", "drafted", "approved")
"""Moments between a replan and its publication at which something may die."""
FREEZE: Final = timedelta(minutes=20)
_PROMISED: Final = 2
_URGENT_REWARD: Final = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """A plan as a controller has seen it.

    Attributes
    ----------
    promised
        All targets that were promised in it or in its predecessors.
    parent, freeze_until
        Its predecessor, and from when on it may differ from that.
    """

    id: str
    promised: frozenset[str]
    parent: Known | None = None
    freeze_until: datetime | None = None


@dataclass(slots=True)
class Controller:
    """Requests replans and publishes them; copes with lost answers.

    Attributes
    ----------
    die
        Called at each of ``MOMENTS``.
    refused
        Reasons why replans failed, by the code of the job's error.
    """

    api: Api
    seed: int
    die: Callable[[str], None]
    refused: list[str] = field(default_factory=list)
    _random: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)

    def begin(self, document: Document) -> Known:
        """Plan a day, and publish the plan."""
        job = self._post("/v1/jobs", {"scenario": document, "solver": "certified"})
        assert self._ended(job["id"])["state"] == "succeeded"
        plan = Known(id=self._post("/v1/plans", {"job_id": job["id"]})["id"], promised=frozenset())
        assert self._move(plan, {"to": "approved"}) == "approved"
        assert self.publish(plan, datetime.fromisoformat(document["horizon"]["start"]))
        return plan

    def replan(self, plan: Known, now: datetime) -> Known | None:
        """Request the plan that follows an event; return None if it is refused."""
        freeze_until = now + FREEZE
        happened = self._happened(plan, now, freeze_until)
        job = self._post(f"/v1/plans/{plan.id}/replans", happened)
        self.die("asked")
        ended = self._ended(job["id"])
        if ended["state"] != "succeeded":
            assert ended["state"] == "failed", ended
            assert ended["error"]["code"] == "promise_not_kept", ended
            assert self._drafts_of(plan, job["id"]) == []
            self.refused.append(ended["error"]["code"])
            return None
        self.die("drafted")
        (draft,) = self._drafts_of(plan, job["id"])
        assert ended["links"]["plan"] == f"/v1/plans/{draft}"
        promised = {promise["target_id"] for promise in happened["promises"]}
        return Known(
            id=draft, promised=plan.promised | promised, parent=plan, freeze_until=freeze_until
        )

    def approve(self, plan: Known) -> None:
        """Approve a plan."""
        answer = self._move(plan, {"to": "approved"})
        assert answer == "approved", answer
        self.die("approved")

    def publish(self, plan: Known, from_: datetime) -> bool:
        """Publish a plan; return False if another one came first."""
        answer = self._move(plan, {"to": "published", "effective_from": instant_text(from_)})
        assert answer in ("published", "plan_overtaken"), answer
        return answer == "published"

    def actions(self, plan: Known) -> list[Document]:
        """Return a plan's actions, without the reports on them."""
        path = f"/v1/plans/{plan.id}/actions"
        page = self.api.answered("GET", path, params={"limit": 500}).json()
        assert page["next"] is None
        return list(page["items"])

    def states(self) -> dict[str, str]:
        """Return the state of each plan."""
        page = self.api.answered("GET", "/v1/plans", params={"limit": 500}).json()
        assert page["next"] is None
        return {each["id"]: each["state"] for each in page["items"]}

    def _happened(self, plan: Known, now: datetime, freeze_until: datetime) -> Document:
        later = [
            action for action in self.actions(plan) if action["start"] > instant_text(freeze_until)
        ]
        images = [action["target_id"] for action in later if action["mode"] == "collect"]
        passes = [action for action in later if action["mode"] == "contact"]
        promised = self._random.sample(images, min(_PROMISED, len(images)))
        lost = self._random.choice(passes) if passes else None
        urgent = {
            "id": new_id(), "reward": _URGENT_REWARD,
            "lat_deg": self._random.uniform(-70.0, 70.0),
            "lon_deg": self._random.uniform(-180.0, 180.0),
        }  # fmt: skip
        return {
            "now": instant_text(now),
            "freeze_until": instant_text(freeze_until),
            "add_targets": [urgent],
            "promises": [{"target_id": target_id} for target_id in promised],
            "outages": [] if lost is None else [
                {"station_id": lost["station_id"], "start": lost["start"], "end": lost["end"]}
            ],
            "limits": {"time_s": 20.0},
        }  # fmt: skip

    def _ended(self, job_id: str) -> Document:
        """Return a job at its end; while it runs something may die, once."""
        has_run = False
        while True:
            job: Document = self.api.answered("GET", f"/v1/jobs/{job_id}").json()
            if job["finished_at"] is not None:
                return job
            if job["state"] == "running" and not has_run:
                has_run = True
                self.die("running")
            time.sleep(0.05)

    def _drafts_of(self, plan: Known, job_id: str) -> list[str]:
        query = {"parent_id": plan.id, "job_id": job_id}
        page = self.api.answered("GET", "/v1/plans", params=query).json()
        return [each["id"] for each in page["items"]]

    def _post(self, path: str, body: Document) -> Document:
        # Sent again with the same key, it gets the first answer.
        headers = {"Idempotency-Key": new_id()}
        answer = self.api.answered("POST", path, json=body, headers=headers)
        assert answer.is_success, answer.text
        made: Document = answer.json()
        return made

    def _move(self, plan: Known, body: dict[str, Any]) -> str:
        """Return the state that a plan has reached, or the code of why not."""
        path = f"/v1/plans/{plan.id}/transitions"
        headers = {"Idempotency-Key": new_id()}
        answer = self.api.answered("POST", path, json=body, headers=headers)
        return str(answer.json()["state" if answer.is_success else "code"])
