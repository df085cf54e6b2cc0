"""``GET /metrics``: figures of the service in the text format of Prometheus.

Figures of jobs come from the database, so that every API process returns the same; each process
counts only its own calls.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import sqlalchemy as sa
from fastapi import APIRouter, Response
from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Histogram,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    InfoMetricFamily,
    Metric,
    SummaryMetricFamily,
)
from sqlalchemy.orm import Session
from starlette.types import Scope

import planner_core
from service.api.deps import CallDep
from service.db.session import Database
from service.stores import metrics_store as store

router = APIRouter(tags=["operations"])

_METHODS: Final = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_BUCKETS_S: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class CallCounters:
    """The calls of this process, by route."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        self._calls = Counter(
            "slewline_http_requests",
            "Calls answered by this process.",
            ("method", "route", "status"),
            registry=self.registry,
        )
        self._seconds = Histogram(
            "slewline_http_request_seconds",
            "Seconds until the answer to a call was sent, including streams and waits.",
            ("method", "route"),
            buckets=_BUCKETS_S,
            registry=self.registry,
        )

    def count(self, scope: Scope, status: int, seconds: float) -> None:
        """Count one call that has ended."""
        # Not the path: every id and every scanner's guess would be a series of its own.
        route = getattr(scope.get("route"), "path_format", "none")
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self._calls.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(seconds)


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}, "description": "Prometheus text format."}},
)
def metrics(call: CallDep) -> Response:
    """Return figures for Prometheus: jobs, workers, orbits, and the calls of this process.

    If the database does not answer, `slewline_database_up` is 0 and its figures are absent.
    """
    counters: CallCounters = call.request.app.state.call_counters
    stored = _Collected(list(_families(call.database)))
    text = generate_latest(stored) + generate_latest(counters.registry)
    return Response(text, headers={"Content-Type": CONTENT_TYPE_LATEST})


class _Collected:
    """Metric families read once, for one answer."""

    def __init__(self, families: list[Metric]):
        self._families = families

    def collect(self) -> list[Metric]:
        return self._families


def _families(database: Database) -> Iterator[Metric]:
    yield InfoMetricFamily(
        "slewline_build", "Version of the service.", {"version": planner_core.__version__}
    )
    stored: list[Metric] = []
    try:
        with database.reading() as session:
            stored = [*_of_jobs(session), *_of_others(session)]
    except sa.exc.DatabaseError:
        pass  # the next family reports it
    up = 1.0 if stored else 0.0
    yield GaugeMetricFamily("slewline_database_up", "1 if the database answers, else 0.", up)
    yield from stored


def _of_jobs(session: Session) -> Iterator[Metric]:
    yield _gauge("slewline_jobs", "Jobs by state.", "state", store.num_jobs(session))
    about = "Plans that jobs have found, by validity."
    yield _gauge("slewline_job_plans", about, "validity", store.num_plans(session))
    yield GaugeMetricFamily(
        "slewline_queue_oldest_seconds",
        "How long the oldest waiting job has waited.",
        store.oldest_waiting_s(session),
    )
    times = SummaryMetricFamily(
        "slewline_job_seconds",
        "Time from first start to end of the jobs that have ended.",
        labels=["solver", "state", "termination"],
    )
    for labels, num_jobs, total_s in store.job_times(session):
        times.add_metric(labels, count_value=num_jobs, sum_value=total_s)
    yield times
    yield CounterMetricFamily(
        "slewline_leases_lost", "Runs whose worker died.", store.num_leases_lost(session)
    )


def _of_others(session: Session) -> Iterator[Metric]:
    yield _gauge(
        "slewline_worker_heartbeat_age_seconds",
        "Time since the last sign of life of each worker seen in the last day.",
        "worker",
        store.heartbeat_age_s(session),
    )
    orbits = GaugeMetricFamily(
        "slewline_orbit_age_seconds",
        "Time since the epoch of the newest elements of each satellite planned in the last 7 days.",
        labels=["satellite_id", "name"],
    )
    for labels, age_s in store.orbit_ages(session):
        orbits.add_metric(labels, age_s)
    yield orbits
    yield _gauge(
        "slewline_webhook_deliveries",
        "Webhook messages by state; of those that ended, only the last 30 days.",
        "state",
        store.num_deliveries(session),
    )


def _gauge(name: str, about: str, label: str, values: Mapping[str, float]) -> Metric:
    """Return a gauge with a figure for each value of one label."""
    family = GaugeMetricFamily(name, about, labels=[label])
    for value, number in values.items():
        family.add_metric([value], number)
    return family
