"""Numbers beyond any float and texts that no export can hold: refused in every field."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterator
from typing import Any, Final

import httpx
import pytest

from planner_core.budget import Budget
from planner_core.solvers.registry import SOLVERS
from service.wire.base import LEAST, MOST, SHORTEST_S
from tests.missions import PAPER_ORBIT, Document, drawn_targets, paper_mission
from tests.service.conftest import contract
from tests.service.factories import ground_station, satellite, target, tle
from tests.service.jobs.conftest import Jobs
from tests.service.problems import assert_problem
from tests.service.test_plan_job import run

HUGE: Final = 10**400
BAD_TEXTS: Final = (
    "\x00", "\x1f", "\x7f", "\u0085", "\u061c", "\u200f", "\u2028", "\u2029", "\u202e", "\u2066",
    "\ud800", "\udfff", "\ufffe", "\uffff",
)  # fmt: skip
GOOD_TEXTS: Final = (
    "Ōsaka 大阪",
    "العربية",
    "👩\u200d🚀",
    "a\u00a0b",
    "=1+1",
    "<b>&amp;",
    "\U0001f6f0",
)


def send(client: httpx.Client, path: str, body: object) -> httpx.Response:
    """Post JSON with every character beyond ASCII escaped, lone surrogates as well."""
    headers = {"Content-Type": "application/json"}
    return client.post(path, content=json.dumps(body), headers=headers)


def bodies(text: Any, number: Any) -> list[tuple[str, Document]]:
    """Return bodies with these texts or numbers wherever the schema is open or has one."""
    omm = PAPER_ORBIT | {"OBJECT_NAME": text or "A", "COMMENT": [{"any": text}], "X": number}
    file = paper_mission([target(id=text or "t")])
    return [
        ("/v1/satellites", {"name": text or "A", "omm": omm}),
        (
            "/v1/satellites",
            satellite(sensor={"sensor_type": text or "A"}, agility={"settle_s": number}),
        ),
        ("/v1/ground-stations", ground_station(name=text or "A", min_contact_s=number)),
        ("/v1/target-catalogs", {"name": "A", "targets": [target(id=text or "t", reward=number)]}),
        ("/v1/jobs", {"solver": text or "rule", "scenario": file, "params": {"gamma": number}}),
        (
            "/v1/jobs",
            {
                "solver": "rule",
                "scenario": file,
                "label": text,
                "params": {"x": {"y": [text, number]}},
            },
        ),
        ("/v1/webhooks", {"url": "https://ops.example/", "name": text, "events": [number]}),
    ]


def one_by_one(body: Any, bad: object, good: object) -> Iterator[Any]:
    """Yield the body once per bad value, with good ones in place of all others."""
    whole, num_sites = json.dumps(body), json.dumps(body).count(json.dumps(bad))
    for place in range(num_sites):
        parts = whole.split(json.dumps(bad))
        signs = [json.dumps(bad if number == place else good) for number in range(num_sites)]
        yield json.loads(
            "".join(itertools.chain(*itertools.zip_longest(parts, signs, fillvalue="")))
        )


def test_numbers_beyond_any_float_are_refused(client: httpx.Client) -> None:
    for number in (HUGE, -HUGE):
        for path, whole in bodies(None, number):
            for body in one_by_one(whole, number, 1):
                answer = send(client, path, body)
                assert answer.status_code == 422, (path, answer.text)


@pytest.mark.parametrize("text", BAD_TEXTS, ids=ascii)
def test_texts_that_no_export_can_carry_are_refused(client: httpx.Client, text: str) -> None:
    bad = f"a{text}b"
    for path, whole in bodies(bad, 1):
        for body in one_by_one(whole, bad, "ab"):
            answer = send(client, path, body)
            assert answer.status_code == 422, (path, answer.text)
    for path in ("/v1/jobs?label=", "/v1/audit-events?kind=", "/v1/satellites/"):
        query = f"a{text}b".encode("utf-8", "surrogatepass")
        answer = client.get(f"{path}{''.join(f'%{byte:02x}' for byte in query)}")
        # A lone surrogate arrives as the replacement character.
        assert answer.status_code == 422 or "\ud800" <= text <= "\udfff", (path, answer.text)


def texts_of(schema: Document, schemas: Document, place: str) -> Iterator[tuple[str, Document]]:
    """Yield every text that a schema accepts, with its position; each named schema once."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        yield from texts_of(schemas.pop(name, {}), schemas, name)
        return
    inner = {f"{place}.{name}": part for name, part in schema.get("properties", {}).items()}
    inner |= {f"{place}[]": schema[key] for key in ("items", "propertyNames") if key in schema}
    if isinstance(schema.get("additionalProperties"), dict):
        inner[f"{place}{{}}"] = schema["additionalProperties"]
    for number, part in enumerate(schema.get("anyOf", []) + schema.get("prefixItems", [])):
        inner[f"{place}/{number}"] = part
    for name, part in inner.items():
        yield from texts_of(part, schemas, name)
    if schema.get("type") == "string":
        yield place, schema


