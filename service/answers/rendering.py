"""A judged plan as the documents that the API serves: the timeline and the targets."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import count
from typing import Any

import numpy as np

from planner_core import __version__
from planner_core.build import view_at
from planner_core.orbits.sgp4_record import GRAVITY
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.replay import JudgedAction, Resourceline, plan_sha256
from planner_core.run import Judged
from service.answers.wording import Document, Wording
from service.wire.instants import instant_text

SCHEMA_VERSION = "1.0"
_COMPARED = (
    "reward", "bound", "gap", "bound_proof", "collects", "contacts", "downlinked_mbit",
    "downlinked_fraction",
)  # fmt: skip


def figures_of(timeline: Document) -> Document:
    """Return the numbers of a timeline (its head will do) that a table of several plans shows."""
    totals, runtime_s = timeline["totals"], timeline["runtime_s"]
    return {
        **{name: totals[name] for name in _COMPARED},
        "solve_s": runtime_s["solve"],
        "runtime_s": round(sum(runtime_s.values()), 6),
        "validity": timeline["validity"],
        "plan_sha256": timeline["plan_sha256"],
    }


class Documents(Wording):
    """Renders one judged plan."""

    def __init__(self, judged: Judged, *, job_id: str, scenario_sha256: str):
        super().__init__(judged.scenario, judged.problem, judged.timeline)
        self.judged = judged
        self.job_id = job_id
        self.scenario_sha256 = scenario_sha256
        self._seen = _seen_at_own_starts(judged)

    def head(
        self, *, solver: str, params: Mapping[str, Any], seed: int, termination: str
    ) -> Document:
        """Return the timeline document of api.md, but for its satellites."""
        judged, horizon = self.judged, self.judged.scenario.horizon
        runtime = judged.runtime_s
        return {
            "schema_version": SCHEMA_VERSION,
            "job": self.job_id,
            "scenario_sha256": self.scenario_sha256,
            "plan_sha256": plan_sha256(judged.problem, judged.solution.plan),
            "solver": {
                "name": solver,
                "version": __version__,
                "params": dict(params),
                "seed": seed,
            },
            "horizon": {"start": instant_text(horizon.start), "end": instant_text(horizon.end)},
            "dynamics": judged.problem.dynamics,
            "use_resources": judged.problem.use_resources,
            "termination": termination,
            "runtime_s": {
                "access": round(runtime.access, 6),
                "compile": round(runtime.compile, 6),
                "solve": round(runtime.solve, 6),
                "verify": round(runtime.verify, 6),
            },
            "validity": "valid" if judged.timeline.is_valid else "violations",
            "violations": [self._violation(v) for v in judged.timeline.violations],
            "totals": self._totals(),
            "warnings": list(judged.opportunities.warnings),
            "models": {
                "propagation": "SGP4",
                "gravity": GRAVITY,
                "earth_orientation": "IERS daily dUT1 and polar motion",
                "nadir": {s.id: s.sensor.nadir for s in judged.scenario.satellites},
            },
        }

    def satellites(self) -> Iterator[tuple[Document, Iterator[Document], Document]]:
        """Yield what the timeline says of each satellite before, in and behind its actions."""
        judged, numbers = self.judged, count(1)
        for satellite, line, lit in zip(
            judged.problem.satellites,
            judged.timeline.satellites,
            judged.opportunities.sunlight,
            strict=True,
        ):
            about = {"id": satellite.id, "name": satellite.name}
            actions = (self._action(f"a{next(numbers)}", action) for action in line.actions)
            rest = {
                "eclipses": [
                    {"start": self._instant(start_s), "end": self._instant(end_s)}
                    for start_s, end_s in lit.gaps(judged.problem.horizon_s)
                ],
                "resources": None
                if line.resources is None
                else {
                    **self._curves(line.resources),
                    "battery_min_fraction": satellite.resources.battery_min_fraction,
                    "recorder_max_fraction": satellite.resources.recorder_max_fraction,
                },
            }
            yield about, actions, rest

    def targets(self) -> Iterator[Document]:
        """Yield every target once, with outcome and reason."""
        return (self._target(outcome) for outcome in self.judged.outcomes)

    def _totals(self) -> Document:
        judged, timeline = self.judged, self.judged.timeline
        outcomes = Counter(outcome.outcome for outcome in judged.outcomes)
        modes = Counter(a.mode for s in timeline.satellites for a in s.actions)
        capacities = [s.resources.recorder_capacity_mbit for s in judged.scenario.satellites]
        downlinked_mbit: float | None = None
        if judged.problem.use_resources and None not in capacities:
            downlinked_mbit = sum(
                share * (capacity or 0.0)
                for share, capacity in zip(timeline.downlinked, capacities, strict=True)
            )
        bound = judged.bound.value if judged.bound else None
        gap = None
        if bound is not None:
            gap = (bound - timeline.reward) / bound if bound > 0.0 else 0.0
        return {
            "reward": timeline.reward,
            "bound": bound,
            "gap": gap,
            "bound_proof": judged.bound.proof if judged.bound else None,
            "collects": modes["collect"],
            "contacts": modes["contact"],
            "targets": {
                name: outcomes[name]
                for name in ("downlinked", "collected", "unscheduled", "excluded")
            },
            "downlinked_mbit": downlinked_mbit,
            "downlinked_fraction": sum(timeline.downlinked)
            if judged.problem.use_resources
            else None,
            "battery_min_fraction": timeline.battery_min,
            "recorder_max_fraction": timeline.recorder_max,
        }

    def _action(self, action_id: str, action: JudgedAction) -> Document:
        table, scenario = self.judged.problem.opportunities, self.judged.scenario
        row = action.opportunity
        target_id = station_id = off_nadir_deg = azimuth_deg = None
        if row is not None:
            off_nadir, azimuth = self._seen.get(
                action.position, (table.off_nadir_deg[row], table.azimuth_deg[row])
            )
            off_nadir_deg = round(float(off_nadir), 4)
            azimuth_deg = round(float(azimuth), 4)
            place = int(table.place[row])
            if action.mode == "collect":
                target_id = scenario.targets[place].id
            else:
                station_id = scenario.ground_stations[place].id
        return {
            "id": action_id,
            "mode": action.mode,
            "start": self._instant(action.start_s),
            "end": self._instant(action.end_s),
            "target_id": target_id,
            "station_id": station_id,
            "opportunity_id": self._opportunity_id(row),
            "off_nadir_deg": off_nadir_deg,
            "azimuth_deg": azimuth_deg,
            "slew": None
            if action.slew is None
            else {
                "angle_deg": round(action.slew.angle_deg, 6),
                "needed_s": round(action.slew.needed_s, 6),
                "available_s": round(action.slew.available_s, 3),
            },
            "reward": action.reward,
            "battery_fraction_end": _rounded(action.battery_end),
            "recorder_fraction_end": _rounded(action.recorder_end),
        }

    def _curves(self, line: Resourceline) -> Document:
        return {
            "time": [self._instant(float(t)) for t in line.time_s],
            "battery_fraction": [round(float(v), 9) for v in line.battery],
            "recorder_fraction": [round(float(v), 9) for v in line.recorder],
        }


def _seen_at_own_starts(judged: Judged) -> dict[int | None, tuple[float, float]]:
    """Return off-nadir angle and azimuth at the middle of each collect with a start of its own.

    By position in the plan; all else is in the table of opportunities.
    """
    table, problem = judged.opportunities.opportunities, judged.problem
    moved = [
        (position, problem.scenario_row(action.opportunity), action)
        for position, action in enumerate(judged.solution.plan.actions)
    ]
    moved = [
        (position, row, action)
        for position, row, action in moved
        if abs(action.start_s - table.start_s[row]) > TIME_TOLERANCE_S
    ]
    if not moved or not problem.continuous_starts:
        return {}
    positions, rows, actions = zip(*moved, strict=True)
    middle_s = np.array([0.5 * (a.start_s + a.end_s) for a in actions])
    seen = view_at(judged.scenario, table, np.array(rows, dtype=np.int64), middle_s)
    angles = zip(seen.off_nadir_deg.tolist(), seen.azimuth_deg.tolist(), strict=True)
    return dict(zip(positions, angles, strict=True))


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 9)
