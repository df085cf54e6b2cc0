"""What each command does.

Whatever takes long to import is imported by the command that needs it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from planner_core.errors import Cancelled, PlannerError
from service.access.callers import Scope
from service.process.imports import importing

if TYPE_CHECKING:
    from service.settings import Settings

OK: Final = 0
FAILED: Final = 1
WRONG_INPUT: Final = 2

_MOST_FAULTS: Final = 20


class WrongInput(Exception):
    """Something on the command line, in the environment or in a file; the message names it."""


class Stopped(Exception):
    """Whoever waits for the command has ended it."""


def complain(message: str, status: int) -> int:
    """Say what went wrong; return the status."""
    print(f"slewline: {message}", file=sys.stderr)
    return status


def why_database_failed(error: BaseException) -> str | None:
    """Return why the database could not serve, or None where something else went wrong."""
    if "sqlalchemy" not in sys.modules:
        return None
    from service.db.failures import why_unavailable

    return why_unavailable(error)


def _settings(options: argparse.Namespace) -> Settings:
    """Return the settings of the environment, with the options given on top."""
    from pydantic import SecretStr, ValidationError

    from service.settings import Settings

    given = {name: value for name, value in vars(options).items() if name in Settings.model_fields}
    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        first = error.errors()[0]
        name = str(first["loc"][0])
        option = f"--{name.replace('_', '-')}" if name in given else f"SLEWLINE_{name.upper()}"
        # A setting with secrets in it is never repeated.
        is_secret = Settings.model_fields[name].annotation is SecretStr
        instead = "" if is_secret else f", not {first['input']!r}"
        raise WrongInput(f"{option}: {first['msg']}{instead}") from error


def serve(options: argparse.Namespace) -> int:
    """Run the API and local workers."""
    return _run_server(_settings(options), with_workers=True)


def api(options: argparse.Namespace) -> int:
    """Run the API alone."""
    return _run_server(_settings(options), with_workers=False)


def _run_server(settings: Settings, *, with_workers: bool) -> int:
    with importing():
        from service.server import CannotServe, NoKey, serve

    try:
        return serve(settings, with_workers=with_workers)
    except NoKey as error:
        raise WrongInput(str(error)) from error
    except CannotServe as error:
        return complain(str(error), FAILED)


def worker(options: argparse.Namespace) -> int:
    """Run one worker."""
    from service.jobs.__main__ import run_worker
    from service.jobs.runner import Work
    from service.process.tracing import CannotTrace

    try:
        run_worker(_settings(options), Work())
    except CannotTrace as error:
        return complain(str(error), FAILED)


def migrate(options: argparse.Namespace) -> int:
    """Create or update the database."""
    from service.server import prepare_database

    prepare_database(_settings(options))
    print("The database is up to date.")
    return OK


def backup(options: argparse.Namespace) -> int:
    """Copy a SQLite database that is in use."""
    from service.db.backup import CannotBackUp, back_up

    try:
        back_up(_settings(options).database_url, options.file)
    except CannotBackUp as error:
        return complain(str(error), FAILED)
    print(f"The database is in {options.file}.")
    return OK


def create_key(options: argparse.Namespace) -> int:
    """Make a key and print it, this once."""
    from service.commands.key_commands import create_key

    create_key(
        _settings(options),
        name=options.name,
        owner=options.owner,
        scope=Scope(options.scope),
        expires_days=options.expires_days,
    )
    return OK


def list_keys(options: argparse.Namespace) -> int:
    """List all keys, without their secrets."""
    from service.commands.key_commands import list_keys

    list_keys(_settings(options))
    return OK


def revoke_key(options: argparse.Namespace) -> int:
    """Make a key worthless at once."""
    from service.commands.key_commands import NoSuchKey, revoke_key

    try:
        revoke_key(_settings(options), options.key_id)
    except NoSuchKey:
        raise WrongInput(f"there is no key {options.key_id!r}; see slewline keys list") from None
    return OK


def demo(options: argparse.Namespace) -> int:
    """Plan a real-size mission and print what came out."""
    from service.commands.demo import DemoFailed, run_demo

    try:
        return run_demo(_settings(options), folder=options.out, keep_serving=options.serve)
    except DemoFailed as error:
        return complain(str(error), FAILED)


def solve(options: argparse.Namespace) -> int:
    """Plan a scenario file, without a service."""
    with importing():
        from service.commands.solve import solve_file

    with _faults_of(options.scenario):
        return solve_file(
            options.scenario,
            solver=options.solver,
            params=dict(options.param),
            seed=options.seed,
            time_s=options.time_s,
            out=options.out,
        )


def compare_spacing(options: argparse.Namespace) -> int:
    """See what more starts in each access gain on a scenario file."""
    from service.commands import compare_spacing

    with _faults_of(options.scenario):
        return compare_spacing.compare_spacing(
            options.scenario,
            spacings_s=options.spacing_s or compare_spacing.SPACINGS_S,
            solver=options.solver,
            params=dict(options.param),
            seed=options.seed,
            time_s=options.time_s,
            out=options.out,
        )


@contextmanager
def _faults_of(scenario: Path) -> Iterator[None]:
    """Tell what is wrong with a scenario file, or with the search that it is given to."""
    from service.commands.scenario_files import place_of

    try:
        yield
    except PlannerError as error:
        place = place_of(error.fault.pointer or "", scenario)
        raise WrongInput(f"{place}: {error.detail}") from error
    except Cancelled as error:
        raise Stopped("stopped before there was a plan") from error
    except OSError as error:
        raise WrongInput(f"{error.filename}: {error.strerror}") from error


def check(options: argparse.Namespace) -> int:
    """Have the referee judge a timeline."""
    from service.answers.reading import UnreadableTimeline
    from service.commands.check import check_file

    try:
        with _faults_of(options.scenario):
            return check_file(options.scenario, options.timeline)
    except UnreadableTimeline as error:
        lines = [
            f"{options.timeline} {f'line {f.row}' if f.row else f.pointer or ''}".strip()
            + f": {f.detail}"
            for f in error.faults[:_MOST_FAULTS]
        ]
        left = len(error.faults) - len(lines)
        raise WrongInput("\n".join(lines + [f"{left} more"] * (left > 0))) from error


def plan(options: argparse.Namespace) -> int:
    """Have a service plan a scenario, and follow it."""
    from service.commands.plan_command import run_plan

    return _asked(run_plan, options)


def replan(options: argparse.Namespace) -> int:
    """Have a service replan a plan after what happened, and follow it."""
    from service.commands.plan_command import run_replan

    return _asked(run_replan, options)


def _asked(ask: Callable[[argparse.Namespace], int], options: argparse.Namespace) -> int:
    from service.client import ClientError

    try:
        return ask(options)
    except ClientError as error:
        return complain(str(error), FAILED)


def openapi(options: argparse.Namespace) -> int:
    """Print the description of the HTTP API."""
    from service.main import create_app

    # The application opens its database at the first request: this one never.
    settings = _settings(options).model_copy(update={"database_url": "sqlite:///unused.db"})
    app = create_app(settings)
    print(json.dumps(app.openapi(), indent=2))
    return OK
