"""What happens to requests when connections break, seen from both ends."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.client import (
    Client,
    JobFailed,
    ServiceError,
    UnexpectedAnswer,
    Unreachable,
    WaitTimedOut,
)
from service.jobs import lease
from service.jobs.lease import Lease, Outcome
from tests.service.answers import chunks_of_timeline
from tests.service.client.trouble import Answer, Cut, LostAnswer, Proxy
from tests.service.jobs.conftest import Jobs, Workers

SATELLITE: dict[str, Any] = {
    "NORAD_CAT_ID": 99001, "EPOCH": "2019-01-01T00:00:00", "MEAN_MOTION": 15.24162312,
    "ECCENTRICITY": 0.001, "INCLINATION": 90, "RA_OF_ASC_NODE": 0, "ARG_OF_PERICENTER": 0,
    "MEAN_ANOMALY": 0, "BSTAR": 0,
}  # fmt: skip
BUSY = Answer(503, {"Retry-After": "1"})
EVENT = b"\n\n"
PROGRESS: dict[str, Any] = {
    "phase": "solve", "fraction": 0.5, "reward": 3.0, "bound": None, "message": "searching",
}  # fmt: skip


def begin(jobs: Jobs, job_id: str) -> Lease:
    with jobs.database.transaction() as session:
        held = lease.start(session, job_id, 1, lease_s=60.0)
    assert held is not None
    return held


def end(jobs: Jobs, held: Lease, filler: str = "") -> None:
    chunks = tuple(chunks_of_timeline({"filler": filler, "satellites": []}))
    with jobs.database.transaction() as session:
        assert lease.finish(session, held, Outcome(state="succeeded", chunks=chunks))


def finish(jobs: Jobs, job_id: str, filler: str = "") -> None:
    end(jobs, begin(jobs, job_id), filler)


@pytest.mark.parametrize("fault", [LostAnswer(), BUSY, Cut(lambda got: len(got) > 10)])
def test_a_job_is_made_once_however_its_answer_is_lost(
    patient: Client, proxy: Proxy, jobs: Jobs, fault: Any
) -> None:
    proxy.plan("POST", "/jobs", fault)
    job = patient.jobs.submit(jobs.scenario_id, "rule", label="once")
    sent = proxy.requests("POST", "/jobs")
    assert [job.id for job in patient.jobs.list()] == [job.id]
    assert len(sent) == 2
    assert len({request.headers["idempotency-key"] for request in sent}) == 1


def test_the_same_call_twice_makes_two_jobs_unless_its_key_is_given(
    patient: Client, jobs: Jobs
) -> None:
    for _ in range(2):
        patient.jobs.submit(jobs.scenario_id, "rule")
        patient.jobs.submit(jobs.scenario_id, "graph", idempotency_key="mine")
    assert sorted(job.solver for job in patient.jobs.list()) == ["graph", "rule", "rule"]


def test_everything_that_creates_is_made_once(patient: Client, proxy: Proxy, jobs: Jobs) -> None:
    first = patient.jobs.submit(jobs.scenario_id, "rule")
    makers: dict[str, Callable[[], object]] = {
        "/satellites": lambda: patient.satellites.create("A", omm=SATELLITE),
        "/ground-stations": lambda: patient.ground_stations.create("North", 78.2, 15.4),
        "/target-catalogs": lambda: patient.target_catalogs.create(
            "Cities", "id,lat_deg,lon_deg\nbern,46.9,7.4\n", "csv"
        ),
        "/rerun": first.rerun,
        "/comparisons": lambda: patient.comparisons.submit(
            jobs.scenario_id, [{"solver": "rule"}, {"solver": "graph"}]
        ),
    }
    for ending, make in makers.items():
        proxy.plan("POST", ending, LostAnswer())
        make()
        assert len(proxy.requests("POST", ending)) == 2, ending
    assert len(list(patient.satellites.list())) == 1
    assert len(list(patient.ground_stations.list())) == 1
    assert len(list(patient.target_catalogs.list())) == 1
    assert len(list(patient.comparisons.list())) == 1
    assert len(list(patient.jobs.list())) == 1 + 1 + 2


def test_a_cancel_whose_answer_is_lost_is_not_sent_again(
    patient: Client, proxy: Proxy, jobs: Jobs
) -> None:
    job = patient.jobs.submit(jobs.scenario_id, "rule")
    proxy.plan("POST", "/cancel", LostAnswer())
    with pytest.raises(Unreachable):
        job.cancel()
    assert len(proxy.requests("POST", "/cancel")) == 1
    assert job.refresh().state == "cancelled"


def test_a_deletion_whose_answer_is_lost_is_a_deletion(patient: Client, proxy: Proxy) -> None:
    station = patient.ground_stations.create("North", 78.2, 15.4)
    proxy.plan("DELETE", station.id, LostAnswer())
    patient.ground_stations.delete(station.id)
    assert list(patient.ground_stations.list()) == []
    with pytest.raises(ServiceError) as refused:
        patient.ground_stations.delete(station.id)
    assert refused.value.code == "not_found"


def test_what_holds_for_one_state_only_is_not_sent_again(patient: Client, proxy: Proxy) -> None:
    satellite = patient.satellites.create("A", omm=SATELLITE)
    newer = SATELLITE | {"EPOCH": "2019-01-02T00:00:00"}
    proxy.plan("PUT", "/elements", LostAnswer(), LostAnswer())
    with pytest.raises(Unreachable):
        patient.satellites.put_elements(satellite.id, omm=newer, if_match=satellite.etag)
    assert len(proxy.requests("PUT", "/elements")) == 1
    patient.satellites.put_elements(satellite.id, omm=newer)
    assert len(proxy.requests("PUT", "/elements")) == 3
    assert len(list(patient.satellites.elements(satellite.id))) == 2


def test_what_takes_longer_than_the_patience_is_told_at_once(patient: Client, proxy: Proxy) -> None:
    proxy.plan("GET", "/version", Answer(429, {"Retry-After": "3600"}))
    with pytest.raises(ServiceError) as refused:
        patient.version()
    assert refused.value.retry_after_s == 3600.0
    assert len(proxy.requests("GET", "/version")) == 1


def test_a_date_to_come_back_is_understood(patient: Client, proxy: Proxy) -> None:
    when = {
        "Date": "Wed, 01 Jan 2025 00:00:00 GMT",
        "Retry-After": "Wed, 01 Jan 2025 02:00:00 GMT",
    }
    proxy.plan("GET", "/version", Answer(503, when))
    with pytest.raises(ServiceError) as refused:
        patient.version()
    assert refused.value.retry_after_s == 7200.0


def test_a_proxy_that_answers_for_itself_is_told_from_the_service(proxy: Proxy, jobs: Jobs) -> None:
    proxy.plan("GET", "/version", Answer(502))
    with Client(proxy.url, patience_s=0.0) as client:
        with pytest.raises(ServiceError) as refused:
            client.version()
        assert (refused.value.code, refused.value.status) == ("http_502", 502)
        proxy.plan("GET", "/version", Answer(200))
        with pytest.raises(UnexpectedAnswer, match="/version"):
            client.version()


def test_nobody_there_is_told_with_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with Client(f"http://someone:secret@127.0.0.1:{port}", patience_s=0.0) as client:
        with pytest.raises(Unreachable, match=f"http://127.0.0.1:{port}: ") as error:
            client.version()
        assert "secret" not in f"{error.value} {client!r}"


# Each change follows once the previous one was received, so that no order depends on timing.
def test_a_stream_of_events_that_breaks_is_taken_up_where_it_broke(
    patient: Client, proxy: Proxy, jobs: Jobs
) -> None:
    job = patient.jobs.submit(jobs.scenario_id, "rule")
    proxy.plan("GET", "/events", Cut(lambda got: EVENT in got), Cut(lambda got: EVENT in got))
    states = job.follow()
    assert next(states).state == "queued"
    held = begin(jobs, job.id)
    assert next(states).state == "running"
    with jobs.database.transaction() as session:
        lease.renew(session, held, lease_s=60.0, progress=PROGRESS)
    told = next(states)
    assert told.progress is not None
    assert told.progress.reward == PROGRESS["reward"]
    end(jobs, held)
    assert [state.state for state in states] == ["succeeded"]
    streams = proxy.requests("GET", "/events")
    assert len(streams) == 3
    assert "last-event-id" not in streams[0].headers
    assert int(streams[2].headers["last-event-id"]) > int(streams[1].headers["last-event-id"])


def test_a_job_is_asked_for_where_no_events_can_be_had(
    patient: Client, proxy: Proxy, jobs: Jobs
) -> None:
    job = patient.jobs.submit(jobs.scenario_id, "rule")
    proxy.plan("GET", "/events", Answer(502))
    states = job.follow()
    assert next(states).state == "queued"
    finish(jobs, job.id)
    assert [state.state for state in states] == ["succeeded"]
    first, *others = proxy.requests("GET", job.id)
    assert "wait" not in first.query
    assert others
    assert all("if-none-match" in question.headers for question in others)
    assert all(float(question.query["wait"]) > 0 for question in others)


def test_streams_that_never_say_anything_are_given_up(
    patient: Client, proxy: Proxy, jobs: Jobs
) -> None:
    job_id = jobs.submit("rule")
    finish(jobs, job_id)
    proxy.plan("GET", "/events", LostAnswer(), LostAnswer(), LostAnswer())
    assert patient.jobs.wait(job_id).state == "succeeded"
    assert len(proxy.requests("GET", "/events")) == 3


def test_waiting_ends_and_the_job_goes_on(patient: Client, jobs: Jobs) -> None:
    job = patient.jobs.submit(jobs.scenario_id, "rule")
    with pytest.raises(WaitTimedOut):
        job.wait(timeout_s=0.3)
    assert job.refresh().state == "queued"
    with pytest.raises(ServiceError) as refused:
        job.timeline()
    assert refused.value.code == "not_ready"


def test_waiting_for_a_comparison_ends_too(patient: Client, jobs: Jobs) -> None:
    table = patient.comparisons.submit(jobs.scenario_id, [{"solver": "rule"}], label="night")
    with pytest.raises(WaitTimedOut):
        patient.comparisons.wait(table.id, timeout_s=0.3)
    patient.jobs.cancel(table.runs[0].job_id)
    assert patient.comparisons.wait(table.id).runs[0].state == "cancelled"


def test_a_job_that_fails_is_an_error_and_a_cancelled_one_is_not(
    patient: Client, jobs: Jobs, workers: Workers
) -> None:
    failing, waiting = jobs.submit("refuse"), jobs.submit("rule", priority=0)
    assert patient.jobs.cancel(waiting).state == "cancelled"
    workers.start()
    with pytest.raises(JobFailed, match="no_such_orbit") as failed:
        patient.jobs.wait(failing)
    assert failed.value.job.error is not None
    assert failed.value.job.error.code == "no_such_orbit"
    assert patient.jobs.wait(waiting).state == "cancelled"


def test_an_unchanged_job_is_not_read_again(patient: Client, proxy: Proxy, jobs: Jobs) -> None:
    submitted = patient.jobs.submit(jobs.scenario_id, "rule")
    assert submitted.refresh() is submitted
    assert proxy.requests("GET", submitted.id)[0].headers["if-none-match"] == submitted.etag
    submitted.cancel()
    assert submitted.refresh().state == "cancelled"


def test_a_download_that_breaks_begins_anew_and_leaves_a_whole_file(
    patient: Client, proxy: Proxy, jobs: Jobs, folder: Path
) -> None:
    job_id = jobs.submit("rule")
    finish(jobs, job_id, "x" * 500_000)
    proxy.plan("GET", "/timeline.json", Cut(lambda got: len(got) > 100_000))
    file = patient.jobs.download(job_id, folder / "day.json")
    assert len(proxy.requests("GET", "/timeline.json")) == 2
    assert json.loads(file.read_text(encoding="utf-8"))["filler"] == "x" * 500_000
    assert list(folder.iterdir()) == [file]


def test_a_download_that_fails_leaves_the_file_that_was_there(
    proxy: Proxy, jobs: Jobs, folder: Path
) -> None:
    job_id = jobs.submit("rule")
    finish(jobs, job_id, "x" * 500_000)
    file = folder / "day.json"
    file.write_text("yesterday's", encoding="utf-8")
    proxy.plan("GET", "/timeline.json", Cut(lambda got: len(got) > 100_000))
    with Client(proxy.url, patience_s=0.0) as client, pytest.raises(Unreachable):
        client.jobs.download(job_id, file)
    assert file.read_text(encoding="utf-8") == "yesterday's"
    assert list(folder.iterdir()) == [file]


def test_the_key_is_sent_and_never_shown(
    proxy: Proxy, monkeypatch: pytest.MonkeyPatch, jobs: Jobs
) -> None:
    monkeypatch.setenv("SLEWLINE_URL", proxy.url)
    monkeypatch.setenv("SLEWLINE_KEY", "slw_sesame")
    proxy.plan("GET", "/version", Answer(401), LostAnswer())
    with Client(patience_s=0.0) as client:
        with pytest.raises(ServiceError) as refused:
            client.version()
        with pytest.raises(Unreachable) as lost:
            client.version()
        shown = f"{client!r} {client.__dict__} {refused.value!r} {lost.value!r}"
    assert "sesame" not in shown
    assert {s.headers["authorization"] for s in proxy.seen} == {"Bearer slw_sesame"}
    with Client(key="slw_other") as client:
        client.version()
    assert proxy.seen[-1].headers["authorization"] == "Bearer slw_other"


@pytest.mark.parametrize(
    "given", [{"key": "slw_sesame\n"}, {"key": "slw sésame"}, {"url": "ftp://u:sesame@host"}]
)
def test_what_cannot_be_sent_is_refused_without_being_repeated(given: dict[str, str]) -> None:
    with pytest.raises(ValueError, match=r"key|URL") as refused:
        Client(given.get("url"), given.get("key"))
    assert "same" not in str(refused.value)


def test_an_answer_that_is_no_job_is_told(patient: Client, proxy: Proxy, jobs: Jobs) -> None:
    job = patient.jobs.submit(jobs.scenario_id, "rule")
    body = b'event: job\nid: 1\ndata: {"state": "queued"}\n\n'
    proxy.plan("GET", "/events", Answer(200, {"Content-Type": "text/event-stream"}, body))
    with pytest.raises(UnexpectedAnswer):
        list(job.follow())
