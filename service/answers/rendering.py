"""A judged plan in the API's terms: its timeline, and the outcome of each target with reasons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import count
from typing import Final, get_args

import numpy as np

from planner_core.access.scenario_opportunities import view_at
from planner_core.domain import Resources, Scenario
from planner_core.mistakes import mistakes_of_accesses, usual_mistakes
from planner_core.orbits.sgp4_record import GRAVITY
from planner_core.problem import Problem
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.reasons.reason import Change, Reason, TargetOutcome
from planner_core.referee.replay import plan_sha256
from planner_core.referee.timeline import JudgedAction, Resourceline, Slew, Timeline, Violation
from planner_core.run import Judged
from planner_core.valuation import clear_probabilities
from service.answers.figures import (
    ImageFigures,
    ages_of,
    in_mbit,
    num_delivered,
    satellite_totals,
)
from service.wire.base import Json
from service.wire.jobs import FiguresOut
from service.wire.outcomes import ReasonOut, TargetItem
from service.wire.scenarios import HorizonOut
from service.wire.timelines import (
    ActionOut,
    ModelsOut,
    OnBoardOut,
    Outcome,
    PreferredOut,
    ResourceCurvesOut,
    RuntimeOut,
    SatelliteTimelineOut,
    SlewOut,
    SolverUsed,
    TimelineHead,
    TotalsOut,
    ViolationOut,
)

SCHEMA_VERSION: Final = "1.0"
_OF_TOTALS: Final = FiguresOut.model_fields.keys() & TotalsOut.model_fields.keys()


def figures_of(timeline: Json) -> Json:
    """Return the numbers of a timeline (its head is enough) for a table of several plans."""
    runtime_s = timeline["runtime_s"]
    figures = FiguresOut(
        **{name: timeline["totals"].get(name) for name in _OF_TOTALS},
        solve_s=runtime_s["solve"],
        runtime_s=round(sum(runtime_s.values()), 6),
        validity=timeline["validity"],
        plan_sha256=timeline["plan_sha256"],
    )
    return figures.model_dump()


class Wording:
    """Names things of a judged plan: its actions, opportunities, instants, reasons.

    Action ids are numbered through all satellites: ``a1``, ``a2``, ...
    """

    def __init__(self, scenario: Scenario, problem: Problem, timeline: Timeline):
        self.scenario = scenario
        self.problem = problem
        self._timeline = timeline
        self.instant = scenario.horizon.instant
        actions = [a for s in timeline.satellites for a in s.actions]
        self.action_ids = {
            action.position: f"a{number}"
            for number, action in enumerate(actions, start=1)
            if action.position is not None
        }

    def opportunity_id(self, row: int | None) -> str | None:
        """Return the id of an opportunity of the problem."""
        return None if row is None else f"o{self.problem.scenario_row(row)}"

    def violation(self, found: Violation) -> ViolationOut:
        """Return a violation, leaving out blamed actions that the plan does not have."""
        ids = self.action_ids
        return ViolationOut(
            code=found.code,
            satellite_id=self.problem.satellites[found.satellite].id,
            satellite_name=self.problem.satellites[found.satellite].name,
            at=self.instant(found.at_s),
            needed=found.needed,
            available=found.available,
            actions=[ids[p] for p in found.blamed if p in ids],
            detail=found.detail,
            inherited=found.inherited,
        )

    def target(self, found: TargetOutcome) -> TargetItem:
        """Return the outcome of a target."""
        target = self.scenario.targets[found.target]
        satellite = None if found.satellite is None else self.problem.satellites[found.satellite]
        collected = self._timeline.collected.get(found.target)
        old = [one for one in self._timeline.brought_down if one.target == found.target]
        worth = None if collected is None else collected.worth
        return TargetItem(
            target_id=target.id,
            target_name=target.name,
            target_catalog_id=target.catalog_id,
            outcome=found.outcome,
            action_id=None if found.position is None else self.action_ids[found.position],
            satellite_id=None if satellite is None else satellite.id,
            satellite_name=None if satellite is None else satellite.name,
            worth=sum(one.earned for one in old) if old else worth,
            reason=None if found.reason is None else self._reason(found.reason, target.reward),
        )

    def _reason(self, found: Reason, reward: float) -> ReasonOut:
        return ReasonOut(
            code=found.code,
            certainty=found.certainty,
            blocking_actions=[self.action_ids[p] for p in found.blocking],
            opportunity_id=self.opportunity_id(found.opportunity),
            at=None if found.at_s is None else self.instant(found.at_s),
            reward_delta=found.reward_delta,
            change=None if found.change is None else self._change(found.change),
            detail=found.detail + self._image_then(found.opportunity, reward),
        )

    def _image_then(self, row: int | None, reward: float) -> str:
        """Return what the image of a reason would be worth, if that is less than the reward."""
        if row is None or self.problem.worth[row] >= reward:
            return ""
        sky = ""
        if self.scenario.forecast is not None:
            table, alone = self.problem.opportunities, np.array([row])
            clear = float(clear_probabilities(self.scenario, table, alone)[0])
            sky = f" (probability of a clear sky: {100.0 * clear:.0f} %)"
        return f" An image then would be worth {self.problem.worth[row]:.3g} of {reward:g}{sky}."

    def _change(self, change: Change) -> Json:
        """Return a change in the form of a what-if's ``relax``."""
        found: Json = {"opportunity_id": self.opportunity_id(change.opportunity)}
        if change.satellite is None:
            return found | {"drop_actions": [self.action_ids[p] for p in change.drop]}
        satellite_id = self.problem.satellites[change.satellite].id
        return found | {"satellite_id": satellite_id} | dict(change.settings)


