"""The program ``slewline``: one command for each way to run the service."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import planner_core
from service.access.callers import Scope, is_plain_name
from service.commands.outcome import FAILED, WRONG_INPUT, Failed, WrongInput
from service.process.imports import importing

_LONGEST_DAYS = 3650


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 0 success, 1 failure, 2 wrong input."""
    options = _parser().parse_args(arguments)
    module, _, function = options.command.partition(":")
    try:
        # Imported only now: some commands need slow imports.
        with importing():
            command = import_module(f"service.commands.{module}")
        status: int = getattr(command, function)(options)
        return status
    except WrongInput as error:
        return _complain(str(error), WRONG_INPUT)
    except Failed as error:
        return _complain(str(error), FAILED)
    except KeyboardInterrupt:
        return _complain("interrupted", FAILED)
    except Exception as error:
        reason = _why_database_failed(error)
        if reason is None:
            raise
        return _complain(reason, FAILED)


def _complain(message: str, status: int) -> int:
    """Print what went wrong; return the status."""
    print(f"slewline: {message}", file=sys.stderr)
    return status


def _why_database_failed(error: BaseException) -> str | None:
    """Return why the database could not serve, or None if something else went wrong."""
    if "sqlalchemy" not in sys.modules:
        return None
    from service.db.failures import why_unavailable

    return why_unavailable(error)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="slewline",
        description="Operations planning for agile Earth-observation satellites.",
        epilog="Each setting is also an environment variable: SLEWLINE_PORT and so on.",
    )
    parser.add_argument("--version", action="version", version=planner_core.__version__)
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    serve = _command(commands, "serve", "serving:serve", "run the API and local workers")
    serve.set_defaults(with_workers=True)
    _add_address(serve)
    serve.add_argument("--workers", type=int, help="worker processes (2)")
    _add_database(serve)

    api = _command(commands, "api", "serving:serve", "run the API alone")
    api.set_defaults(with_workers=False)
    _add_address(api)
    _add_database(api)

    _add_database(_command(commands, "worker", "serving:worker", "run one worker"))
    _add_database(_command(commands, "migrate", "serving:migrate", "create or update the database"))

    backup = _command(commands, "backup", "serving:backup", "copy a SQLite database that is in use")
    backup.add_argument("file", type=Path, metavar="FILE", help="a new file")
    _add_database(backup)

    demo = _command(commands, "demo", "demo:demo", "plan a real-size mission and print the results")
    demo.add_argument("--serve", action="store_true", help="keep serving afterwards")
    demo.add_argument("--out", type=Path, default=Path("demo-output"), help="folder for timelines")

    solve = _command(commands, "solve", "solve:solve", "plan a scenario file, without a service")
    solve.add_argument("scenario", type=Path, metavar="SCENARIO.json")
    _add_search(solve)

    check = _command(
        commands, "check", "check:check", "have the referee judge a timeline from any source"
    )
    check.add_argument("scenario", type=Path, metavar="SCENARIO.json")
    check.add_argument("timeline", type=_timeline_file, metavar="TIMELINE.{json,csv}")

    spacing = _command(
        commands, "compare-spacing", "compare_spacing:compare_spacing",
        "show what more starts in each access gain for a scenario file",
    )  # fmt: skip
    spacing.add_argument(
        "--spacing-s", action="append", type=_positive, metavar="SECONDS",
        help="time between the starts in an access; may be repeated (60, 30 and 15)",
    )  # fmt: skip
    spacing.add_argument("scenario", type=Path, metavar="SCENARIO.json")
    _add_search(spacing, solver="certified", time_s=60.0, out="write the table here, as CSV")

    _add_keys(_command(commands, "keys", "", "make, list and revoke API keys"))
    _add_plan(commands)
    _add_replan(commands)

    _command(commands, "openapi", "serving:openapi", "print the description of the HTTP API")
    return parser


def _command(
    commands: Any,
    name: str,
    run: str,
    help: str,  # noqa: A002 - as argparse names it
) -> argparse.ArgumentParser:
    """Add a command, run by the function ``module:function`` of this package."""
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
    create = _command(
        commands, "create", "key_commands:create_key", "make a key and print it, only this once"
    )
    create.add_argument("--name", required=True, type=_plain_name, help="what the key is for")
    create.add_argument("--owner", required=True, type=_plain_name, help="whose jobs it sees")
    create.add_argument("--scope", required=True, choices=[scope.value for scope in Scope])
    create.add_argument("--expires-days", type=_days, default=365.0, metavar="DAYS", help="(365)")
    _add_database(create)
    listing = _command(
        commands, "list", "key_commands:list_keys", "list all keys, without their secrets"
    )
    _add_database(listing)
    revoke = _command(commands, "revoke", "key_commands:revoke_key", "revoke a key at once")
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


def _add_plan(commands: Any) -> None:
    about = "have a service plan a scenario, and follow it"
    parser = _command(commands, "plan", "plan:plan", about)
    parser.add_argument("scenario", type=Path, nargs="?", metavar="SCENARIO.json")
    parser.add_argument("--scenario-id", metavar="ID", help="a stored scenario instead of a file")
    _add_search(parser)
    _add_service(parser)
    parser.add_argument("--label", help="a name for the job")
    parser.add_argument("--priority", type=int, help="0 to 9; 9 is the most urgent (5)")


def _add_replan(commands: Any) -> None:
    about = "have a service replan after what happened"
    parser = _command(commands, "replan", "plan:replan", about)
    parser.add_argument("plan_id", metavar="PLAN", help="the id of the plan to replan")
    parser.add_argument(
        "happened", type=Path, nargs="?", metavar="HAPPENED.json",
        help="outages, executions, promises, add_targets ..., as in the API",
    )  # fmt: skip
    parser.add_argument(
        "--now", metavar="INSTANT", help="actions that start before it stay (the service's time)"
    )
    parser.add_argument("--name", help="a name for the new plan")
    parser.add_argument("--time-s", type=_positive, help="seconds after which the search stops")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the timeline here")
    _add_service(parser)


def _add_service(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--url", help="the service (SLEWLINE_URL, or port 8000 of this machine)")
    parser.add_argument(
        "--key-env", metavar="NAME", help="environment variable with the API key (SLEWLINE_KEY)"
    )
    parser.add_argument(
        "--detach", action="store_true", help="print the job's id and do not wait for it"
    )


def _add_search(
    parser: argparse.ArgumentParser,
    solver: str | None = None,
    time_s: float | None = None,
    out: str = "write the timeline here",
) -> None:
    parser.add_argument(
        "--solver", required=solver is None, default=solver, metavar="NAME",
        help=f"({solver})" if solver else None,
    )  # fmt: skip
    parser.add_argument(
        "--param", action="append", default=[], type=_parameter, metavar="KEY=VALUE",
        help="a parameter of the solver, as JSON or as a word; may be repeated",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0)
    usual = f" ({time_s:g})" if time_s else ""
    parser.add_argument(
        "--time-s", type=_positive, default=time_s,
        help=f"seconds after which the search stops{usual}",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="FILE", help=out)


def _timeline_file(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in (".json", ".csv"):
        raise argparse.ArgumentTypeError(f"{text!r} must end in .json or .csv")
    return path


def _parameter(text: str) -> tuple[str, Any]:
    """Return the name and value in ``KEY=VALUE``.

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
