"""Traces: one from a request to the end of its job, and none if tracing is off."""

from __future__ import annotations

import io
import itertools
import json
import logging
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx
import pytest
from opentelemetry import trace
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

from service.jobs.supervisor import Supervisor
from service.jobs.worker import Worker
from service.process.logs import JsonFormatter
from service.process.tracing import CannotTrace, is_asked_for, start_tracing
from service.settings import Settings
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import posted
from tests.service.jobs.work import WORK

PARENT = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"
PHASES = ["solve", "verify", "store"]


@pytest.fixture(scope="session")
def exporter() -> InMemorySpanExporter:
    """Keeps the spans of this process; OpenTelemetry allows one provider per process."""
    exporter = InMemorySpanExporter()
    provider = TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(exporter))
    trace.set_tracer_provider(provider)
    return exporter


@pytest.fixture
def spans(exporter: InMemorySpanExporter) -> Iterator[InMemorySpanExporter]:
    exporter.clear()
    yield exporter
    exporter.clear()


@pytest.fixture
def worker(jobs: Jobs) -> Iterator[Worker]:
    """A worker in this process, which receives its jobs from the test."""
    worker = Worker(jobs.settings, WORK)
    yield worker
    worker._queue.close()
    worker._database.close()


def by_name(spans: InMemorySpanExporter) -> dict[str, ReadableSpan]:
    return {span.name: span for span in spans.get_finished_spans()}


def attributes(span: ReadableSpan) -> dict[str, object]:
    return {
        name.removeprefix("slewline."): value
        for name, value in (span.attributes or {}).items()
        if name.startswith("slewline.")
    }


def parent(span: ReadableSpan) -> int | None:
    return span.parent.span_id if span.parent else None


def test_one_trace_leads_from_the_request_to_the_phases_of_its_job(
    spans: InMemorySpanExporter, client: httpx.Client, jobs: Jobs, worker: Worker
) -> None:
    client.headers.update({"traceparent": PARENT, "X-Request-ID": "r-1"})
    job_id = posted(client, jobs, solver="forward_search", limits={"time_s": 0.5})
    assert client.get("/health/live").status_code == 200
    worker.handle(job_id, 1)
    assert jobs.job(job_id).state == "succeeded"

    found = by_name(spans)
    request, queued, run = found["POST /v1/jobs"], found["queue job"], found["run job"]
    assert set(found) == {request.name, queued.name, run.name, "store", "solve"}
    traces = {span.context.trace_id for span in found.values() if span.context}
    assert traces == {int(PARENT.split("-")[1], 16)}
    assert parent(request) == int(PARENT.split("-")[2], 16)
    assert request.context is not None
    assert queued.context is not None
    assert run.context is not None
    assert parent(queued) == request.context.span_id
    assert parent(run) == queued.context.span_id
    assert attributes(request) == {"request_id": "r-1"}
    assert attributes(queued) == {"request_id": "r-1", "job_id": job_id}
    assert attributes(run) == {
        "job_id": job_id, "request_id": "r-1", "run": 1, "solver": "forward_search",
        "state": "succeeded",
    }  # fmt: skip
    for name in ("solve", "store"):
        assert parent(found[name]) == run.context.span_id


def test_the_workers_log_names_job_and_request(
    client: httpx.Client, jobs: Jobs, worker: Worker
) -> None:
    lines = io.StringIO()
    handler = logging.StreamHandler(lines)
    handler.setFormatter(JsonFormatter())
    of_workers = logging.getLogger("service.jobs.worker")
    level = of_workers.level
    of_workers.addHandler(handler)
    of_workers.setLevel(logging.INFO)
    try:
        client.headers.update({"X-Request-ID": "r-2"})
        job_id = posted(client, jobs, solver="rule")
        worker.handle(job_id, 1)
    finally:
        of_workers.removeHandler(handler)
        of_workers.setLevel(level)
    (line,) = [json.loads(text) for text in lines.getvalue().splitlines()]
    assert (line["job_id"], line["request_id"]) == (job_id, "r-2")
    assert (line["run"], line["solver"], line["state"]) == (1, "rule", "succeeded")


