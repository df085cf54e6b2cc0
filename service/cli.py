"""The program ``slewline``: one command for each way to run the service.

Whatever takes long to import is imported by the command that needs it.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import planner_core
from planner_core.errors import Cancelled, PlannerError
from service.access.callers import Scope, is_plain_name

if TYPE_CHECKING:
    from service.settings import Settings

OK = 0
FAILED = 1
WRONG_INPUT = 2

_LONGEST_DAYS = 3650
_MOST_FAULTS = 20

Command = Callable[[argparse.Namespace], int]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 0 well, 1 failed, 2 wrong input."""
    options = _parser().parse_args(arguments)
    command: Command = options.command
    try:
        return command(options)
    except _WrongInput as error:
        return _complain(str(error), WRONG_INPUT)
    except KeyboardInterrupt:
        return _complain("interrupted", FAILED)


class _WrongInput(Exception):
    """Something on the command line, in the environment or in a file; the message names it."""


def _complain(message: str, status: int) -> int:
    print(f"slewline: {message}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="slewline",
        description="Operations planning for agile Earth-observation satellites.",
        epilog="Each setting is also an environment variable: SLEWLINE_PORT and so on.",
    )
    parser.add_argument("--version", action="version", version=planner_core.__version__)
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    serve = _command(commands, "serve", _serve, "run the API and local workers")
    _add_address(serve)
    serve.add_argument("--workers", type=int, help="worker processes (2)")
    _add_database(serve)

    api = _command(commands, "api", _api, "run the API alone")
    _add_address(api)
    _add_database(api)

    worker = _command(commands, "worker", _worker, "run one worker")
    _add_database(worker)

    migrate = _command(commands, "migrate", _migrate, "create or update the database")
    _add_database(migrate)

    backup = _command(commands, "backup", _backup, "copy a SQLite database that is in use")
    backup.add_argument("file", type=Path, metavar="FILE", help="a new file")
    _add_database(backup)

    demo = _command(commands, "demo", _demo, "plan a real-size mission and print what came out")
    demo.add_argument("--serve", action="store_true", help="keep serving afterwards")
    demo.add_argument("--out", type=Path, default=Path("demo-output"), help="folder for timelines")

    _add_solve(_command(commands, "solve", _solve, "plan a scenario file, without a service"))

    check = _command(commands, "check", _check, "have the referee judge a timeline of any origin")
    check.add_argument("scenario", type=Path, metavar="SCENARIO.json")
    check.add_argument("timeline", type=_timeline_file, metavar="TIMELINE.{json,csv}")

    _add_keys(_command(commands, "keys", None, "make, list and revoke API keys"))
    _add_plan(_command(commands, "plan", _plan, "have a service plan a scenario, and follow it"))

    _command(commands, "openapi", _openapi, "print the description of the HTTP API")
    return parser


