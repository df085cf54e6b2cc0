"""Messages over HTTP have one shape, closed for writers and open for readers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, get_args

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError, create_model

from planner_core import domain, pins
from planner_core.budget import Budget
from planner_core.certified.proofs import documents
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.whole_program import RowMultipliers
from planner_core.reasons import reason
from planner_core.solvers.base import Constraint
from planner_core.solvers.registry import solver_class
from service import client, wire
from service.access.callers import Scope
from service.api import stapi
from service.jobs.plan_job import run_plan_job
from service.jobs.plan_request import PlanRequest
from service.jobs.solver_params import params_of, parse_params
from service.main import ROUTERS, create_app
from service.scenarios.canonical import canonical, sha256_of
from service.settings import Settings
from service.wire import (
    changes,
    jobs,
    operations,
    outcomes,
    proofs,
    satellites,
    scenarios,
    timelines,
)
from service.wire import (
    pins as wire_pins,
)
from service.wire.base import Wire, dumped, read
from tests.service.jobs.mission import small_mission

MODULES = [import_module(f"service.wire.{found.name}") for found in iter_modules(wire.__path__)]
NOW = "2026-03-01T00:00:00.000Z"
ACTION = {
    "id": "a1", "mode": "collect", "start": NOW, "end": NOW, "target_id": "t1", "station_id": None,
    "station_name": None, "target_name": None,
    "turn_to_s": None, "turn_back_s": None, "opportunity_id": "o1",
    "off_nadir_deg": 10.0, "azimuth_deg": 90.0,
    "slew": {"angle_deg": 1.0, "needed_s": 1.0, "available_s": 2.0}, "reward": 0.8,
    "worth": 0.8, "quality": 0.8, "clear_probability": None, "delivered_at": NOW, "age_s": 60.0,
    "battery_fraction_end": None, "recorder_fraction_end": None,
}  # fmt: skip
JOB = {
    "id": "j1", "state": "running", "scenario": {"id": "s1", "sha256": "0"}, "solver": "rule",
    "params": {}, "seed": 0, "limits": {"time_s": 1.0, "memory_mb": 64}, "attempt": 1,
    "priority": 5, "label": None, "progress": None, "created_at": NOW, "started_at": None,
    "finished_at": None, "termination": None, "error": None, "change": None, "links": {},
    "validity": None, "warnings": [],
}  # fmt: skip
REASON = {
    "code": "displaced_by", "certainty": "verified", "blocking_actions": ["a1"],
    "opportunity_id": "o1", "at": NOW, "reward_delta": -1.0, "change": {"drop_actions": ["a1"]},
    "detail": "-",
}  # fmt: skip
DOCUMENTS: list[tuple[type[Wire], dict[str, Any]]] = [
    (timelines.ActionOut, ACTION),
    (jobs.JobOut, JOB),
    (outcomes.ReasonOut, REASON),
]


def models() -> Iterator[type[BaseModel]]:
    for module in MODULES:
        for value in vars(module).values():
            if isinstance(value, type) and issubclass(value, BaseModel) and value is not BaseModel:
                yield value


def parts(annotation: Any) -> Iterator[Any]:
    """Yield a type and all its component types."""
    yield annotation
    for part in get_args(annotation):
        yield from parts(part)


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    folder = tmp_path_factory.mktemp("app")
    return create_app(Settings(database_url=f"sqlite:///{folder}/unused.db"))


def routes() -> list[APIRoute]:
    """Return the calls of our own API: STAPI's shapes are its community's."""
    own = (r for r in ROUTERS if r is not stapi.router)
    return [route for r in own for route in r.routes if isinstance(route, APIRoute)]


def test_every_call_answers_with_models_of_the_wire() -> None:
    known = set(models())
    answered = {
        part
        for route in routes()
        for part in parts(route.response_model)
        if isinstance(part, type) and issubclass(part, BaseModel)
    }
    named = {one for one in answered if not one.__pydantic_generic_metadata__["origin"]}
    inside = {
        part
        for one in answered - named
        for part in one.__pydantic_generic_metadata__["args"]
        if isinstance(part, type)
    }
    assert len(named) > 10
    assert named | inside <= known


@pytest.mark.parametrize("model", sorted(set(models()), key=str))
def test_every_model_is_closed(model: type[BaseModel]) -> None:
    # Settings are looked up by name, which is checked when they are applied.
    expected = "allow" if model is changes.RelaxIn else "forbid"
    assert issubclass(model, Wire)
    assert model.model_config["extra"] == expected


def test_the_client_reads_the_shapes_that_are_written() -> None:
    known = set(models())
    shapes = [
        value
        for name in client.__all__
        if isinstance(value := getattr(client, name), type) and issubclass(value, BaseModel)
    ]
    assert len(shapes) > 15
    for shape in shapes:
        own = {base for base in shape.__mro__ if base in known and base is not Wire}
        assert own, shape
        # A field that the client adds is not one that the service would have to send.
        declared = {name for one in own for name in one.model_fields}
        added = shape.model_fields.keys() - declared
        assert not [name for name in added if shape.model_fields[name].is_required()]


@pytest.mark.parametrize(
    ("model", "document"), DOCUMENTS, ids=lambda case: getattr(case, "__name__", "")
)
def test_a_shape_without_one_of_its_fields_can_no_longer_be_written(
    model: type[Wire], document: dict[str, Any]
) -> None:
    assert dumped(model(**document)) == document
    assert dumped(read(model, json.dumps(document))) == document
    for name in document:
        others = {
            other: (field.annotation, field)
            for other, field in model.model_fields.items()
            if other != name
        }
        narrower = create_model("Narrower", __base__=Wire, **others)  # type: ignore[call-overload]
        with pytest.raises(ValidationError, match="Extra inputs are not permitted"):
            narrower(**document)


@pytest.mark.parametrize(("solver", "params"), [("rule", {}), ("milp", {"gap": 0.05})])
def test_real_answers_hold_nothing_that_is_not_declared(
    solver: str, params: dict[str, float]
) -> None:
    content = canonical(small_mission())
    request = PlanRequest(
        job_id="j1",
        scenario_sha256=sha256_of(content),
        content=content,
        solver=solver,
        params=params_of(parse_params(solver_class(solver), params)),
        seed=0,
        limits={},
    )
    answer = run_plan_job(request, Budget())
    timeline = json.loads(answer.timeline)
    assert timeline["satellites"][0]["eclipses"]
    assert dumped(timelines.TimelineOut(**timeline)) == timeline
    targets = json.loads(answer.targets)
    assert [dumped(outcomes.TargetItem(**target)) for target in targets] == targets
    assert any(target["reason"] for target in targets)
    proof = json.loads(answer.proof or "null")
    assert dumped(proofs.ProofOut(**proof)).items() >= proof.items()


def test_every_part_of_a_proof_is_declared() -> None:
    given = Bound(
        value=3.5,
        proof="dp",
        multipliers=np.array([0.5, 1.0]),
        contact_multipliers=np.array([2.0]),
        antenna_multipliers=np.array([0.25, 0.0]),
        queue_levels=12,
        is_elementary=True,
        unit=0.5,
        cell_s=20.0,
        row_multipliers=RowMultipliers(
            rows=np.array([0, 7], dtype=np.int32),
            of_rows=np.array([0.5, -1.0]),
            cliques=(np.array([3, 4], dtype=np.int32),),
            of_cliques=(0.25,),
        ),
        log="HiGHS",
        on_board=1.0,
    )
    written = json.loads(documents.to_json(given))
    assert len(written) == 1 + len(fields(Bound)) - 1  # its version; no refutation
    assert dumped(proofs.ProofOut(**written)).items() >= written.items()


def test_readers_take_fields_and_words_that_are_not_known_yet() -> None:
    newer = JOB | {"state": "paused", "mood": "good", "scenario": {"id": "s", "sha256": "", "v": 2}}
    with pytest.raises(ValidationError):
        jobs.JobOut(**newer)
    job = read(client.Job, json.dumps(newer))
    assert (job.state, job.scenario.id, job.is_final) == ("paused", "s", False)


def test_words_are_those_of_the_core() -> None:
    same = [
        (scenarios.Dynamics, domain.Dynamics),
        (scenarios.CollectAlignment, domain.CollectAlignment),
        (satellites.Nadir, domain.Nadir),
        (satellites.LookSide, domain.LookSide),
        (satellites.OrbitDirection, domain.OrbitDirection),
        (wire_pins.PinnedMode, pins.PinnedMode),
        (timelines.Outcome, reason.Outcome),
    ]
    for ours, core in same:
        assert get_args(ours) == get_args(core)
    assert get_args(operations.Constraint) == tuple(rule.value for rule in Constraint)
    assert get_args(operations.Scope) == tuple(scope.value for scope in Scope)
    assert get_args(jobs.JobState) == jobs.ACTIVE + jobs.FINAL


def test_every_call_is_summed_up_by_a_sentence(app: FastAPI) -> None:
    for path, operations_of in app.openapi()["paths"].items():
        for method, operation in operations_of.items():
            told = operation["summary"]
            assert told[0].isupper(), (method, path)
            assert len(told.split()) > 2, (method, path, told)
            assert not told.endswith("."), (method, path)
            # FastAPI's own summary is the function's name in capitals.
            assert told != operation["operationId"].replace("_", " ").title()
