"""Traces (OpenTelemetry): from the request that submits a job, via its row, to its worker.

Off by default: OpenTelemetry's interface, a dependency of the web framework, then does
nothing, and its implementation (the extra ``otel``) is not even loaded.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, MutableMapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from opentelemetry import trace
from opentelemetry.trace import Span, SpanKind, Status, StatusCode
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

import planner_core
from service.process.logs import request_id

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider

    from service.settings import Settings

_ENDPOINTS: Final = ("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT")
_UNTRACED: Final = ("/health/", "/metrics")

_tracer: Final = trace.get_tracer("slewline", planner_core.__version__)
_propagator: Final = TraceContextTextMapPropagator()


class CannotTrace(Exception):
    """Traces are requested but not possible; the message says what to do."""


def is_asked_for(settings: Settings) -> bool:
    """Return whether to send traces: as set, otherwise if a collector is configured."""
    if settings.otel is not None:
        return settings.otel
    if os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true":
        return False
    return any(os.environ.get(name) for name in _ENDPOINTS)


def start_tracing(settings: Settings, role: str) -> TracerProvider | None:
    """Send this process's spans according to the standard ``OTEL_`` variables, if requested.

    Parameters
    ----------
    role
        The role of the process: its service name is ``slewline-<role>`` unless
        ``OTEL_SERVICE_NAME`` gives another.

    Returns
    -------
    What must be shut down before the process ends, or None if nothing is sent.

    Raises
    ------
    CannotTrace
        If the extra ``otel`` is not installed.
    """
    if not is_asked_for(settings):
        return None
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        raise CannotTrace(
            "Tracing is enabled (SLEWLINE_OTEL or OTEL_EXPORTER_OTLP_ENDPOINT), but its exporter "
            "is not installed: pip install 'slewline[otel]', or set SLEWLINE_OTEL=false."
        ) from error
    named = os.environ.get("OTEL_SERVICE_NAME") or f"slewline-{role}"
    resource = Resource.create({"service.name": named, "service.version": planner_core.__version__})
    provider = TracerProvider(resource=resource)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    trace.set_tracer_provider(provider)
    return provider


def is_untraced(scope: MutableMapping[str, Any]) -> bool:
    """Return whether a request only checks health or reads metrics."""
    return scope["type"] == "http" and str(scope["path"]).startswith(_UNTRACED)


def note_queued(job_id: str) -> str | None:
    """Trace the queueing of a job; return what its row must keep for ``running``, or None."""
    attributes = {"slewline.job_id": job_id}
    if (request := request_id.get()) is not None:
        attributes["slewline.request_id"] = request
    carrier: dict[str, str] = {}
    with _tracer.start_as_current_span("queue job", kind=SpanKind.PRODUCER, attributes=attributes):
        _propagator.inject(carrier)
    return carrier.get("traceparent")


@contextmanager
def running(traceparent: str | None, **attributes: str | int) -> Iterator[JobSpan]:
    """Trace the run of a job as part of the trace in which it was queued."""
    parent = None if traceparent is None else _propagator.extract({"traceparent": traceparent})
    with _tracer.start_as_current_span(
        "run job",
        context=parent,
        kind=SpanKind.CONSUMER,
        attributes={f"slewline.{name}": value for name, value in attributes.items()},
    ) as span:
        job = JobSpan(span)
        try:
            yield job
        finally:
            job.leave_phase()


class JobSpan:
    """The span of a run, with a child span for each phase reported by the solver's process."""

    def __init__(self, span: Span):
        self._span = span
        self._phase: Span | None = None

    def enter_phase(self, name: str) -> None:
        """Begin a phase; it ends with the next one, or with the run."""
        self.leave_phase()
        self._phase = _tracer.start_span(name)

    def leave_phase(self) -> None:
        """End the phase."""
        if self._phase is not None:
            self._phase.end()
            self._phase = None

    def note_end(self, state: str, *, failed: bool = False) -> None:
        """Record how the run ended."""
        self._span.set_attribute("slewline.state", state)
        if failed:
            self._span.set_status(Status(StatusCode.ERROR))
