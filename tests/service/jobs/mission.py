"""A whole service with a worker, and a small real mission that it plans."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx

from tests.missions import Document, drawn_targets, paper_mission
from tests.patience import PATIENCE_S
from tests.service.conftest import contract
from tests.service.serving import serving

HALF_A_DAY = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T12:00:00Z"}
ODD = "50% of a/b c?é#1"
HIDDEN = "hidden/one"


def small_mission(**flags: Any) -> Document:
    """Return half a day of the paper's mission: unusual ids, one target without access."""
    targets = drawn_targets(300)
    targets[0]["id"] = ODD
    targets[1] |= {"id": HIDDEN, "off_nadir_max_deg": 5.0, "off_nadir_min_deg": 5.0}
    return paper_mission(targets, **({"horizon": HALF_A_DAY} | flags))


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """A running service; every answer is checked against its OpenAPI document."""

    http: httpx.Client

    def plan(self, scenario: Document, solver: str = "rule", **fields: Any) -> Document:
        """Return a job that has succeeded."""
        body = {"scenario": scenario, "solver": solver} | fields
        return self.ended(self.http.post("/v1/jobs", json=body))

    def ended(self, accepted: httpx.Response, state: str = "succeeded") -> Document:
        """Return the accepted job once it has ended."""
        assert accepted.status_code == 202, accepted.text
        deadline_s = time.monotonic() + PATIENCE_S
        while True:
            job: Document = self.http.get(accepted.headers["location"], params={"wait": 5}).json()
            if job["finished_at"] is not None:
                assert job["state"] == state, job
                return job
            assert time.monotonic() < deadline_s, job

    def what_if(self, job: Document, **change: Any) -> httpx.Response:
        """Request a what-if with a change."""
        return self.http.post(f"/v1/jobs/{job['id']}/what-if", json=change)

    def timeline(self, job: Document) -> Document:
        """Return the planned timeline."""
        found: Document = self.http.get(job["links"]["timeline"]).json()
        return found

    def targets(self, job: Document) -> dict[str, Document]:
        """Return the outcome of each target, by its id."""
        page = self.http.get(job["links"]["targets"], params={"limit": 500}).json()
        return {target["target_id"]: target for target in page["items"]}

    def explain(self, job: Document, target_id: str, **headers: str) -> httpx.Response:
        """Request an explanation."""
        path = f"/v1/jobs/{job['id']}/targets/{quote(target_id, safe='')}/explanation"
        return self.http.get(path, headers=headers)


@contextmanager
def running(folder: Path) -> Iterator[Mission]:
    """Run a service with one worker."""
    with (
        serving(folder, "serve", "--workers", "1") as (_, line),
        httpx.Client(base_url=line.split()[-1], timeout=60, trust_env=False) as http,
    ):
        http.event_hooks = {"response": [contract().check]}
        yield Mission(http=http)
