"""Schemathesis over the whole OpenAPI document: no 5xx, and every answer as declared.

What is checked, and what is not and why, is in ``schemathesis.toml``. By default the cases are
the same in every run, and few in the quick profile; ``SLEWLINE_TEST_EXAMPLES=500`` draws that
many new ones for each call, and prints the seed if one fails.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import httpx
import pytest

from service.api.examples import BODIES
from tests.examples import is_full
from tests.patience import PATIENCE_S
from tests.service.contract import Contract, Document
from tests.service.factories import post
from tests.service.serving import serving

NUMBERS = (99_002, 99_003)
EXAMPLES = os.environ.get("SLEWLINE_TEST_EXAMPLES")
CONFIG = Path(__file__).with_name("schemathesis.toml")
DOCUMENT = "openapi.json"
TOKEN = "a-token-of-these-tests-and-of-nothing-else"
SHOWN = ("--header", f"Authorization:Bearer {TOKEN}")

Ids = dict[str, list[str]]


LUCK = {
    ("GET", "/v1/satellites/{satellite_id}/oem.kvn"),  # of a satellite whose orbit came as one
    ("POST", "/v1/jobs/{job_id}/cancel"),  # before the job has ended
    ("POST", "/v1/plans/{plan_id}/executions"),  # of a published plan, by its actions' own ids
    ("POST", "/v1/plans/{plan_id}/states"),  # of its own satellites, within its horizon
    ("POST", "/v1/plans/{plan_id}/replans"),  # from an instant of its own
    ("DELETE", "/v1/scenarios/{scenario_id}"),  # once no job has it
    ("DELETE", "/v1/jobs/{job_id}"),  # once no comparison has it
    ("POST", "/v1/webhooks/{webhook_id}/deliveries/{delivery_id}/redeliver"),  # before its deletion
}
"""Calls of which all attempts may be refused."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Probed:
    """A running service that holds something of every kind.

    Attributes
    ----------
    document
        The OpenAPI document, with existing ids in its examples.
    folder
        Holds the document and the configuration of Schemathesis.
    log
        The service's access log.
    """

    url: str
    document: Document
    folder: Path
    log: Path

    def probe(self, *options: str, phases: str, examples: int) -> None:
        """Run Schemathesis on the service; fail with its report."""
        command = [sys.executable, "-m", "schemathesis.cli", "--no-color"]
        command += ["--config-file", CONFIG.name, "run", DOCUMENT, "--url", self.url]
        command += ["--warnings", "off", "--output-sanitize", "false", "--continue-on-failure"]
        command += ["--request-timeout", str(PATIENCE_S)]
        if EXAMPLES is None:
            command += ["--generation-deterministic", "--phases", phases]
        command += ["--max-examples", EXAMPLES or str(examples), *options]
        done = subprocess.run(
            command,
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout

    def served(self) -> set[tuple[str, str]]:
        """Return the operations that were served, not only refused."""
        contract = Contract(self.document)
        with self.log.open() as lines:
            calls = [json.loads(line) for line in lines]
        found = [
            (call["method"], contract.operation(call["method"], call["path"]))
            for call in calls
            if call["message"] == "request" and call["status"] < 400
        ]
        return {(method, operation[0]) for method, operation in found if operation is not None}

    def operations(self) -> set[tuple[str, str]]:
        """Return all operations of the document."""
        return {
            (method.upper(), path)
            for path, operations in self.document["paths"].items()
            for method in operations
        }


def stored(client: httpx.Client) -> Ids:
    """Store two of everything; return the ids, and the names of the solvers."""
    # The example's catalogue number stays free for whoever tries it out.
    example = BODIES["SatelliteIn"]
    numbered = [example | {"omm": example["omm"] | {"NORAD_CAT_ID": n}} for n in NUMBERS]
    ids: Ids = {"satellites": [post(client, "/v1/satellites", body)["id"] for body in numbered]}
    for collection, shape in (
        ("ground-stations", "GroundStationIn"),
        ("target-catalogs", "TargetCatalogIn"),
    ):
        name = collection.rpartition("-")[2]
        ids[name] = [post(client, f"/v1/{collection}", BODIES[shape])["id"] for _ in range(2)]
    question = BODIES["ScenarioIn"] | {
        "satellite_ids": ids["satellites"][:1],
        "target_catalog_ids": ids["catalogs"][:1],
        "ground_station_ids": ids["stations"][:1],
    }
    ids["scenarios"] = [
        post(client, "/v1/scenarios", question | {"use_resources": use_resources})["id"]
        for use_resources in (True, False)
    ]
    runs = {"scenario_id": ids["scenarios"][0], "runs": [{"solver": "rule"}, {"solver": "graph"}]}
    ids["comparisons"] = [finished(client, post(client, "/v1/comparisons", runs)["id"])]
    ids["jobs"] = [job["id"] for job in client.get("/v1/jobs").json()["items"]]
    ids["plans"] = [post(client, "/v1/plans", {"job_id": ids["jobs"][0]})["id"] for _ in range(3)]
    webhook = post(client, "/v1/webhooks", BODIES["WebhookIn"])["links"]["self"]
    ids["webhooks"] = [webhook.rpartition("/")[2]]
    ids["deliveries"] = [client.post(f"{webhook}/test").json()["id"] for _ in range(2)]
    ids["solvers"] = [solver["name"] for solver in client.get("/v1/solvers").json()["items"]]
    return ids


def with_ids(document: Document, ids: Ids) -> Document:
    """Return the document with examples that refer to existing things."""
    known = {
        "satellite_ids": ids["satellites"][:1],
        "target_catalog_ids": ids["catalogs"][:1],
        "ground_station_ids": ids["stations"][:1],
        "scenario_id": ids["scenarios"][0],
    }
    for shape in ("ScenarioIn", "JobIn", "ComparisonIn"):
        (example,) = document["components"]["schemas"][shape]["examples"]
        example.update((name, known[name]) for name in known.keys() & example)
    (newer,) = document["components"]["schemas"]["OrbitIn"]["examples"]
    newer["omm"]["NORAD_CAT_ID"] = NUMBERS[0]
    return document


def finished(client: httpx.Client, comparison_id: str) -> str:
    deadline_s = time.monotonic() + PATIENCE_S
    while (answer := client.get(f"/v1/comparisons/{comparison_id}").json())["state"] == "running":
        assert time.monotonic() < deadline_s, answer
        time.sleep(0.1)
    assert {run["state"] for run in answer["runs"]} == {"succeeded"}
    return comparison_id


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Probed]:
    """A service on one's own machine: no key is needed."""
    folder = tmp_path_factory.mktemp("probed")
    # Whatever is planned meanwhile must end soon.
    limits = {"default_time_s": "1", "max_time_s": "2"}
    with serving(folder, "serve", "--workers", "1", **limits) as (_, line):
        url = line.split()[-1]
        with httpx.Client(base_url=url, timeout=60, trust_env=False) as client:
            ids = stored(client)
            document = with_ids(client.get("/openapi.json").json(), ids)
        dictionaries = [
            f"[dictionaries.{name}]\nvalues = {json.dumps(values)}\n"
            for name, values in ids.items()
        ]
        (folder / CONFIG.name).write_text("\n".join([CONFIG.read_text(), *dictionaries]))
        (folder / DOCUMENT).write_text(json.dumps(document))
        yield Probed(url=url, document=document, folder=folder, log=folder / "serve.log")


@pytest.fixture(scope="module")
def guarded(own: Probed) -> Iterator[Probed]:
    """A second way into the same service, where a key is needed."""
    keys = {"require_keys": "true", "api_keys": f"tests:admin:{TOKEN}"}
    with serving(own.folder, "api", **keys) as (_, line):
        yield replace(own, url=line.split()[-1], log=own.folder / "api.log")


def test_every_answer_is_declared_where_a_key_is_shown(guarded: Probed) -> None:
    """With enough examples every operation is served at least once."""
    if not is_full():
        guarded.probe(*SHOWN, phases="examples,fuzzing", examples=1)
        return
    guarded.probe(*SHOWN, phases="examples,coverage,fuzzing,stateful", examples=5)
    refused = guarded.operations() - guarded.served()
    assert refused <= LUCK


def test_every_answer_is_declared_where_a_key_is_missing(guarded: Probed) -> None:
    guarded.probe(phases="fuzzing", examples=3 if is_full() else 1)


@pytest.mark.full_size
def test_every_answer_is_declared_where_no_key_is_needed(own: Probed) -> None:
    own.probe("--exclude-checks", "ignored_auth", phases="examples,fuzzing", examples=3)
