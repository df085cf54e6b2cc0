"""One planned mission for all exports, and a service that has it as a finished job."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime

import httpx
import pytest
import sqlalchemy as sa

from planner_core.domain import Scenario
from service.answers import store as answer_store
from service.answers.answered import Answered
from service.answers.chunks import Chunk, targets_text, timeline_text
from service.db.ids import new_id
from service.db.rows import JobResultRow, JobRow, ScenarioRow
from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.translate import scenario_from_content
from tests.missions import PAPER_ORBIT, Document, drawn_targets, paper_mission
from tests.service.answers import answered_of
from tests.service.conftest import Service
from tests.service.test_plan_job import run

# A recorder that holds only six images, so that there are many contacts.
RESOURCES: Document = {
    "battery_capacity_wh": 100.0,
    "sunpoint_power_w": 60.0,
    "collect_power_w": 40.0,
    "contact_power_w": 20.0,
    "recorder_capacity_mbit": 1000.0,
    "collect_rate_mbit_s": 4.0,
    "downlink_rate_mbit_s": 20.0,
    "telemetry_rate_mbit_s": 0.002,
}
FINISHED_AT = datetime(2018, 12, 31, 18, tzinfo=UTC)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """A scenario file in its canonical form, and the stored texts of its plan."""

    content: str
    chunks: tuple[Chunk, ...]

    @property
    def timeline(self) -> str:
        return timeline_text(self.chunks)

    @property
    def targets(self) -> str:
        return targets_text(self.chunks)

    @property
    def told(self) -> list[Document]:
        """The outcome of each target."""
        told: list[Document] = json.loads(self.targets)
        return told

    @property
    def scenario(self) -> Scenario:
        return scenario_from_content(json.loads(self.content))

    @property
    def document(self) -> Document:
        document: Document = json.loads(self.timeline)
        return document

    @property
    def answered(self) -> Answered:
        return answered_of(self.timeline, self.targets, self.content, FINISHED_AT)

    def with_timeline(self, **changes: object) -> Answered:
        """Return the answer with another timeline."""
        timeline = json.dumps(self.document | changes)
        return answered_of(timeline, self.targets, self.content, FINISHED_AT)


def mission_file(**flags: object) -> Document:
    """Return two satellites, 60 targets, a polar station and one at the antimeridian."""
    mission = paper_mission(drawn_targets(60), **flags)
    second = PAPER_ORBIT | {"NORAD_CAT_ID": 2, "INCLINATION": 51.6, "MEAN_MOTION": 14.5}
    mission["satellites"] = [
        {"id": "sat/1#a", "name": "=EYE, 1", "omm": PAPER_ORBIT, "resources": RESOURCES},
        {
            "name": 'EYE "2"',
            "omm": second,
            "resources": RESOURCES | {"initial_recorder_fraction": 0.6},
        },
    ]
    mission["ground_stations"] = [
        *mission["ground_stations"],
        {"name": "Suva", "lat_deg": -18.1, "lon_deg": 178.4, "elevation_mask": [[0, 5], [180, 20]]},
    ]
    mission["targets"] += [
        {"id": "-1+1", "name": "=North, 'of it'", "lat_deg": 60.0, "lon_deg": 190.0},
        {"id": '\'=late, "pole"', "lat_deg": -89.5, "lon_deg": 0.0, "reward": 2.5},
        {"id": "@out of reach", "lat_deg": 10.0, "lon_deg": 20.0, "off_nadir_max_deg": 1.0},
    ]
    return mission


@pytest.fixture(scope="session")
def mission() -> Mission:
    file = mission_file()
    answer = run(file, "rule")
    return Mission(content=canonical(file), chunks=answer.chunks)


@pytest.fixture
def answered(mission: Mission) -> Answered:
    return mission.answered


@pytest.fixture
def job_path(service: Service, mission: Mission) -> str:
    """Store the mission as a job that has succeeded; return its address."""
    return store_job(service, mission)


def store_job(service: Service, mission: Mission) -> str:
    """Store a mission as a job that has succeeded; return its address."""
    scenario_id, job_id = new_id(), new_id()
    with service.database.transaction() as session:
        session.add(
            ScenarioRow(
                id=scenario_id,
                sha256=sha256_of(mission.content),
                name=None,
                summary={},
                content=mission.content,
                created_at=FINISHED_AT,
            )
        )
        session.flush()
        session.execute(
            sa.insert(JobRow).values(
                id=job_id,
                scenario_id=scenario_id,
                state="succeeded",
                solver="rule",
                params={},
                seed=0,
                limits={},
                priority=5,
                dispatched_at=FINISHED_AT,
                created_at=FINISHED_AT,
                finished_at=FINISHED_AT,
            )
        )
        answer_store.save(session, job_id, mission.chunks, None)
        session.execute(sa.update(JobResultRow).values(created_at=FINISHED_AT))
    return f"/v1/jobs/{job_id}"


@pytest.fixture
def client(service: Service) -> httpx.Client:
    return service.client