def test_phases_follow_each_other_and_a_failure_is_marked(
    spans: InMemorySpanExporter, jobs: Jobs, worker: Worker
) -> None:
    worker.handle(jobs.submit("slow_to_verify", limits={"time_s": 0.2, "memory_mb": 2048}), 1)
    run = by_name(spans)["run job"]
    assert run.parent is None  # no trace was requested when it was queued
    phases = [span for span in spans.get_finished_spans() if span is not run]
    assert [span.name for span in phases] == PHASES
    for before, after in itertools.pairwise(phases):
        assert before.end_time is not None
        assert after.start_time is not None
        assert before.end_time <= after.start_time
    assert run.status.is_ok or run.status.is_unset
    spans.clear()
    worker.handle(jobs.submit("refuse"), 1)
    run = by_name(spans)["run job"]
    assert not run.status.is_ok
    assert not run.status.is_unset
    assert attributes(run)["state"] == "failed"


def test_logs_name_the_trace_that_they_belong_to(spans: InMemorySpanExporter) -> None:
    record = logging.makeLogRecord({"msg": "x"})
    assert "trace_id" not in json.loads(JsonFormatter().format(record))
    with trace.get_tracer("test").start_as_current_span("here") as span:
        told = json.loads(JsonFormatter().format(record))["trace_id"]
    assert told == trace.format_trace_id(span.get_span_context().trace_id)


@pytest.mark.parametrize(
    ("setting", "environment", "wanted"),
    [
        (None, {}, False),
        (None, {"OTEL_EXPORTER_OTLP_ENDPOINT": ""}, False),
        (None, {"OTEL_EXPORTER_OTLP_ENDPOINT": "http://collector:4318"}, True),
        (None, {"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT": "http://collector/v1/traces"}, True),
        (None, {"OTEL_EXPORTER_OTLP_ENDPOINT": "http://c", "OTEL_SDK_DISABLED": "true"}, False),
        (False, {"OTEL_EXPORTER_OTLP_ENDPOINT": "http://collector:4318"}, False),
        (True, {}, True),
    ],
)
def test_traces_are_sent_where_the_setting_or_the_standard_variables_say_so(
    setting: bool | None,
    environment: dict[str, str],
    wanted: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert is_asked_for(Settings(otel=setting)) is wanted


def test_asking_without_the_extra_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)  # as if not installed
    with pytest.raises(CannotTrace, match=r"pip install 'slewline\[otel\]'"):
        start_tracing(Settings(otel=True), "api")


def test_nothing_is_loaded_where_nobody_asks() -> None:
    script = (
        "import sys, service.main, service.jobs.worker as w\n"
        "from service.settings import Settings\n"
        "from service.process.tracing import start_tracing\n"
        "assert start_tracing(Settings(), 'api') is None\n"
        "print(*sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = set(ran.stdout.split())
    assert "opentelemetry.trace" in loaded
    assert not [name for name in loaded if name.startswith(("opentelemetry.sdk", "requests"))]


class Collector(BaseHTTPRequestHandler):
    """Receives the data of OTLP exporters."""

    received: list[ExportTraceServiceRequest] = []  # noqa: RUF012 - of the whole class

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        Collector.received.append(ExportTraceServiceRequest.FromString(body))
        self.send_response(200)
        self.end_headers()

    def log_request(self, *_: object) -> None:
        pass


def test_a_worker_process_sends_its_spans_to_the_collector_before_it_ends(
    jobs: Jobs, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ThreadingHTTPServer(("127.0.0.1", 0), Collector) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}"
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", address)
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_COMPRESSION", "none")
        supervisor = Supervisor(jobs.settings, work=WORK)
        supervisor.start()
        try:
            jobs.until_state(jobs.submit("answer"), "succeeded")
        finally:
            supervisor.stop()
            server.shutdown()
    resources = [each for request in Collector.received for each in request.resource_spans]
    services = {
        attribute.value.string_value
        for resource in resources
        for attribute in resource.resource.attributes
        if attribute.key == "service.name"
    }
    assert services == {"slewline-worker"}
    names = [s.name for each in resources for scope in each.scope_spans for s in scope.spans]
    assert sorted(names) == ["run job", "store"]
