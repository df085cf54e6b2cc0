"""A plan from any source, read from a CSV or JSON file.

Only the decisions count: who does what, where and when. Everything else in a timeline follows
from them and the scenario, so it is computed again rather than trusted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from planner_core.domain import Scenario
from planner_core.errors import Fault, InvalidScenario
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.plan import Action, Plan
from planner_core.referee.plan_diff import PlannedAction
from planner_core.spreadsheets import unguarded
from service.files.records import Checked, Record, Records, check, read_csv
from service.wire.base import Body, Id, Instant
from service.wire.timelines import IDLE_MODES, Mode

_MOST_ACTIONS: Final = 1_000_000
_SITES: Final = {"collect": "target", "contact": "station"}
_REQUIRED: Final = ("satellite_id", "mode", "start", "end", "target_id", "station_id")


class ActionIn(Body):
    """The fields of an action that cannot be computed."""

    satellite_id: Id
    mode: Mode
    start: Instant
    end: Instant
    target_id: Id | None = None
    station_id: Id | None = None

    @property
    def site_id(self) -> str | None:
        """The target of a collect, the station of a contact."""
        return self.target_id if self.mode == "collect" else self.station_id

    def planned(self) -> PlannedAction:
        """Return it in the core's terms; it must name its target or station."""
        return PlannedAction(
            start=self.start,
            end=self.end,
            satellite_id=self.satellite_id,
            mode=self.mode,
            site_id=str(self.site_id),
        )


