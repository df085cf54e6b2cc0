"""A solver's parameters as JSON: their schema, and conversion in both directions.

A solver is a frozen dataclass whose fields are its parameters. A field's metadata may give
``description``, ``minimum``, ``maximum`` and ``exclusiveMinimum`` as in JSON Schema.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import Field
from types import NoneType, UnionType
from typing import Any, Final, Literal, Union, cast, get_args, get_origin, get_type_hints

from planner_core.errors import InvalidParameters
from planner_core.solvers.base import Solver
from service.problems.faults import pointer_to

_JSON_TYPES: Final[Mapping[object, str]] = {
    bool: "boolean",
    int: "integer",
    float: "number",
    str: "string",
}
_LIMITS: Final[Mapping[str, tuple[Callable[[float, float], bool], str]]] = {
    "minimum": (operator.ge, "{} or more"),
    "exclusiveMinimum": (operator.gt, "greater than {}"),
    "maximum": (operator.le, "{} or less"),
}
_DOCUMENTED: Final = ("description", *_LIMITS)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """The values a parameter takes: one JSON type or a choice, and null if ``nullable``."""

    type: object
    choices: tuple[Any, ...]
    nullable: bool


def params_schema(cls: type[Solver]) -> dict[str, Any]:
    """Return the JSON Schema of a solver's parameters, with defaults and limits."""
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {field.name: _field_schema(cls, field) for field in _fields(cls)},
    }


def parse_params(cls: type[Solver], params: Mapping[str, Any]) -> Solver:
    """Return the solver with these parameters and defaults for the others.

    Raises
    ------
    InvalidParameters
        If a name is unknown or a value does not fit its schema; the pointer names it.
    """
    fields = {field.name: field for field in _fields(cls)}
    for name in params:
        if name not in fields:
            known = ", ".join(fields) or "none"
            detail = f"{cls.name} has no parameter {name!r}; it has: {known}."
            raise _refusal(name, "unknown_parameter_of_solver", detail)
    values = {name: _checked(cls, fields[name], value) for name, value in params.items()}
    try:
        return cls(**values)
    except ValueError as error:
        raise InvalidParameters("invalid_value", str(error), pointer="/params") from error


def params_of(solver: Solver) -> dict[str, Any]:
    """Return all parameters of a solver."""
    return {field.name: getattr(solver, field.name) for field in _fields(type(solver))}


def _fields(cls: type[Solver]) -> tuple[Field[Any], ...]:
    return dataclasses.fields(cast(Any, cls))


def _field_schema(cls: type[Solver], field: Field[Any]) -> dict[str, Any]:
    kind = _kind(cls, field)
    schema: dict[str, Any] = {}
    if kind.choices:
        schema["enum"] = [*kind.choices, *([None] if kind.nullable else [])]
    else:
        json_type = _JSON_TYPES[kind.type]
        schema["type"] = [json_type, "null"] if kind.nullable else json_type
    schema |= {key: field.metadata[key] for key in _DOCUMENTED if key in field.metadata}
    return schema | {"default": field.default}


def _kind(cls: type[Solver], field: Field[Any]) -> _Kind:
    hint = get_type_hints(cls)[field.name]
    options = set(get_args(hint)) if get_origin(hint) in (Union, UnionType) else {hint}
    nullable = NoneType in options
    (only,) = options - {NoneType}
    choices = get_args(only) if get_origin(only) is Literal else ()
    if not choices and only not in _JSON_TYPES:
        raise TypeError(f"{cls.__name__}.{field.name}: {only!r} has no form in JSON")
    return _Kind(type=only, choices=choices, nullable=nullable)


def _checked(cls: type[Solver], field: Field[Any], value: object) -> object:
    kind = _kind(cls, field)
    if value is None and kind.nullable:
        return None
    if kind.choices:
        if not any(value == choice and type(value) is type(choice) for choice in kind.choices):
            allowed = ", ".join(repr(choice) for choice in kind.choices)
            raise _refusal(field.name, "unknown_value", f"{value!r} is not one of {allowed}.")
        return value
    if kind.type is float and type(value) is int:
        value = float(value)
    if type(value) is not kind.type:
        detail = f"{value!r} is not of type {_JSON_TYPES[kind.type]}."
        raise _refusal(field.name, "invalid_value", detail)
    if isinstance(value, int | float):
        _check_limits(field, value)
    return value


def _check_limits(field: Field[Any], value: float) -> None:
    if not math.isfinite(value):
        raise _refusal(field.name, "not_finite", "NaN and infinity are refused.")
    for name, (is_within, words) in _LIMITS.items():
        limit = field.metadata.get(name)
        if limit is not None and not is_within(value, limit):
            detail = f"{value!r} must be {words.format(limit)}."
            raise _refusal(field.name, "value_out_of_range", detail)


def _refusal(name: str, code: str, detail: str) -> InvalidParameters:
    return InvalidParameters(code, detail, pointer=pointer_to("params", name))
