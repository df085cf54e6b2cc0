"""Reading stored values back unchanged: an earlier release may have allowed a wider range."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ValidationError

M = TypeVar("M", bound=BaseModel)

_BOUNDS: Final = {"greater_than_equal": "ge", "less_than_equal": "le"}
"""Range errors of Pydantic, each with the name of the limit in the error's context."""
_PLAIN_TEXT: Final = "stored"


def from_store(model: type[M], values: Mapping[str, Any]) -> M:
    """Return stored values as their model, keeping those out of today's ranges.

    A text with characters that are refused today is kept as well. Everything else must be valid.

    Raises
    ------
    ValidationError
        If anything else is wrong.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        return beyond_ranges(model.model_validate, values, error)


def from_row(model: type[M], row: object, /, **more: object) -> M:
    """Return a model of the row's attributes that are named like its fields, and of ``more``."""
    names = [name for name in model.model_fields if name not in more and hasattr(row, name)]
    return from_store(model, {name: getattr(row, name) for name in names} | more)


def beyond_ranges(
    validate: Callable[[Any], M], values: Mapping[str, Any], error: ValidationError
) -> M:
    """Return values refused only for their ranges as a model; raise the error otherwise."""
    faults = error.errors(include_url=False)
    if any(_stand_in(each) is None for each in faults):
        raise error
    fitting = copy.deepcopy(dict(values))
    paths = [_path(fitting, each["loc"]) for each in faults]
    kept = [_put(fitting, path, _stand_in(each)) for path, each in zip(paths, faults, strict=True)]
    found = validate(fitting)
    for path, value in zip(paths, kept, strict=True):
        _put(found, path, value)
    return found


def _stand_in(error: Any) -> object:
    """Return a value that would have been accepted; None if the error is of another kind."""
    if error["type"] == "string_pattern_mismatch":
        return _PLAIN_TEXT
    bound = _BOUNDS.get(error["type"])
    return None if bound is None else error["ctx"][bound]


def _path(values: Any, loc: Sequence[str | int]) -> list[str | int]:
    """Return the keys that lead to a value, without the names of a union's members."""
    path: list[str | int] = []
    for step in loc:
        if isinstance(values, Mapping) and step not in values:
            continue
        path.append(step)
        values = values[step]
    return path


def _put(whole: object, path: Sequence[str | int], value: object) -> object:
    """Replace a value and return the previous one."""
    for step in path[:-1]:
        whole = _inside(whole)[step]
    place, step = _inside(whole), path[-1]
    before = place[step]
    place[step] = value
    return before


def _inside(part: object) -> Any:
    """Return the mapping that holds a model's fields, as the frozen model does not set them."""
    return part.__dict__ if isinstance(part, BaseModel) else part
