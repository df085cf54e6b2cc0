"""What if: a job's scenario with a change, compiled once to check that it is possible."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from pydantic import ValidationError

from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Agility, Quality, Resources, Scenario
from planner_core.errors import InvalidScenario, pointing
from planner_core.pins import PinnedAction, Pins
from planner_core.problem.plan import Plan
from planner_core.reasons.what_if import Change, what_if
from service.answers.rebuilt import stored_plan
from service.scenarios.background import Background
from service.scenarios.canonical import sha256_of
from service.scenarios.change_pointers import (
    place_in_relax,
    places_of,
    places_of_body,
    pointing_into,
)
from service.scenarios.freezing import FrozenScenario, freeze_file
from service.scenarios.opportunities import Described
from service.scenarios.pin_inputs import pinned_action, pins_in
from service.scenarios.relaxing import relaxed_file
from service.scenarios.scenario_limits import ScenarioLimits
from service.scenarios.translate import read_file, scenario_from_file
from service.wire.base import read
from service.wire.changes import ChangeIn
from service.wire.scenarios import ScenarioFile
from service.wire.timelines import IDLE_MODES, TimelineOut


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variation:
    """A changed scenario, ready to be stored, and its opportunities as stored."""

    frozen: FrozenScenario
    opportunity_block: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A job's scenario (a canonical file), its timeline if it has one, and the change."""

    content: str
    timeline: str | None
    change: ChangeIn
    limits: ScenarioLimits

    @property
    def key(self) -> str:
        """A key that differs for different requests."""
        change = self.change.model_dump_json(exclude_unset=True)
        return sha256_of(f"{sha256_of(self.content)}{sha256_of(self.timeline or '')}{change}")


class Variations(Background):
    """Computes changed scenarios in the background."""

    _kept, _told = 8, "The change is being computed."

    def get(self, asked: Asked, described: Described) -> Variation:
        """Return the changed scenario; 503 ``still_computing`` if that takes long.

        Raises
        ------
        PlannerError
            If the change is impossible; with a pointer into it.
        """
        return self.work_out(asked.key, lambda budget: vary(asked, described, budget))


def vary(asked: Asked, described: Described, budget: Budget) -> Variation:
    """Return the changed scenario; raises as ``Variations.get`` does."""
    change = asked.change
    file = relaxed_file(read_file(json.loads(asked.content)), change.relax)
    scenario = scenario_from_file(file)
    # Only here does it show whether the satellites can be propagated over the whole horizon.
    with pointing(place_in_relax):
        _freeze(file, asked)
        computed = _opportunities(scenario, described, budget)
    force = tuple(pinned_action(action) for action in change.force)
    forbid = tuple(pinned_action(action) for action in change.forbid)
    _check_names(scenario, change, force, forbid)
    timeline = None if asked.timeline is None else read(TimelineOut, asked.timeline)
    dropped = _dropped(asked, timeline)
    with pointing_into(change, places_of(scenario.pins, forbid, force, len(dropped))):
        problem = build_problem(scenario, computed, budget)
        plan = Plan() if timeline is None else stored_plan(timeline, scenario, problem)
        wanted = Change(force=force, forbid=(*forbid, *dropped))
        changed = what_if(scenario, wanted, problem, plan)
        build_problem(changed, computed, budget)
    return Variation(
        frozen=_freeze(_with_pins(file, changed.pins), asked),
        opportunity_block=computed.to_bytes(),
    )


def _freeze(file: ScenarioFile, asked: Asked) -> FrozenScenario:
    unnamed = file.model_copy(update={"name": None})
    return freeze_file(unnamed, asked.limits)


def _opportunities(
    scenario: Scenario, described: Described, budget: Budget
) -> ScenarioOpportunities:
    """Return the known opportunities if the change does not affect geometry, else new ones."""
    if _geometry(scenario) == _geometry(described.scenario):
        return described.computed
    return compute_opportunities(scenario, budget)


def _geometry(scenario: Scenario) -> Scenario:
    """Return the scenario with everything equalized that opportunities do not depend on."""
    some = Resources.paper(1.0)
    return replace(
        scenario,
        pins=Pins(),
        quality=Quality(),
        forecast=None,
        satellites=tuple(
            replace(
                satellite,
                agility=_slew_model_of(satellite.agility),
                resources=replace(some, eclipse_aware=satellite.resources.eclipse_aware),
            )
            for satellite in scenario.satellites
        ),
        targets=tuple(
            replace(target, name=None, reward=1.0, reward_half_life_s=None)
            for target in scenario.targets
        ),
    )


def _slew_model_of(agility: Agility) -> Agility:
    """Return the only part of an agility that opportunities depend on: its slew model."""
    return Agility(slew_model="moving", acceleration_deg_s2=1.0) if agility.tracks else Agility()


def _dropped(asked: Asked, timeline: TimelineOut | None) -> list[PinnedAction]:
    """Return the actions of the plan that are to be dropped."""
    if not asked.change.relax.drop_actions:
        return []
    actions = {
        action.id: PinnedAction(
            satellite_id=satellite.id,
            target_id=action.target_id,
            station_id=action.station_id,
            start=action.start,
        )
        for satellite in (timeline.satellites if timeline else ())
        for action in satellite.actions
        if action.mode not in IDLE_MODES
    }
    found = []
    for number, own_id in enumerate(asked.change.relax.drop_actions):
        if own_id not in actions:
            raise InvalidScenario(
                "unknown_action",
                f"The plan has no collect or contact {own_id!r}.",
                pointer=f"/relax/drop_actions/{number}",
            )
        found.append(actions[own_id])
    return found


def _check_names(
    scenario: Scenario,
    change: ChangeIn,
    force: tuple[PinnedAction, ...],
    forbid: tuple[PinnedAction, ...],
) -> None:
    with pointing_into(change, places_of_body(force, forbid)):
        Pins(keep=force, skip=forbid).check(
            [satellite.id for satellite in scenario.satellites],
            {target.id for target in scenario.targets},
            [station.id for station in scenario.ground_stations],
            has_contacts=scenario.use_resources,
        )


def _with_pins(file: ScenarioFile, pins: Pins) -> ScenarioFile:
    if not pins:
        return file
    try:
        return file.model_copy(update={"pins": pins_in(pins)})
    except ValidationError:
        raise InvalidScenario(
            "value_out_of_range", "The scenario would have too many pins.", pointer="/force"
        ) from None
