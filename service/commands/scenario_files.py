"""What commands read and write: a scenario file in, a timeline out."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import Any

from planner_core.errors import InvalidScenario


def read_object(path: Path) -> dict[str, Any]:
    """Return what a file holds, a scenario say, not yet checked beyond being a JSON object."""
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InvalidScenario("malformed_json", f"{path} is not JSON: {error}.") from error
    if not isinstance(content, dict):
        raise InvalidScenario("malformed_json", f"{path} must hold one JSON object.")
    return content


def require_folder(out: Path) -> None:
    """Refuse a file whose folder is not there: better said before the search than after it."""
    if not out.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "No such folder", str(out.parent))


def place_of(pointer: str, scenario: Path | str) -> str:
    """Return where on the command line or in the file a fault lies.

    >>> place_of("/params/depth", Path("day.json")), place_of("/horizon/end", Path("day.json"))
    ('--param depth', 'day.json /horizon/end')
    """
    if pointer == "/solver":
        return "--solver"
    if pointer.startswith("/params/"):
        return f"--param {pointer.removeprefix('/params/')}"
    return f"{scenario} {pointer}".strip()