def lets_in(schema: Document, text: str) -> bool:
    if {"enum", "const", "format"} & schema.keys():  # instants have one form
        return False
    return re.search(schema.get("pattern", ""), text) is not None


def test_every_text_of_every_body_is_under_the_one_rule() -> None:
    document = contract().document
    schemas = dict(document["components"]["schemas"])  # each is removed once it is read
    bodies_of = [
        operation["requestBody"]["content"]["application/json"]["schema"]
        for operations in document["paths"].values()
        for operation in operations.values()
        if "application/json" in operation.get("requestBody", {}).get("content", {})
    ]
    texts = [found for body in bodies_of for found in texts_of(body, schemas, "")]
    assert len(texts) > 50
    loose = {
        place
        for place, schema in texts
        for text in BAD_TEXTS
        if not "\ud800" <= text <= "\udfff" and lets_in(schema, f"a{text}b")
    }
    # These have their own parsers, which the next test covers.
    assert loose == {"OrbitIn.tle/0[]", "SatelliteIn.tle/0[]", "WebhookIn.url"}


@pytest.mark.parametrize("text", BAD_TEXTS, ids=ascii)
def test_what_has_a_parser_of_its_own_refuses_them_too(client: httpx.Client, text: str) -> None:
    first, second = tle()
    for path, body in (
        ("/v1/webhooks", {"url": f"https://ops.example/a{text}b"}),
        ("/v1/satellites", {"name": "A", "tle": [first, second[:8] + text + second[9:]]}),
        ("/v1/satellites", {"name": "A", "tle": [f"EYE{text}1", first, second]}),
    ):
        answer = send(client, path, body)
        assert answer.status_code == 422, (path, answer.text)


def test_other_texts_are_taken_as_they_are(client: httpx.Client) -> None:
    for text in GOOD_TEXTS:
        answer = send(client, "/v1/ground-stations", ground_station(name=text))
        assert answer.status_code == 201, answer.text
        assert answer.json()["name"] == text


def test_a_what_if_refuses_them_too(client: httpx.Client, jobs: Jobs) -> None:
    job_id = jobs.submit("rule")
    changes: list[Document] = [{"solver": "rule", "params": {"x": HUGE}, "force": ["a"]}]
    for bad in (HUGE, "\ud800", "\u202e", {"\ud800": 1}, [["\ud800"]]):
        changes += [
            {"relax": {"slew_rate_deg_s": bad}},
            {"relax": {"targets": {"t": {"reward": bad}}}},
            {"relax": {"satellites": {"s": {"sensor_type": bad}}}},
        ]
    changes += [
        {"force": ["\ud800"]},
        {"relax": {"\ud800": 1}},
        {"relax": {"targets": {"\ud800": {}}}},
    ]
    for change in changes:
        answer = send(client, f"/v1/jobs/{job_id}/what-if", change)
        assert answer.status_code == 422, (change, answer.text)
        assert_problem(answer, 422, answer.json()["code"])


def amounts(value: float, shortest: float) -> Document:
    """Return a mission with all its amounts this large, or this small."""
    file = paper_mission(drawn_targets(12))
    for wanted in file["targets"]:
        wanted |= {"reward": value, "collect_s": shortest}
    file["satellites"][0] |= {
        "agility": {"slew_rate_deg_s": max(value, LEAST), "settle_s": min(value, 1.0)},
        "resources": {
            "battery_capacity_wh": max(value, LEAST),
            "recorder_capacity_mbit": max(value, LEAST),
            **dict.fromkeys(
                ("sunpoint_power_w", "collect_power_w", "contact_power_w", "collect_rate_mbit_s",
                 "downlink_rate_mbit_s", "telemetry_rate_mbit_s"), value,
            ),
        },
    }  # fmt: skip
    file["ground_stations"][0]["min_contact_s"] = value
    return file


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("value", [0.0, LEAST, MOST], ids=str)
def test_plans_of_the_largest_and_smallest_amounts_are_judged(solver: str, value: float) -> None:
    for shortest in (SHORTEST_S, 30.0):
        answer = run(amounts(value, shortest), solver, budget=Budget(20.0))
        assert 0.0 <= answer.reward < float("inf")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("reward", 1e308), ("reward", 1e10), ("collect_s", 5e-324), ("collect_s", 0.0009),
        ("collect_s", 1e19),
    ],
)  # fmt: skip
def test_amounts_that_no_sum_survives_are_refused(
    client: httpx.Client, field: str, value: float
) -> None:
    body = {"name": "A", "targets": [target(**{field: value})]}
    assert_problem(send(client, "/v1/target-catalogs", body), 422, "value_out_of_range")


def test_contacts_longer_than_any_clock_are_refused(client: httpx.Client) -> None:
    for value in (1e19, 1e308):
        body = ground_station(min_contact_s=value)
        assert_problem(send(client, "/v1/ground-stations", body), 422, "value_out_of_range")
