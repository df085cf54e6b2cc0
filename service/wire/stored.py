"""What is stored, read back as it was taken in: an earlier release may have allowed more."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ValidationError

M = TypeVar("M", bound=BaseModel)

_BOUNDS: Final = {"greater_than_equal": "ge", "less_than_equal": "le"}
"""Kinds of errors that a value within its range does not make, and where the range stands."""
_PLAIN_TEXT: Final = "stored"


def from_store(model: type[M], values: Mapping[str, Any]) -> M:
    """Return stored values as their model, those out of today's ranges as they are.

    A value that is out of its range (or a text with characters that are refused today) is kept.
    Everything else has to fit, as everywhere.

    Raises
    ------
    ValidationError
        Where more is wrong than that.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        return beyond_ranges(model.model_validate, values, error)


def from_row(model: type[M], row: object, /, **more: object) -> M:
    """Return a row in a shape: what it has under the names of the shape's fields, and ``more``."""
    names = [name for name in model.model_fields if name not in more and hasattr(row, name)]
    return from_store(model, {name: getattr(row, name) for name in names} | more)


def beyond_ranges(
    validate: Callable[[Any], M], values: Mapping[str, Any], error: ValidationError
) -> M:
    """Return as a model what was refused for its ranges alone; raise the error otherwise."""
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
    """Return a value that would have been taken; None where there is none."""
    if error["type"] == "string_pattern_mismatch":
        return _PLAIN_TEXT
    bound = _BOUNDS.get(error["type"])
    return None if bound is None else error["ctx"][bound]


def _path(values: Any, loc: Sequence[str | int]) -> list[str | int]:
    """Return the steps that lead to a value; the names of a union's members are none."""
    path: list[str | int] = []
    for step in loc:
        if isinstance(values, Mapping) and step not in values:
            continue
        path.append(step)
        values = values[step]
    return path


def _put(whole: object, path: Sequence[str | int], value: object) -> object:
    """Put a value in the place of another, which is returned."""
    for step in path[:-1]:
        whole = _inside(whole)[step]
    place, step = _inside(whole), path[-1]
    before = place[step]
    place[step] = value
    return before


def _inside(part: object) -> Any:
    """Return what holds the fields of a model, as its own freeze does not let them be set."""
    return part.__dict__ if isinstance(part, BaseModel) else part