class Documents(Wording):
    """Renders one judged plan."""

    def __init__(self, judged: Judged):
        super().__init__(judged.scenario, judged.problem, judged.timeline)
        self._judged = judged
        self._seen = _seen_at_own_starts(judged)
        self._images = ImageFigures(judged, {p: seen[0] for p, seen in self._seen.items()})

    def head(self, *, job_id: str, scenario_sha256: str, solver: SolverUsed) -> TimelineHead:
        """Return the timeline without its satellites."""
        judged, horizon = self._judged, self.scenario.horizon
        phases = ("access", "compile", "solve", "verify")
        return TimelineHead(
            schema_version=SCHEMA_VERSION,
            job=job_id,
            scenario_sha256=scenario_sha256,
            plan_sha256=plan_sha256(judged.problem, judged.solution.plan),
            solver=solver,
            horizon=HorizonOut(start=horizon.start, end=horizon.end),
            dynamics=judged.problem.dynamics,
            use_resources=judged.problem.use_resources,
            termination=judged.solution.termination.value,
            runtime_s=RuntimeOut(**{p: round(getattr(judged.runtime_s, p), 6) for p in phases}),
            validity=judged.timeline.validity,
            violations=[self.violation(v) for v in judged.timeline.violations],
            totals=self._totals(),
            warnings=(
                *judged.opportunities.warnings,
                *usual_mistakes(judged.scenario),
                *mistakes_of_accesses(judged.scenario, judged.opportunities.opportunities),
            ),
            models=ModelsOut(
                gravity=GRAVITY,
                nadir={s.id: s.sensor.nadir for s in self.scenario.satellites},
            ),
        )

    def satellites(self) -> Iterator[tuple[SatelliteTimelineOut, Iterator[ActionOut]]]:
        """Yield the timeline of each satellite, and separately its actions."""
        judged, numbers = self._judged, count(1)
        parts = zip(
            judged.problem.satellites,
            judged.timeline.satellites,
            judged.opportunities.sunlight,
            strict=True,
        )
        for index, (satellite, line, lit) in enumerate(parts):
            gaps = lit.gaps(judged.problem.horizon_s)
            about = SatelliteTimelineOut(
                id=satellite.id,
                name=satellite.name,
                actions=(),
                on_board=tuple(self._on_board(index)),
                totals=satellite_totals(
                    self.scenario, self.problem, judged.timeline, index, self._images.of(index)
                ),
                eclipses=[HorizonOut(start=self.instant(a), end=self.instant(b)) for a, b in gaps],
                resources=self._curves(line.resources, satellite.resources),
            )
            yield about, (self._action(f"a{next(numbers)}", action) for action in line.actions)

    def _on_board(self, index: int) -> Iterator[OnBoardOut]:
        capacity_mbit = self.scenario.satellites[index].resources.recorder_capacity_mbit
        for one in self._timeline.brought_down:
            image, down_s = self.problem.on_board[one.image], one.delivered_s
            if image.satellite == index and image.target >= 0:
                yield OnBoardOut(
                    target_id=self.problem.target_ids[image.target],
                    collected_at=self.instant(image.collected_s),
                    mbit=None if capacity_mbit is None else round(image.amount * capacity_mbit, 6),
                    recorder_fraction=round(image.amount, 9),
                    worth=image.worth,
                    delivered_at=None if down_s is None else self.instant(down_s),
                    age_s=_rounded(one.age_s, 3),
                    reward=one.earned,
                )

    def targets(self) -> Iterator[TargetItem]:
        """Yield each target once, with outcome and reason."""
        return (self.target(outcome) for outcome in self._judged.outcomes)

    def _totals(self) -> TotalsOut:
        judged, timeline = self._judged, self._judged.timeline
        outcomes = Counter(outcome.outcome for outcome in judged.outcomes)
        modes = Counter(a.mode for s in timeline.satellites for a in s.actions)
        bound = judged.bound.value if judged.bound else None
        gap = None
        if bound is not None:
            gap = (bound - timeline.reward) / bound if bound > 0.0 else 0.0
        use_resources = judged.problem.use_resources
        return TotalsOut(
            reward=timeline.reward,
            bound=bound,
            gap=gap,
            bound_proof=judged.bound.proof if judged.bound else None,
            collects=modes["collect"],
            contacts=modes["contact"],
            targets={name: outcomes[name] for name in get_args(Outcome)},
            downlinked_mbit=in_mbit(self.scenario, self.problem, timeline.downlinked),
            downlinked_fraction=sum(timeline.downlinked) if use_resources else None,
            battery_min_fraction=timeline.battery_min,
            recorder_max_fraction=timeline.recorder_max,
            **self._images.of().model_dump(),
            delivered=num_delivered(self.problem, timeline.collected.values()),
            age_s=ages_of(timeline.collected.values()),
            on_board_mbit_end=_rounded(in_mbit(self.scenario, self.problem, timeline.on_board), 6),
            preferred=[
                PreferredOut(
                    aim=effect.aim, before=round(effect.before, 6), after=round(effect.after, 6)
                )
                for effect in judged.effects
            ],
        )

    def _action(self, action_id: str, action: JudgedAction) -> ActionOut:
        table, row, down_s = self.problem.opportunities, action.opportunity, action.delivered_s
        target = station = off_nadir_deg = azimuth_deg = quality = clear = None
        if row is not None:
            own = table.off_nadir_deg[row], table.azimuth_deg[row]
            off_nadir_deg, azimuth_deg = self._seen.get(action.position, own)
            site = int(table.site[row])
            if action.mode == "collect":
                target = self.scenario.targets[site]
                quality = self._images.quality[row]
                clear = None if self._images.clear is None else self._images.clear[row]
            else:
                station = self.scenario.ground_stations[site]
        return ActionOut(
            id=action_id,
            mode=action.mode,
            start=self.instant(action.start_s),
            end=self.instant(action.end_s),
            target_id=None if target is None else target.id,
            target_name=None if target is None else target.name,
            station_id=None if station is None else station.id,
            station_name=None if station is None else station.name,
            opportunity_id=self.opportunity_id(row),
            off_nadir_deg=_rounded(off_nadir_deg, 4),
            azimuth_deg=_rounded(azimuth_deg, 4),
            slew=None if action.slew is None else _slew(action.slew),
            turn_to_s=_rounded(action.turn_to_s, 3),
            turn_back_s=_rounded(action.turn_back_s, 3),
            reward=action.reward,
            worth=action.worth,
            quality=_rounded(quality, 9),
            clear_probability=_rounded(clear, 9),
            delivered_at=None if down_s is None else self.instant(down_s),
            age_s=None if down_s is None else round(down_s - action.end_s, 3),
            battery_fraction_end=_rounded(action.battery_end, 9),
            recorder_fraction_end=_rounded(action.recorder_end, 9),
        )

    def _curves(self, line: Resourceline | None, limits: Resources) -> ResourceCurvesOut | None:
        if line is None:
            return None
        return ResourceCurvesOut(
            time=[self.instant(float(t)) for t in line.time_s],
            battery_fraction=[round(float(v), 9) for v in line.battery],
            recorder_fraction=[round(float(v), 9) for v in line.recorder],
            battery_min_fraction=limits.battery_min_fraction,
            recorder_max_fraction=limits.recorder_max_fraction,
        )


