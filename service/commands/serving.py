"""Commands that run the service or a part of it, and the settings that they share.

Modules that are slow to import are imported by the command that needs them.
"""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from service.commands.outcome import OK, Failed, WrongInput
from service.process.imports import importing

if TYPE_CHECKING:
    from service.settings import Settings


def settings_of(options: argparse.Namespace) -> Settings:
    """Return the settings of the environment, overridden by the options given."""
    from pydantic import SecretStr, ValidationError

    from service.settings import Settings

    given = {name: value for name, value in vars(options).items() if name in Settings.model_fields}
    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        first = error.errors()[0]
        name = str(first["loc"][0])
        option = f"--{name.replace('_', '-')}" if name in given else f"SLEWLINE_{name.upper()}"
        # A setting that holds secrets is never repeated.
        is_secret = Settings.model_fields[name].annotation is SecretStr
        instead = "" if is_secret else f", not {first['input']!r}"
        raise WrongInput(f"{option}: {first['msg']}{instead}") from error


def serve(options: argparse.Namespace) -> int:
    """Run the API, ``with_workers`` or on its own."""
    with importing():
        from service import server
        from service.process.tracing import CannotTrace

    try:
        return server.serve(settings_of(options), with_workers=options.with_workers)
    except server.NoKey as error:
        raise WrongInput(str(error)) from error
    except (server.CannotServe, CannotTrace) as error:
        raise Failed(str(error)) from error


def worker(options: argparse.Namespace) -> int:
    """Run one worker."""
    from service.jobs.__main__ import run_worker
    from service.jobs.runner import Work
    from service.process.tracing import CannotTrace

    try:
        run_worker(settings_of(options), Work())
    except CannotTrace as error:
        raise Failed(str(error)) from error


def migrate(options: argparse.Namespace) -> int:
    """Create or update the database."""
    from service.server import prepare_database

    prepare_database(settings_of(options))
    print("The database is up to date.")
    return OK


def backup(options: argparse.Namespace) -> int:
    """Copy a SQLite database that is in use."""
    from service.db.backup import CannotBackUp, back_up

    try:
        back_up(settings_of(options).database_url, options.file)
    except CannotBackUp as error:
        raise Failed(str(error)) from error
    print(f"The database is in {options.file}.")
    return OK


def openapi(options: argparse.Namespace) -> int:
    """Print the description of the HTTP API."""
    from service.main import create_app

    # The application opens its database only at the first request, which never comes here.
    settings = settings_of(options).model_copy(update={"database_url": "sqlite:///unused.db"})
    app = create_app(settings)
    print(json.dumps(app.openapi(), indent=2))
    return OK