def _command(
    commands: Any,
    name: str,
    run: Command | None,
    help: str,  # noqa: A002
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(name, help=help, description=help)
    parser.set_defaults(command=run)
    return parser


def _add_address(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--host", help="address to listen on (127.0.0.1)")
    parser.add_argument("--port", type=int, help="port to listen on, 0 for a free one (8000)")


def _add_database(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--database-url", help="SQLAlchemy URL (a SQLite file of the user)")


def _add_keys(parser: argparse.ArgumentParser) -> None:
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    create = _command(commands, "create", _create_key, "make a key and print it, this once")
    create.add_argument("--name", required=True, type=_plain_name, help="what the key is for")
    create.add_argument("--owner", required=True, type=_plain_name, help="whose jobs it sees")
    create.add_argument("--scope", required=True, choices=[scope.value for scope in Scope])
    create.add_argument("--expires-days", type=_days, default=365.0, metavar="DAYS", help="(365)")
    _add_database(create)
    _add_database(_command(commands, "list", _list_keys, "list all keys, without their secrets"))
    revoke = _command(commands, "revoke", _revoke_key, "make a key worthless at once")
    revoke.add_argument("key_id", metavar="ID", help="the twelve digits after slw_")
    _add_database(revoke)


def _days(text: str) -> float:
    days = _positive(text)
    if days > _LONGEST_DAYS:
        raise argparse.ArgumentTypeError(f"a key lasts at most {_LONGEST_DAYS} days")
    return days


def _plain_name(text: str) -> str:
    if not is_plain_name(text):
        raise argparse.ArgumentTypeError(f"{text!r} is not 1 to 64 letters, digits, ., _ and -")
    return text


def _add_solve(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", type=Path, metavar="SCENARIO.json")
    _add_search(parser)


def _add_plan(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", type=Path, nargs="?", metavar="SCENARIO.json")
    parser.add_argument("--scenario-id", metavar="ID", help="a stored scenario, not a file")
    _add_search(parser)
    parser.add_argument("--url", help="the service (SLEWLINE_URL, or port 8000 of this machine)")
    parser.add_argument(
        "--key-env", metavar="NAME", help="environment variable with the API key (SLEWLINE_KEY)"
    )
    parser.add_argument("--label", help="a name for the job")
    parser.add_argument("--priority", type=int, help="0 to 9, the most urgent (5)")
    parser.add_argument(
        "--detach", action="store_true", help="print the job's id and do not wait for it"
    )


def _add_search(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--solver", required=True, metavar="NAME")
    parser.add_argument(
        "--param", action="append", default=[], type=_parameter, metavar="KEY=VALUE",
        help="a parameter of the solver, as JSON or as a word; may be repeated",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--time-s", type=_positive, help="seconds after which the search stops")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the timeline here")


def _timeline_file(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in (".json", ".csv"):
        raise argparse.ArgumentTypeError(f"{text!r} must end in .json or .csv")
    return path


def _parameter(text: str) -> tuple[str, Any]:
    """Return name and value of ``KEY=VALUE``.

    >>> _parameter("depth=3"), _parameter("feasibility=penalty")
    (('depth', 3), ('feasibility', 'penalty'))
    """
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise argparse.ArgumentTypeError(f"{text!r} is not KEY=VALUE")
    try:
        return name, json.loads(value)
    except json.JSONDecodeError:
        return name, value


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


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
        raise _WrongInput(f"{option}: {first['msg']}{instead}") from error


def _serve(options: argparse.Namespace) -> int:
    return _run_server(_settings(options), with_workers=True)


def _api(options: argparse.Namespace) -> int:
    return _run_server(_settings(options), with_workers=False)


def _run_server(settings: Settings, *, with_workers: bool) -> int:
    from service.server import CannotServe, NoKey, serve

    try:
        return serve(settings, with_workers=with_workers)
    except NoKey as error:
        raise _WrongInput(str(error)) from error
    except CannotServe as error:
        return _complain(str(error), FAILED)


def _worker(options: argparse.Namespace) -> int:
    from service.jobs.__main__ import run_worker
    from service.jobs.runner import Work
    from service.tracing import CannotTrace

    try:
        run_worker(_settings(options), Work())
    except CannotTrace as error:
        return _complain(str(error), FAILED)


def _migrate(options: argparse.Namespace) -> int:
    from service.server import prepare_database

    prepare_database(_settings(options))
    print("The database is up to date.")
    return OK


def _backup(options: argparse.Namespace) -> int:
    from service.db.backup import CannotBackUp, back_up

    try:
        back_up(_settings(options).database_url, options.file)
    except CannotBackUp as error:
        return _complain(str(error), FAILED)
    print(f"The database is in {options.file}.")
    return OK


def _create_key(options: argparse.Namespace) -> int:
    from service.key_commands import create_key

    create_key(
        _settings(options),
        name=options.name,
        owner=options.owner,
        scope=Scope(options.scope),
        expires_days=options.expires_days,
    )
    return OK


def _list_keys(options: argparse.Namespace) -> int:
    from service.key_commands import list_keys

    list_keys(_settings(options))
    return OK


def _revoke_key(options: argparse.Namespace) -> int:
    from service.key_commands import NoSuchKey, revoke_key

    try:
        revoke_key(_settings(options), options.key_id)
    except NoSuchKey:
        raise _WrongInput(f"there is no key {options.key_id!r}; see slewline keys list") from None
    return OK


def _demo(options: argparse.Namespace) -> int:
    from service.demo import DemoFailed, run_demo

    try:
        return run_demo(_settings(options), folder=options.out, keep_serving=options.serve)
    except DemoFailed as error:
        return _complain(str(error), FAILED)


def _solve(options: argparse.Namespace) -> int:
    from service.scenario_files import place_of
    from service.solve import solve_file

    try:
        return solve_file(
            options.scenario,
            solver=options.solver,
            params=dict(options.param),
            seed=options.seed,
            time_s=options.time_s,
            out=options.out,
        )
    except PlannerError as error:
        place = place_of(error.fault.pointer or "", options.scenario)
        raise _WrongInput(f"{place}: {error.detail}") from error
    except Cancelled:
        return _complain("stopped before there was a plan", FAILED)
    except OSError as error:
        raise _WrongInput(f"{error.filename}: {error.strerror}") from error


def _check(options: argparse.Namespace) -> int:
    from service.check import check_file
    from service.exports.reading import UnreadableTimeline
    from service.scenario_files import place_of

    try:
        return check_file(options.scenario, options.timeline)
    except UnreadableTimeline as error:
        lines = [
            f"{options.timeline} {f'line {f.row}' if f.row else f.pointer or ''}".strip()
            + f": {f.detail}"
            for f in error.faults[:_MOST_FAULTS]
        ]
        left = len(error.faults) - len(lines)
        raise _WrongInput("\n".join(lines + [f"{left} more"] * (left > 0))) from error
    except PlannerError as error:
        place = place_of(error.fault.pointer or "", options.scenario)
        raise _WrongInput(f"{place}: {error.detail}") from error
    except OSError as error:
        raise _WrongInput(f"{error.filename}: {error.strerror}") from error


def _plan(options: argparse.Namespace) -> int:
    from service.client import ClientError
    from service.plan_command import Refused, run_plan

    try:
        return run_plan(options)
    except Refused as error:
        raise _WrongInput(str(error)) from error
    except ClientError as error:
        return _complain(str(error), FAILED)


def _openapi(options: argparse.Namespace) -> int:
    from service.main import create_app

    # The application opens its database at the first request: this one never.
    settings = _settings(options).model_copy(update={"database_url": "sqlite:///unused.db"})
    app = create_app(settings)
    print(json.dumps(app.openapi(), indent=2))
    return OK
