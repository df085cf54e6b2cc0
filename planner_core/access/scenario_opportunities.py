"""The opportunities of a scenario: computed from geometry, and stored.

They depend on no solver, so each scenario needs them only once. Stored ones are told apart from
those of other versions of the code by the sources they depend on (``planner_core.sources``).
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from dataclasses import dataclass, fields, replace
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.access import opportunities as tasks
from planner_core.access.eligibility import Eligibility
from planner_core.access.limits import Limits, TargetLimits
from planner_core.access.passes import (
    PlacedContacts,
    contacts_of,
    downlinks_of,
    with_halves_to_share,
)
from planner_core.access.windows import Accesses, find_accesses
from planner_core.budget import Budget, Progress
from planner_core.domain import Scenario, Sensor
from planner_core.orbits.checks import orbit_warnings
from planner_core.orbits.eclipse import sunlight
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.sites import Sites, View, view
from planner_core.problem import (
    ACCESS_FOUND,
    ACCESS_TOO_SHORT,
    BETWEEN_STARTS,
    COLLECT,
    CONTACT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    OUTSIDE_TIMES,
    WRONG_SENSOR_TYPE,
    Downlinks,
    Floats,
    Longs,
    Opportunities,
    Sunlight,
)

Codes = npt.NDArray[np.int8]

_NODES_KEPT: Final = 200_000
"""Of paths, 144 bytes each: as many as 20 satellites have over a week."""
_SAMPLE: Final = 4096  # rows
_WORTH_IT: Final = 0.8

_REASONS = np.array(
    [
        NEVER_VISIBLE, WRONG_SENSOR_TYPE, OUTSIDE_LIMITS, ACCESS_TOO_SHORT, OUTSIDE_TIMES,
        BETWEEN_STARTS, ACCESS_FOUND,
    ],
    dtype=np.int8,
)  # fmt: skip
"""From the farthest from having a collect to the nearest."""
_RANK = {int(reason): rank for rank, reason in enumerate(_REASONS)}


class KnownRates(NamedTuple):
    """Downlink rates of the contacts of one scenario; in another, stations may differ."""

    scenario: Scenario
    downlinks: Downlinks


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScenarioOpportunities:
    """All that geometry determines about a scenario; computed once, stored, used by any solver.

    Attributes
    ----------
    opportunities
        The table that every solver plans with.
    target_access
        Why a target has no collect, or ``ACCESS_FOUND``. Shape ``(num_targets,)``.
    sunlight
        One per satellite, even if its battery model ignores eclipses.
    warnings
        Sentences for people.
    rates
        Downlink rates of its contacts, if at hand; they are not stored.
    """

    opportunities: Opportunities
    target_access: Codes
    sunlight: tuple[Sunlight, ...]
    warnings: tuple[str, ...]
    rates: KnownRates | None = None

    def downlinks_of(self, scenario: Scenario) -> Downlinks:
        """Return the contacts' downlink rates in a scenario with these opportunities."""
        if self.rates is not None and self.rates.scenario is scenario:
            return self.rates.downlinks
        return downlinks_of(scenario, self.opportunities)

    def to_bytes(self, *, compress: bool = True) -> bytes:
        """Return a form that ``from_bytes`` reads back bit for bit."""
        lit = self.sunlight
        columns = {
            field.name: getattr(self.opportunities, field.name) for field in fields(Opportunities)
        }
        columns |= {
            "target_access": self.target_access,
            "lit_counts": np.array([len(s.enter_s) for s in lit], dtype=np.int64),
            "lit_enter_s": np.concatenate([np.empty(0), *(s.enter_s for s in lit)]),
            "lit_exit_s": np.concatenate([np.empty(0), *(s.exit_s for s in lit)]),
            "warnings": np.frombuffer(json.dumps(self.warnings).encode(), dtype=np.uint8),
        }
        buffer = io.BytesIO()
        # Like np.savez_compressed, in half the time: higher levels hardly shrink such numbers.
        method = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED
        with zipfile.ZipFile(buffer, "w", method, compresslevel=1) as archive:
            for name, values in columns.items():
                # A member given as a ZipInfo of its own is stored uncompressed.
                file = f"{name}.npy" if _shrinks(values) else zipfile.ZipInfo(f"{name}.npy")
                with archive.open(file, "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, values, allow_pickle=False)
        return buffer.getvalue()

    @classmethod
    def from_bytes(cls, stored: bytes) -> ScenarioOpportunities:
        """Return what ``to_bytes`` stored."""
        with np.load(io.BytesIO(stored), allow_pickle=False) as columns:
            cuts = np.cumsum(columns["lit_counts"])[:-1]
            enter_s = np.split(columns["lit_enter_s"], cuts)
            exit_s = np.split(columns["lit_exit_s"], cuts)
            return cls(
                opportunities=Opportunities(
                    **{field.name: columns[field.name] for field in fields(Opportunities)}
                ),
                target_access=columns["target_access"],
                sunlight=tuple(
                    Sunlight(enter_s=enter, exit_s=leave)
                    for enter, leave in zip(enter_s, exit_s, strict=True)
                ),
                warnings=tuple(json.loads(columns["warnings"].tobytes())),
            )


def _shrinks(values: npt.NDArray[Any]) -> bool:
    """Return whether a column is worth the time to compress, judged by how its beginning shrinks.

    Angles and lines of sight, two thirds of the table, shrink by only a tenth.
    """
    sample = values[:_SAMPLE].tobytes()
    return len(zlib.compress(sample, 1)) < _WORTH_IT * len(sample)


def compute_opportunities(scenario: Scenario, budget: Budget) -> ScenarioOpportunities:
    """Return every opportunity of a scenario, computed satellite by satellite.

    Raises
    ------
    PropagationFailed
        SGP4 stops before the end of the horizon.
    InvalidScenario
        ``too_many_opportunities`` or ``orbit_outside_span``.
    Cancelled
        The budget was spent first; there is no partial answer.
    """
    sites = _sites(scenario)
    kinds = (COLLECT, CONTACT) if scenario.use_resources else (COLLECT,)
    collects = _Collects(scenario, sites[COLLECT])
    contact = Limits.of_stations(scenario.ground_stations)
    paths = _Paths(scenario)
    contacts: list[PlacedContacts] = []
    before_contacts: list[int] = []  # number of accesses before each satellite's passes
    parts: list[tasks.Columns] = []
    lit: list[Sunlight] = []
    num_accesses = num_rows = 0
    num_steps = 2 * len(scenario.satellites)
    for index, satellite in enumerate(scenario.satellites):
        budget.proceed(Progress(phase="access", fraction=index / num_steps))
        path = paths.of(index)
        found, placed = collects.placed(satellite.sensor, path, budget)
        parts.append(tasks.rows_of(index, COLLECT, found, num_accesses, placed))
        num_accesses += len(found)
        num_rows += len(placed[0])
        tasks.check_number(num_rows)
        if scenario.use_resources:
            found = find_accesses(path, sites[CONTACT], contact, budget.stop)
            contacts.append(contacts_of(scenario, satellite, path, sites[CONTACT], found))
            before_contacts.append(num_accesses)
            num_accesses += len(found)
        lit.append(sunlight(path))
    offered = with_halves_to_share(contacts, scenario.ground_stations)
    for index, placed in enumerate(offered):
        passes, before = contacts[index].passes, before_contacts[index]
        parts.append(tasks.rows_of(index, CONTACT, passes, before, placed))
        num_rows += len(placed[0])
        tasks.check_number(num_rows)
    described = tasks.Described(
        tasks.in_order(
            parts, [t.id for t in scenario.targets], [s.id for s in scenario.ground_stations]
        )
    )
    del parts
    for index, satellite in enumerate(scenario.satellites):
        budget.proceed(Progress(phase="access", fraction=0.5 + index / num_steps))
        path = paths.of(index)
        collects.note_visible(satellite.sensor, path)
        for kind in kinds:
            described.fill(
                index, kind, path, sites[kind], satellite.sensor.nadir,
                with_rates=satellite.agility.tracks,
            )  # fmt: skip
    budget.proceed(Progress(phase="access", fraction=1.0))
    table = described.table()
    return ScenarioOpportunities(
        opportunities=table,
        target_access=_REASONS[collects.closeness],
        sunlight=tuple(lit),
        warnings=orbit_warnings(scenario),
        rates=KnownRates(scenario, downlinks_of(scenario, table, contacts)),
    )


class _Paths:
    """The paths of a scenario's satellites, each needed twice.

    At most ``_NODES_KEPT`` nodes are kept between: a constellation's month would be a gigabyte.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._kept: dict[int, Ephemeris] = {}
        self._num_nodes = 0

    def of(self, index: int) -> Ephemeris:
        """Return the path of a satellite."""
        path = self._kept.get(index)
        if path is None:
            path = propagate(self._scenario.satellites[index], self._scenario.horizon)
            if self._num_nodes + len(path.gmst_rad) <= _NODES_KEPT:
                self._kept[index] = path
                self._num_nodes += len(path.gmst_rad)
        return path


def _sites(scenario: Scenario) -> dict[int, Sites]:
    return {
        COLLECT: Sites.of(scenario.targets),
        CONTACT: Sites.of(scenario.ground_stations),
    }


def view_at(scenario: Scenario, table: Opportunities, rows: Longs, t_s: Floats) -> View:
    """Return the geometry of some opportunities at other instants than their middle.

    Parameters
    ----------
    table, rows
        The scenario's opportunities, and which of them.
    t_s
        One instant for each of the rows, in the horizon.
    """
    sites = _sites(scenario)
    seen = {field.name: np.empty(len(rows)) for field in fields(View)}
    for index in np.unique(table.satellite[rows]):
        satellite = scenario.satellites[index]
        path = propagate(satellite, scenario.horizon)
        for kind in (COLLECT, CONTACT):
            own = np.flatnonzero((table.satellite[rows] == index) & (table.kind[rows] == kind))
            there = sites[kind].at(table.site[rows[own]])
            part = view(path, there, t_s[own], satellite.sensor.nadir)
            for name, values in seen.items():
                values[own] = getattr(part, name)
    in_eclipse = seen.pop("in_eclipse") > 0.0
    return View(in_eclipse=in_eclipse, **seen)


class _Collects:
    """Finds and places the collects of one satellite after another.

    ``closeness`` holds, for each target, how near any satellite has come to a collect of it, as an
    index of ``_REASONS``.
    """

    def __init__(self, scenario: Scenario, sites: Sites):
        self.closeness = np.zeros(len(scenario.targets), dtype=np.int64)
        self._scenario = scenario
        self._sites = sites
        self._limits = TargetLimits.of(scenario.targets)
        self._eligibility = Eligibility.of(scenario.targets, scenario.horizon)

    def placed(
        self, sensor: Sensor, path: Ephemeris, budget: Budget
    ) -> tuple[Accesses, tasks.Placed]:
        """Return a satellite's accesses within the targets' times, and the collects in them."""
        scenario, targets = self._scenario, self._scenario.targets
        served = self._eligibility.served_by(sensor)
        limits = Limits.of_targets(sensor, self._limits.at(served))
        found = find_accesses(path, self._sites.at(served), limits, budget.stop)
        found = replace(found, site=served[found.site].astype(np.int32))
        in_time = self._eligibility.in_time(found)
        placed = tasks.place_collects(
            in_time, targets, scenario.collect_spacing_s, scenario.collect_alignment
        )
        self._raise_to(ACCESS_TOO_SHORT, found.site)
        self._raise_to(OUTSIDE_TIMES, found.site[tasks.have_room(found, targets)])
        self._raise_to(BETWEEN_STARTS, in_time.site[tasks.have_room(in_time, targets)])
        self._raise_to(ACCESS_FOUND, in_time.site[placed[0]])
        return in_time, placed

    def note_visible(self, sensor: Sensor, path: Ephemeris) -> None:
        """Look for bare visibility of the targets that it would bring nearer to a collect.

        Once all collects are placed, few such targets are left.
        """
        is_served = np.zeros(len(self.closeness), dtype=np.bool_)
        is_served[self._eligibility.served_by(sensor)] = True
        best = np.where(is_served, _RANK[OUTSIDE_LIMITS], _RANK[WRONG_SENSOR_TYPE])
        unseen = np.flatnonzero(self.closeness < best)
        if not len(unseen):
            return
        seen = find_accesses(path, self._sites.at(unseen), Limits.above_horizon(len(unseen)))
        visible = unseen[seen.site]
        np.maximum.at(self.closeness, visible, best[visible])

    def _raise_to(self, reason: int, targets: npt.NDArray[np.integer]) -> None:
        np.maximum.at(self.closeness, targets, _RANK[reason])
