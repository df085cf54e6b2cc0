"""A scenario's pins, outages and frozen actions, compiled into its problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner_core.domain import Replan, Scenario
from planner_core.pinning.apply_pins import apply_pins, rows_in_outages
from planner_core.pinning.pinned_starts import (
    open_when_turned_to,
    whole_accesses,
    with_pinned_starts,
)
from planner_core.pinning.rows_meant import KINDS, Named, row_of, rows_of_base, rows_skipped
from planner_core.problem import (
    CONTACT,
    Blocked,
    Kept,
    Pinned,
    Problem,
)
from planner_core.problem.delivery import least_age_s
from planner_core.problem.slew import TIME_TOLERANCE_S


def pinned_problem(scenario: Scenario, problem: Problem) -> Problem:
    """Return the problem of a scenario with pins and first turns compiled in.

    Raises
    ------
    InvalidScenario
        ``pin_without_opportunity``, ``pin_ambiguous``, ``pins_conflict`` or
        ``pin_breaks_limits``, with a pointer into ``/pins``.
    """
    has_heading = any(satellite.heading is not None for satellite in problem.satellites)
    asked = scenario.pins or scenario.outages or scenario.replan
    if not (asked or has_heading or problem.on_board):
        return problem
    pins, table = scenario.pins, problem.opportunities
    whole = table if problem.pointing is None else whole_accesses(problem)
    named = Named(scenario, whole, problem.origin)
    kept = [row_of(named, pin, f"/pins/keep/{i}") for i, pin in enumerate(pins.keep)]
    skipped = [rows_skipped(named, pin, f"/pins/skip/{i}") for i, pin in enumerate(pins.skip)]
    if problem.pointing is not None:
        accesses = [table.access[rows] for rows in skipped]
        problem, kept = with_pinned_starts(scenario, problem, kept)
        problem, kept = open_when_turned_to(problem, kept)
        skipped = [
            np.flatnonzero(np.isin(problem.opportunities.access, own)).tolist() for own in accesses
        ]
    pinned = resolve(scenario, kept, skipped)
    if scenario.replan is not None:
        pinned = with_frozen(scenario, problem, pinned, scenario.replan)
    return apply_pins(problem, pinned)


def with_frozen(scenario: Scenario, problem: Problem, pinned: Pinned, replan: Replan) -> Pinned:
    """Return the pins with what is frozen, and without images too late for their promise.

    An action of the base that an outage rules out, or that is no longer offered, is not kept.
    """
    table = problem.opportunities
    frozen_until_s = scenario.horizon.offset_s(replan.freeze_until)
    in_outage = rows_in_outages(problem, pinned)
    rows = rows_of_base(scenario, table, replan)
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    offset_s, down_s = scenario.horizon.offset_s, None
    late: dict[int, str] = {}
    for i, promise in enumerate(replan.promises):
        own = problem.collects_of(targets[promise.target_id])
        is_late = np.zeros(len(own), dtype=np.bool_)
        if promise.image_by is not None:
            is_late |= table.end_s[own] > offset_s(promise.image_by) + TIME_TOLERANCE_S
        if promise.deliver_by is not None:
            # The earliest possible delivery, whatever the plan.
            down_s = table.end_s + least_age_s(problem) if down_s is None else down_s
            is_late |= down_s[own] > offset_s(promise.deliver_by) + TIME_TOLERANCE_S
        late |= {int(row): f"/replan/promises/{i}" for row in own[is_late]}
    pinned = replace(pinned, frozen_until_s=frozen_until_s, skipped={**late, **pinned.skipped})
    return replace(
        pinned,
        kept=(
            *pinned.kept,
            *(
                Kept(row=row, pointer=f"/replan/base/{i}")
                for i, row in rows.items()
                if pinned.is_frozen(_start_s(scenario, replan, i)) and not in_outage[row]
            ),
        ),
    )


def _start_s(scenario: Scenario, replan: Replan, number: int) -> float:
    start = replan.base[number].start
    assert start is not None
    return scenario.horizon.offset_s(start)


def resolve(scenario: Scenario, kept: Sequence[int], skipped: Sequence[Sequence[int]]) -> Pinned:
    """Return the scenario's pins in terms of its problem, given the rows that they mean."""
    pins = scenario.pins
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    offset_s = scenario.horizon.offset_s
    return Pinned(
        kept=tuple(Kept(row=row, pointer=f"/pins/keep/{i}") for i, row in enumerate(kept)),
        skipped={row: f"/pins/skip/{i}" for i, rows in enumerate(skipped) for row in rows},
        blocked=(
            *(
                Blocked(
                    satellite=satellites[pin.satellite_id],
                    start_s=offset_s(pin.start),
                    end_s=offset_s(pin.end),
                    kinds=frozenset(KINDS[mode] for mode in pin.modes),
                    pointer=f"/pins/block/{i}",
                )
                for i, pin in enumerate(pins.block)
            ),
            *_outages(scenario),
        ),
        forbidden=frozenset(targets[target_id] for target_id in pins.forbid),
    )


def _outages(scenario: Scenario) -> Iterator[Blocked]:
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    stations = {station.id: i for i, station in enumerate(scenario.ground_stations)}
    for i, outage in enumerate(scenario.outages):
        is_station = outage.station_id is not None
        yield Blocked(
            satellite=None if outage.satellite_id is None else satellites[outage.satellite_id],
            station=None if outage.station_id is None else stations[outage.station_id],
            start_s=scenario.horizon.offset_s(outage.start),
            end_s=scenario.horizon.offset_s(outage.end),
            kinds=frozenset({CONTACT} if is_station else (KINDS[mode] for mode in outage.modes)),
            pointer=f"/outages/{i}",
        )