def _slew(slew: Slew) -> SlewOut:
    return SlewOut(
        angle_deg=round(slew.angle_deg, 6),
        needed_s=round(slew.needed_s, 6),
        available_s=round(slew.available_s, 3),
    )


def _seen_at_own_starts(judged: Judged) -> dict[int | None, tuple[float, float]]:
    """Return off-nadir angle and azimuth at the middle of each collect with a start of its own.

    By position in the plan; for other collects, the table of opportunities has them.
    """
    table, problem = judged.opportunities.opportunities, judged.problem
    moved = [
        (position, row, action)
        for position, action in enumerate(judged.solution.plan.actions)
        for row in [problem.scenario_row(action.opportunity)]
        if abs(action.start_s - table.start_s[row]) > TIME_TOLERANCE_S
    ]
    if not moved or not problem.continuous_starts:
        return {}
    positions, rows, actions = zip(*moved, strict=True)
    middle_s = np.array([0.5 * (a.start_s + a.end_s) for a in actions])
    seen = view_at(judged.scenario, table, np.array(rows, dtype=np.int64), middle_s)
    angles = zip(seen.off_nadir_deg.tolist(), seen.azimuth_deg.tolist(), strict=True)
    return dict(zip(positions, angles, strict=True))


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(float(value), digits)
