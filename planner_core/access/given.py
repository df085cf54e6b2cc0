"""Opportunities at given spans: what was planned or flown, even if accesses have moved since."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Final, NamedTuple

import numpy as np

from planner_core.access import opportunities as tasks
from planner_core.domain import Scenario
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites
from planner_core.problem import COLLECT, CONTACT, Ints, Longs, Opportunities
from planner_core.problem.slew import TIME_TOLERANCE_S

MOST_MOVED_S: Final = 60.0
"""How far newer elements may move an access's edge; a task further out is not in that pass."""


class Given(NamedTuple):
    """A task at a span of its own, in seconds from the horizon's start."""

    satellite: int
    kind: int
    site: int
    start_s: float
    end_s: float


class WithGiven(NamedTuple):
    """A table with the given tasks added.

    Attributes
    ----------
    origin
        For each row, the same row of the original table, or the nearest one. Shape ``(n,)``.
    missing
        Indices of the given tasks that have no access.
    """

    table: Opportunities
    origin: Ints
    missing: tuple[int, ...]


def with_given(scenario: Scenario, table: Opportunities, given: Sequence[Given]) -> WithGiven:
    """Return the table with each of these tasks added at its own span, in an access that it fits.

    Existing rows stay as they are, and a task that is one of them is not added again. The access of
    an added row is extended to contain its task.
    """
    found, missing = {}, []
    for number, task in enumerate(given):
        rows = _touched(table, task)
        if len(rows) == 0:
            missing.append(number)
            continue
        nearest = int(rows[np.argmin(np.abs(table.start_s[rows] - task.start_s))])
        if not _is_at(table, nearest, task):
            found[number] = nearest
    every = np.arange(len(table), dtype=np.int32)
    if not found:
        return WithGiven(table, every, tuple(missing))
    rows = np.array(list(found.values()), dtype=np.int32)
    own = [given[number] for number in found]
    columns = _columns(own, table.access[rows])
    columns["access_start_s"] = np.minimum(columns["start_s"], table.access_start_s[rows])
    columns["access_end_s"] = np.maximum(columns["end_s"], table.access_end_s[rows])
    seen = _seen(scenario, own, columns)
    joined = {
        field.name: np.concatenate([getattr(table, field.name), getattr(seen, field.name)])
        for field in fields(Opportunities)
    }
    joined["origin"] = np.concatenate([every, rows])
    ordered = tasks.in_order(
        [joined], [t.id for t in scenario.targets], [s.id for s in scenario.ground_stations]
    )
    origin = ordered.pop("origin").astype(np.int32)
    return WithGiven(Opportunities(**ordered), origin, tuple(missing))


def table_of(scenario: Scenario, given: Sequence[Given]) -> Opportunities:
    """Return the table of these tasks alone, in this order, each with an access of its own span."""
    columns = _columns(given, np.arange(len(given)))
    columns["access_start_s"], columns["access_end_s"] = columns["start_s"], columns["end_s"]
    return _seen(scenario, given, columns)


def _touched(table: Opportunities, task: Given) -> Longs:
    """Return the rows whose access, widened by ``MOST_MOVED_S`` at each end, contains a task."""
    return np.flatnonzero(
        (table.satellite == task.satellite)
        & (table.kind == task.kind)
        & (table.site == task.site)
        & (table.access_start_s - MOST_MOVED_S <= task.start_s)
        & (table.access_end_s + MOST_MOVED_S >= task.end_s)
    )


def _is_at(table: Opportunities, row: int, task: Given) -> bool:
    return bool(
        abs(table.start_s[row] - task.start_s) <= TIME_TOLERANCE_S
        and abs(table.end_s[row] - task.end_s) <= TIME_TOLERANCE_S
    )


def _columns(given: Sequence[Given], access: Longs | Ints) -> tasks.Columns:
    types = (np.int32, np.int8, np.int32, np.float64, np.float64)
    columns: tasks.Columns = {
        name: np.array([getattr(task, name) for task in given], dtype=dtype)
        for name, dtype in zip(Given._fields, types, strict=True)
    }
    return columns | {"access": np.asarray(access, dtype=np.int32)}


def _seen(scenario: Scenario, given: Sequence[Given], columns: tasks.Columns) -> Opportunities:
    described = tasks.Described(columns)
    sites = {COLLECT: Sites.of(scenario.targets), CONTACT: Sites.of(scenario.ground_stations)}
    for index in sorted({task.satellite for task in given}):
        satellite = scenario.satellites[index]
        path = propagate(satellite, scenario.horizon)
        for kind in sorted({task.kind for task in given if task.satellite == index}):
            described.fill(
                index, kind, path, sites[kind], satellite.sensor.nadir,
                with_rates=satellite.agility.tracks,
            )  # fmt: skip
    return described.table()
