"""From a scenario to a problem: the only place where orbits and problem meet."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from planner_core.access import opportunities as tasks
from planner_core.access.eligibility import Eligibility
from planner_core.access.given import table_of, with_given
from planner_core.access.limits import Limits, TargetLimits
from planner_core.access.passes import (
    PlacedContacts,
    contacts_of,
    downlinks_of,
    with_halves_to_share,
)
from planner_core.access.windows import Accesses, find_accesses
from planner_core.budget import Budget, Progress
from planner_core.domain import (
    Horizon,
    OrbitEphemeris,
    Satellite,
    Scenario,
    Sensor,
)
from planner_core.errors import Cancelled, InvalidScenario
from planner_core.flown import Past, carried, flown_as, given_of, pasts_of
from planner_core.idling import started, sunlit_from
from planner_core.orbits import ephemeris as orbits
from planner_core.orbits.earth_orientation import shipped
from planner_core.orbits.eclipse import always_sunlit, sunlight
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.places import Places, View, view
from planner_core.orbits.sun import sun_path
from planner_core.pinning.pinned_problem import pinned_problem
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
    ImageOnBoard,
    Ints,
    Opportunities,
    Problem,
    Sunlight,
    build_satellite_problem,
)
from planner_core.problem.delivery import with_objective
from planner_core.problem.on_board import with_on_board
from planner_core.problem.pointing import Path, Pointing
from planner_core.valuation import worth_of_opportunities

Longs = npt.NDArray[np.int64]
Codes = npt.NDArray[np.int8]
Floats = npt.NDArray[np.float64]

LEO_PERIOD_S = 128 * 60.0
OLD_ELEMENTS_DAYS = 3.0
_GENERIC = ("generic_optical", "generic_sar")
REFUSED_ELEMENTS_DAYS = 30.0
_MOST_NAMED = 20

_REASONS = np.array(
    [
        NEVER_VISIBLE, WRONG_SENSOR_TYPE, OUTSIDE_LIMITS, ACCESS_TOO_SHORT, OUTSIDE_TIMES,
        BETWEEN_STARTS, ACCESS_FOUND,
    ],
    dtype=np.int8,
)  # fmt: skip
"""From what is farthest from a collect to what is nearest."""
_RANK = {int(reason): rank for rank, reason in enumerate(_REASONS)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScenarioOpportunities:
    """All that geometry has to say about a scenario; computed once, stored, used by any solver.

    Attributes
    ----------
    opportunities
        The table that every solver plans with.
    target_access
        Why a target has no collect, or ``ACCESS_FOUND``. Shape ``(num_targets,)``.
    sunlight
        One per satellite, whether its battery minds the shadow or not.
    warnings
        Sentences for people.
    """

    opportunities: Opportunities
    target_access: Codes
    sunlight: tuple[Sunlight, ...]
    warnings: tuple[str, ...]

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
        # As np.savez_compressed, in half the time: more effort hardly shrinks such numbers.
        method = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED
        with zipfile.ZipFile(buffer, "w", method, compresslevel=1) as archive:
            for name, values in columns.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
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


def compute_opportunities(scenario: Scenario, budget: Budget) -> ScenarioOpportunities:
    """Return every opportunity of a scenario, worked out satellite by satellite.

    Raises
    ------
    PropagationFailed
        SGP4 stops before the end of the horizon.
    InvalidScenario
        There are too many.
    Cancelled
        The budget was spent first; there is no partial answer.
    """
    places = _places(scenario)
    kinds = (COLLECT, CONTACT) if scenario.use_resources else (COLLECT,)
    collects = _Collects(scenario, places[COLLECT])
    contact = Limits.of_stations(scenario.ground_stations)
    contacts: list[PlacedContacts] = []
    before_contacts: list[int] = []  # how many accesses there are, by satellite
    parts: list[tasks.Columns] = []
    lit: list[Sunlight] = []
    num_accesses = num_rows = 0
    num_steps = 2 * len(scenario.satellites)
    for index, satellite in enumerate(scenario.satellites):
        _go_on(budget, index / num_steps)
        path = propagate(satellite, scenario.horizon)
        for kind in kinds:
            if kind == COLLECT:
                found, placed = collects.placed(satellite.sensor, path, budget)
            else:
                found = find_accesses(path, places[kind], contact, budget.stop)
                contacts.append(contacts_of(scenario, satellite, path, places[kind], found))
                before_contacts.append(num_accesses)
                num_accesses += len(found)
                continue
            parts.append(tasks.rows_of(index, kind, found, num_accesses, placed))
            num_accesses += len(found)
            num_rows += len(placed[0])
            tasks.check_number(num_rows)
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
        _go_on(budget, 0.5 + index / num_steps)
        # Propagated again rather than kept: a month of a constellation's paths is a gigabyte.
        path = propagate(satellite, scenario.horizon)
        for kind in kinds:
            described.fill(
                index, kind, path, places[kind], satellite.sensor.nadir,
                with_rates=satellite.agility.tracks,
            )  # fmt: skip
    _go_on(budget, 1.0)
    return ScenarioOpportunities(
        opportunities=described.table(),
        target_access=_REASONS[collects.closeness],
        sunlight=tuple(lit),
        warnings=orbit_warnings(scenario),
    )


def _places(scenario: Scenario) -> dict[int, Places]:
    return {
        COLLECT: Places.of(scenario.targets),
        CONTACT: Places.of(scenario.ground_stations),
    }


def view_at(scenario: Scenario, table: Opportunities, rows: Longs, t_s: Floats) -> View:
    """Return what some opportunities look like at other instants than their middle.

    Parameters
    ----------
    table, rows
        The scenario's opportunities, and which of them.
    t_s
        One instant for each of the rows, in the horizon.
    """
    places = _places(scenario)
    seen = {field.name: np.empty(len(rows)) for field in fields(View)}
    for index in np.unique(table.satellite[rows]):
        satellite = scenario.satellites[index]
        path = propagate(satellite, scenario.horizon)
        for kind in (COLLECT, CONTACT):
            own = np.flatnonzero((table.satellite[rows] == index) & (table.kind[rows] == kind))
            there = places[kind].at(table.place[rows[own]])
            part = view(path, there, t_s[own], satellite.sensor.nadir)
            for name, values in seen.items():
                values[own] = getattr(part, name)
    in_eclipse = seen.pop("in_eclipse") > 0.0
    return View(in_eclipse=in_eclipse, **seen)


def _go_on(budget: Budget, fraction: float, phase: Literal["access", "compile"] = "access") -> None:
    if budget.is_spent():
        raise Cancelled
    budget.report(Progress(phase=phase, fraction=fraction))


class _Collects:
    """Finds and places the collects of one satellite after another.

    ``closeness`` tells, by target, how near any of them has come to one: an index of
    ``_REASONS``.
    """

    def __init__(self, scenario: Scenario, places: Places):
        self.closeness = np.zeros(len(scenario.targets), dtype=np.int64)
        self._scenario = scenario
        self._places = places
        self._limits = TargetLimits.of(scenario.targets)
        self._eligibility = Eligibility.of(scenario.targets, scenario.horizon)

    def placed(
        self, sensor: Sensor, path: Ephemeris, budget: Budget
    ) -> tuple[Accesses, tasks.Placed]:
        """Return the accesses of a satellite that count, and the collects in them."""
        scenario, targets = self._scenario, self._scenario.targets
        served = self._eligibility.served_by(sensor)
        limits = Limits.of_targets(sensor, self._limits.at(served))
        found = find_accesses(path, self._places.at(served), limits, budget.stop)
        found = replace(found, place=served[found.place].astype(np.int32))
        in_time = self._eligibility.in_time(found)
        placed = tasks.place_collects(
            in_time, targets, scenario.collect_spacing_s, scenario.collect_alignment
        )
        self._raise_to(ACCESS_TOO_SHORT, found.place)
        self._raise_to(OUTSIDE_TIMES, found.place[tasks.have_room(found, targets)])
        self._raise_to(BETWEEN_STARTS, in_time.place[tasks.have_room(in_time, targets)])
        self._raise_to(ACCESS_FOUND, in_time.place[placed[0]])
        self._note_visible(served, path)
        return in_time, placed

    def _note_visible(self, served: Longs, path: Ephemeris) -> None:
        """Look for bare visibility, where it would bring a target nearer."""
        is_served = np.zeros(len(self.closeness), dtype=np.bool_)
        is_served[served] = True
        best = np.where(is_served, _RANK[OUTSIDE_LIMITS], _RANK[WRONG_SENSOR_TYPE])
        unseen = np.flatnonzero(self.closeness < best)
        seen = find_accesses(path, self._places.at(unseen), Limits.above_horizon(len(unseen)))
        visible = unseen[seen.place]
        np.maximum.at(self.closeness, visible, best[visible])

    def _raise_to(self, reason: int, targets: npt.NDArray[np.integer]) -> None:
        np.maximum.at(self.closeness, targets, _RANK[reason])


def build_problem(scenario: Scenario, computed: ScenarioOpportunities, budget: Budget) -> Problem:
    """Return the frozen problem that solvers and the referee see.

    Raises
    ------
    Cancelled
        The budget was spent first.
    InvalidScenario
        A pin is impossible.
    """
    satellites = []
    table, origin = _with_frozen(scenario, computed.opportunities)
    pasts = pasts_of(scenario)
    images: list[ImageOnBoard] = []
    states = {state.satellite_id: state for state in scenario.states}
    sun = sun_path(scenario.horizon)
    downlinks = downlinks_of(scenario, table)
    for index, satellite in enumerate(scenario.satellites):
        _go_on(budget, index / len(scenario.satellites), "compile")
        sees_shadow = scenario.use_resources and satellite.resources.eclipse_aware
        lit = computed.sunlight[index]
        if not sees_shadow:
            lit = always_sunlit(scenario.horizon.duration_s)
        start = started(scenario, index, states.get(satellite.id), computed.opportunities)
        if index in pasts:
            past = pasts[index]
            part = _flown_problem(past, budget)
            of_data = part if past.before is None else _flown_problem(past.of_data, budget)
            start = carried(past, part, of_data, start)
        images += start.images
        satellites.append(
            build_satellite_problem(
                index,
                table,
                id=satellite.id,
                name=satellite.name,
                agility=satellite.agility,
                resources=start.resources,
                downlinks=downlinks,
                sunlight=sunlit_from(lit, start.sun_from_s) if start.sun_from_s > 0.0 else lit,
                sun=sun,
                heading=start.heading,
            )
        )
    _go_on(budget, 1.0, "compile")
    stations = scenario.ground_stations
    problem = Problem(
        horizon_s=scenario.horizon.duration_s,
        use_resources=scenario.use_resources,
        dynamics=scenario.dynamics,
        continuous_starts=has_continuous_starts(scenario),
        pointing=_pointing(scenario) if has_continuous_starts(scenario) else None,
        target_ids=tuple(target.id for target in scenario.targets),
        worth=worth_of_opportunities(scenario, table),
        target_access=computed.target_access,
        station_ids=tuple(station.id for station in stations),
        station_antennas=np.array([s.antennas for s in stations], dtype=np.int32),
        downlinks=downlinks,
        opportunities=table,
        satellites=tuple(satellites),
        origin=origin,
    )
    problem = with_objective(problem, scenario.objective)
    return pinned_problem(scenario, with_on_board(problem, tuple(images)))


def _flown_problem(past: Past, budget: Budget) -> Problem:
    """Return the problem of what a satellite did before the horizon, and of nothing else."""
    part = past.part()
    (satellite,) = part.satellites
    return build_problem(
        part,
        ScenarioOpportunities(
            opportunities=table_of(part, past.given(part)),
            target_access=np.full(len(part.targets), ACCESS_FOUND, dtype=np.int8),
            sunlight=(sunlight(propagate(satellite, part.horizon)),),
            warnings=(),
        ),
        budget,
    )


def _with_frozen(scenario: Scenario, table: Opportunities) -> tuple[Opportunities, Ints | None]:
    """Return the table with each frozen action at its own instants, and the rows that these are of.

    Raises
    ------
    InvalidScenario
        ``frozen_not_kept``: by newer elements its satellite does not see its place then.
    """
    replan, horizon = scenario.replan, scenario.horizon
    if replan is None:
        return table, None
    frozen = {
        i: flown_as(action)
        for i, action in enumerate(replan.base)
        if action.start is not None
        and action.end is not None
        and horizon.start <= action.start < replan.freeze_until
    }
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    given = [given_of(scenario, satellites[one.satellite_id], one) for one in frozen.values()]
    made = with_given(scenario, table, given)
    if made.missing and replan.elements == "newest":
        number = list(frozen)[made.missing[0]]
        action = frozen[number]
        place = f"target {action.target_id!r}" if action.target_id else "the station"
        raise InvalidScenario(
            "frozen_not_kept",
            f"By its newest elements satellite {action.satellite_id!r} does not see {place} at "
            f"{action.start:%Y-%m-%dT%H:%M:%SZ}: end the freeze before, or skip the action.",
            pointer=f"/replan/base/{number}",
        )
    if len(made.table) == len(table):
        return table, None
    return made.table, made.origin


def has_continuous_starts(scenario: Scenario) -> bool:
    """Return whether collects may start anywhere in their accesses.

    The events of ``dynamics: paper`` are the starts of opportunities: it knows no others.
    """
    knows_starts_alone = scenario.use_resources and scenario.dynamics == "paper"
    return scenario.continuous_starts and not knows_starts_alone


def _pointing(scenario: Scenario) -> Pointing:
    places = _places(scenario)
    paths = []
    for satellite in scenario.satellites:
        found = propagate(satellite, scenario.horizon)
        turn = np.column_stack([found.gmst_rad, found.xp_rad, found.yp_rad])
        nodes = np.hstack([found.position_itrf_m, found.velocity_itrf_m_s, turn])
        paths.append(Path(found.step_s, np.ascontiguousarray(nodes)))
    return Pointing(
        paths=tuple(paths),
        targets_m=places[COLLECT].position_m,
        stations_m=places[CONTACT].position_m,
    )


def check_propagation(scenario: Scenario) -> None:
    """Refuse the first satellite whose orbit does not reach over the horizon.

    Raises
    ------
    PropagationFailed
        SGP4 cannot carry it through.
    InvalidScenario
        ``orbit_outside_span`` where an ephemeris ends before, or begins later.
    """
    for position, satellite in enumerate(scenario.satellites):
        try:
            orbits.check_propagation(satellite, scenario.horizon)
        except InvalidScenario as error:
            error.fault = replace(error.fault, pointer=f"/satellites/{position}")
            raise


def check_element_age(scenario: Scenario) -> None:
    """Refuse element sets too old to plan with, unless the scenario allows them.

    Raises
    ------
    InvalidScenario
        A satellite in low orbit is more than 30 days from its epoch at some time of the
        horizon: its place along the orbit is then a matter of minutes, not of seconds.
    """
    if scenario.allow_old_elements:
        return
    ages_days = [_greatest_age_days(one, scenario.horizon) for one in scenario.satellites]
    old = [
        index
        for index, satellite in enumerate(scenario.satellites)
        if ages_days[index] > REFUSED_ELEMENTS_DAYS and satellite.orbit.period_s < LEO_PERIOD_S
    ]
    if not old:
        return
    named = [f"{scenario.satellites[i].name!r} {ages_days[i]:.0f}" for i in old[:_MOST_NAMED]]
    more = f" and {len(old) - _MOST_NAMED} more" if len(old) > _MOST_NAMED else ""
    raise InvalidScenario(
        "elements_too_old",
        f"{len(old)} of {len(scenario.satellites)} element sets are more than "
        f"{REFUSED_ELEMENTS_DAYS:.0f} days from their epochs within the horizon, in days: "
        f"{', '.join(named)}{more}. Store newer elements, or set allow_old_elements.",
        pointer=f"/satellites/{old[0]}",
    )


def orbit_warnings(scenario: Scenario) -> tuple[str, ...]:
    """Return what a reader should know about element sets, the Earth's orientation and starts."""
    ages = (_age_warning(satellite, scenario.horizon) for satellite in scenario.satellites)
    warnings = [warning for warning in ages if warning is not None]
    generic = sorted({s.spacecraft for s in scenario.satellites if s.spacecraft in _GENERIC})
    if generic:
        warnings.append(
            f"Satellites plan with the figures of the built-in type {' and '.join(generic)}, "
            "which are those of a class: give your own agility, sensor and resources."
        )
    if not shipped().covers(scenario.horizon):
        warnings.append(
            "The horizon reaches outside the table of the Earth's orientation: its end values "
            "are held, and access times may be off by up to a second."
        )
    if scenario.continuous_starts and not has_continuous_starts(scenario):
        warnings.append(
            "continuous_starts has no effect: in dynamics 'paper' tasks begin at the starts of "
            "opportunities alone."
        )
    return tuple(warnings)


def _age_warning(satellite: Satellite, horizon: Horizon) -> str | None:
    orbit = satellite.orbit
    if isinstance(orbit, OrbitEphemeris):
        return None
    age_days = _greatest_age_days(satellite, horizon)
    if orbit.epoch > horizon.end:
        return (
            f"Satellite {satellite.name!r}: the element set's epoch lies after the horizon's end "
            f"({orbit.epoch:%Y-%m-%d})."
        )
    if orbit.period_s < LEO_PERIOD_S and age_days > OLD_ELEMENTS_DAYS:
        return (
            f"Satellite {satellite.name!r}: the element set is up to {age_days:.1f} days from "
            f"its epoch; expect errors of about a kilometre per day."
        )
    return None


def _greatest_age_days(satellite: Satellite, horizon: Horizon) -> float:
    """Return how far from its epoch an element set is used at most, before or after."""
    if isinstance(satellite.orbit, OrbitEphemeris):
        return 0.0  # it is used within its own span alone
    epoch_s = horizon.offset_s(satellite.orbit.epoch)
    return max(epoch_s, horizon.duration_s - epoch_s) / 86400.0
