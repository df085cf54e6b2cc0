"""Stored timelines as what plans are compared by."""

from __future__ import annotations

from typing import Any, Final

from planner_core.referee.plan_diff import PlannedAction, PlanView
from service.answers.reading import ActionIn, records_of_json
from service.scenarios.records import check

_FIGURES: Final = (
    "reward", "collects", "contacts", "downlinked_mbit", "downlinked_fraction",
    "battery_min_fraction", "recorder_max_fraction",
)  # fmt: skip


def view_of(timeline: str, document: dict[str, Any]) -> PlanView:
    """Return the view of a timeline document, given as text and as what it holds."""
    checked, _ = check(records_of_json(timeline.encode()).records, ActionIn, lambda _: None)
    actions = [_planned(one.body) for one in checked if one.body.mode != "sunpoint"]
    totals = document["totals"]
    targets = totals["targets"]
    return PlanView(
        actions=tuple(sorted(actions)),
        totals={
            **{name: totals[name] for name in _FIGURES},
            "targets": float(targets["downlinked"] + targets["collected"]),
        },
    )


def _planned(action: ActionIn) -> PlannedAction:
    return PlannedAction(
        start=action.start,
        end=action.end,
        satellite_id=action.satellite_id,
        mode=action.mode,
        place_id=str(action.target_id or action.station_id),
    )