class UnreadableTimeline(Exception):
    """A file does not hold a plan of the scenario; ``faults`` say where and why."""

    def __init__(self, faults: Sequence[Fault]):
        super().__init__(faults[0].detail)
        self.faults = tuple(faults)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A plan and the locations of its actions in the file.

    Attributes
    ----------
    places
        One for each action of the plan: ``line 7``, or a JSON pointer.
    impossible
        Places and messages of tasks for which the scenario has no access at all: these need no
        referee, and the plan omits them.
    """

    plan: Plan
    places: tuple[str, ...]
    impossible: tuple[tuple[str, str], ...]


def records_of_csv(data: bytes) -> Records:
    """Return the rows of a table such as `table.write` makes; other columns are ignored."""
    found = read_csv(data, _REQUIRED, _REQUIRED, most=_MOST_ACTIONS)
    # A plan may be empty, but a file without a header is not a plan.
    faults = [f for f in found.faults if f.code != "empty_file" or not data.strip()]
    records = []
    for one in found.records:
        texts = {name: unguarded(v) for name, v in one.fields.items() if isinstance(v, str)}
        records.append(replace(one, fields={**one.fields, **texts}))
    return Records(records=tuple(records), faults=tuple(faults))


def records_of_json(data: bytes) -> Records:
    """Return the actions of a timeline document."""
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        return Records(faults=(Fault(code="malformed_json", detail=f"Not JSON: {error}"[:200]),))
    records: list[Record] = []
    try:
        for number, satellite in enumerate(_list(document, "satellites", "")):
            pointer = f"/satellites/{number}"
            for position, action in enumerate(_list(satellite, "actions", pointer)):
                records.append(_record(satellite, action, pointer, position))
    except InvalidScenario as error:
        return Records(faults=(error.fault,))
    return Records(records=tuple(records))


def _list(owner: object, name: str, pointer: str) -> list[Any]:
    found = owner.get(name) if isinstance(owner, dict) else None
    if not isinstance(found, list):
        raise InvalidScenario(
            "missing_field", f"{name} must be a list", pointer=f"{pointer}/{name}"
        )
    return found


def _record(satellite: Mapping[str, Any], action: object, pointer: str, position: int) -> Record:
    own = f"{pointer}/actions/{position}"
    if not isinstance(action, dict):
        raise InvalidScenario("invalid_value", "An action must be an object", pointer=own)
    fields = {name: action[name] for name in _REQUIRED[1:] if name in action}
    pointers = {name: f"{own}/{name}" for name in _REQUIRED} | {"": own}
    pointers["satellite_id"] = f"{pointer}/id"
    return Record(fields=fields | {"satellite_id": satellite.get("id")}, pointers=pointers)


def plan_in(records: Records, scenario: Scenario, problem: Problem) -> Reading:
    """Return the plan that a file describes, as actions of the problem.

    An action takes the opportunity, of its satellite and site, whose access contains it or is
    closest to it; whether it fits is for the referee to say.

    Raises
    ------
    UnreadableTimeline
        If the file is faulty, or names what the scenario does not have.
    """
    finder = Finder(scenario, problem)
    checked, faults = check(records.records, ActionIn, finder.require_known)
    if records.faults or faults:
        raise UnreadableTimeline([*records.faults, *faults])
    found: list[tuple[Action, str]] = []
    impossible: list[tuple[str, str]] = []
    for one in checked:
        if one.body.mode in IDLE_MODES:
            continue
        task = one.body.planned()
        action = finder.action(task)
        if action is None:
            detail = f"{task.satellite_id} has no access to {task.site_id}."
            impossible.append((_site(one), detail))
        else:
            found.append((action, _site(one)))
    found.sort()
    return Reading(
        plan=Plan(tuple(action for action, _ in found)),
        places=tuple(place for _, place in found),
        impossible=tuple(impossible),
    )


def _site(one: Checked[ActionIn]) -> str:
    return one.record.pointers[""] if one.record.row is None else f"line {one.record.row}"


class Finder:
    """The opportunities of a problem, by the ids of their scenario."""

    def __init__(self, scenario: Scenario, problem: Problem):
        self._horizon = scenario.horizon
        self._numbers = {
            "satellite": {s.id: i for i, s in enumerate(scenario.satellites)},
            "target": {t.id: i for i, t in enumerate(scenario.targets)},
            "station": {s.id: i for i, s in enumerate(scenario.ground_stations)},
        }
        self._num_sites = len(scenario.targets) + len(scenario.ground_stations) + 1
        self._table = table = problem.opportunities
        keys = self._key(table.satellite.astype(np.int64), table.kind.astype(np.int64), table.site)
        self._order = np.argsort(keys, kind="stable")
        self._keys = keys[self._order]

    def require_known(self, action: ActionIn) -> None:
        """Raise if an action names what the scenario does not have."""
        self._require("satellite", action.satellite_id)
        if action.mode not in IDLE_MODES:
            self._require(_SITES[action.mode], action.site_id)
        if action.end < action.start:
            raise InvalidScenario("invalid_time", "It ends before it starts.", pointer="/end")

    def action(self, task: PlannedAction) -> Action | None:
        """Return the action that is meant; None if there is no such opportunity."""
        satellite = self._numbers["satellite"][task.satellite_id]
        site = self._numbers[_SITES[task.mode]][task.site_id]
        start_s = self._horizon.offset_s(task.start)
        key = self._key(satellite, COLLECT if task.mode == "collect" else CONTACT, site)
        first, end = np.searchsorted(self._keys, key), np.searchsorted(self._keys, key, "right")
        rows = self._order[first:end]
        if len(rows) == 0:
            return None
        table = self._table
        outside_s = np.maximum(
            table.access_start_s[rows] - start_s, start_s - table.access_end_s[rows]
        )
        apart_s = np.abs(table.start_s[rows] - start_s)
        row = int(rows[np.lexsort((apart_s, np.maximum(outside_s, 0.0)))[0]])
        return Action(start_s, self._horizon.offset_s(task.end), row)

    def _require(self, what: str, own_id: str | None) -> None:
        pointer = f"/{what}_id"
        if own_id is None:
            detail = f"The action names no {what}."
            raise InvalidScenario("missing_field", detail, pointer=pointer)
        if own_id not in self._numbers[what]:
            detail = f"The scenario has no {what} {own_id!r}."
            raise InvalidScenario(f"unknown_{what}", detail, pointer=pointer)

    def _key(self, satellite: Any, kind: Any, site: Any) -> npt.NDArray[np.int64]:
        return np.asarray((satellite * 2 + kind) * self._num_sites + site, dtype=np.int64)


READERS: Final[dict[str, Callable[[bytes], Records]]] = {
    ".json": records_of_json,
    ".csv": records_of_csv,
}
"""By file suffix."""
