"""What commands read and write: a scenario file in, a timeline out."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from planner_core.errors import Cancelled, InvalidScenario, PlannerError
from service.commands.outcome import Failed, WrongInput


@contextmanager
def told_of(scenario: Path | str) -> Iterator[None]:
    """Report errors in a scenario file, or in the options of its search."""
    try:
        yield
    except PlannerError as error:
        place = place_of(error.fault.pointer or "", scenario)
        raise WrongInput(f"{place}: {error.detail}") from error
    except Cancelled as error:
        raise Failed("stopped before there was a plan") from error
    except OSError as error:
        raise WrongInput(f"{error.filename}: {error.strerror}") from error


def read_object(path: Path) -> dict[str, Any]:
    """Return the JSON object in a file, for example a scenario, without further checks."""
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InvalidScenario("malformed_json", f"{path} is not JSON: {error}.") from error
    if not isinstance(content, dict):
        raise InvalidScenario("malformed_json", f"{path} must hold one JSON object.")
    return content


def require_folder(out: Path | None) -> None:
    """Refuse a file whose folder does not exist, before the search rather than after it."""
    if out is not None and not out.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "No such folder", str(out.parent))


def place_of(pointer: str, scenario: Path | str) -> str:
    """Return where on the command line or in the file a fault is.

    >>> place_of("/params/depth", Path("day.json")), place_of("/horizon/end", Path("day.json"))
    ('--param depth', 'day.json /horizon/end')
    """
    if pointer == "/solver":
        return "--solver"
    if pointer.startswith("/params/"):
        return f"--param {pointer.removeprefix('/params/')}"
    return f"{scenario} {pointer}".strip()
