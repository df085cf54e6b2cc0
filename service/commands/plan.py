"""``slewline plan`` and ``replan``: submit a job to a service and get its plan."""

from __future__ import annotations

import argparse
import os
import secrets
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Final

from service.client import Client, ClientError, Job, JobFailed, ServiceError
from service.client.transport import said
from service.commands.outcome import Failed, WrongInput
from service.commands.progress_line import ProgressLine
from service.commands.replan import print_draft
from service.commands.scenario_files import place_of, read_object, require_folder, told_of
from service.commands.summary import summary

_SUFFIXES: Final = (".json", ".csv", ".geojson", ".czml", ".ics")  # the service decides
_OPTIONS: Final = {
    "/limits/time_s": "--time-s",
    "/seed": "--seed",
    "/label": "--label",
    "/priority": "--priority",
    "/scenario_id": "--scenario-id",
    "/now": "--now",
    "/name": "--name",
}
_OF_THE_INPUT: Final = (413, 422)
_STORED: Final = "the plan"  # if no file is given


def plan(options: argparse.Namespace) -> int:
    """Have a service plan a scenario, and follow it."""
    with _placed(options.scenario or _STORED):
        if (options.scenario is None) == (options.scenario_id is None):
            raise WrongInput("give either SCENARIO.json or --scenario-id")
        _check_out(options)
        scenario = options.scenario_id or read_object(options.scenario)
        with _client(options) as client:
            submit = partial(
                client.jobs.submit,
                scenario,
                options.solver,
                params=dict(options.param),
                seed=options.seed,
                time_s=options.time_s,
                priority=options.priority,
                label=options.label,
                idempotency_key=secrets.token_hex(16),
            )
            return _follow_to_plan(client, submit, options)


def replan(options: argparse.Namespace) -> int:
    """Have a service replan a plan after what happened, and follow it.

    If the job is cancelled, its best plan so far still becomes a draft.
    """
    with _placed(options.happened or _STORED):
        _check_out(options)
        happened = {} if options.happened is None else read_object(options.happened)
        happened |= said(now=options.now, name=options.name)
        if options.time_s is not None:
            limits = happened.get("limits")
            others = limits if isinstance(limits, dict) else {}
            happened["limits"] = {**others, "time_s": options.time_s}
        with _client(options) as client:
            key = secrets.token_hex(16)
            submit = partial(client.jobs.replan, options.plan_id, happened, idempotency_key=key)
            tell = partial(print_draft, client, options.plan_id)
            return _follow_to_plan(client, submit, options, tell)


def _client(options: argparse.Namespace) -> Client:
    if options.key_env is not None and options.key_env not in os.environ:
        raise WrongInput(f"--key-env: there is no variable {options.key_env}")
    key = None if options.key_env is None else os.environ[options.key_env]
    try:
        return Client(options.url, key)
    except ValueError as error:
        raise WrongInput(str(error)) from error


def _check_out(options: argparse.Namespace) -> None:
    if options.out is None:
        return
    if options.detach:
        raise WrongInput("--out: with --detach there is no plan to write yet")
    if options.out.suffix.lower() not in _SUFFIXES:
        raise WrongInput(f"--out: {options.out} must end in one of {', '.join(_SUFFIXES)}")
    require_folder(options.out)


@contextmanager
def _placed(file: Path | str) -> Iterator[None]:
    with told_of(file):
        try:
            yield
        except ServiceError as error:
            if error.status not in _OF_THE_INPUT:
                raise Failed(str(error)) from error
            raise WrongInput(_faults(error, file)) from error
        except ClientError as error:
            raise Failed(str(error)) from error


def _faults(error: ServiceError, file: Path | str) -> str:
    """Return the faults that the service found, one per line."""
    lines = []
    for fault in error.errors:
        pointer = fault.pointer or ""
        own = pointer.removeprefix("/scenario/")
        in_file = f"{file} /{own}" if own != pointer else place_of(pointer, file)
        lines.append(f"{_OPTIONS.get(pointer, in_file)}: {fault.detail}")
    return "\n".join(lines) or error.detail


def _follow_to_plan(
    client: Client,
    submit: Callable[[], Job],
    options: argparse.Namespace,
    tell: Callable[[Job], None] = lambda _: None,
) -> int:
    """Submit a job, follow it, print a summary of its plan; return 0 if that is valid, else 1.

    Ctrl-C cancels the job and saves its best plan so far; a second Ctrl-C leaves at once.

    Parameters
    ----------
    submit
        Posts the job under a fixed idempotency key: called twice, it returns the same job.
    tell
        Prints further information about a job that has a plan.
    """
    try:
        job = submit()
    except KeyboardInterrupt:
        # The service may already have it: under the same key it returns that very job.
        _cancel(submit())
        raise
    if options.detach:
        print(job.id)
        return 0
    print(f"job {job.id} at {client.url}", file=sys.stderr)
    job = _followed(job)
    if job.state in ("failed", "expired"):
        raise JobFailed(job)
    timeline = job.timeline()
    print(summary(timeline.model_dump()))
    tell(job)
    if options.out is not None:
        job.download(options.out)
    return 0 if timeline.validity != "violations" else 1


def _followed(job: Job) -> Job:
    """Return the job when it has ended."""
    with ProgressLine(sys.stderr) as line:
        try:
            return _watched(job, line)
        except KeyboardInterrupt:
            return _watched(_cancel(job), line)


def _watched(job: Job, line: ProgressLine) -> Job:
    for state in job.follow():
        line.show(state)
        job = state
    return job


def _cancel(job: Job) -> Job:
    with suppress(ServiceError):  # it may have ended by itself, which the next state shows
        return job.cancel()
    return job
