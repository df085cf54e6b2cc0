"""When the satellites of one type see a target: opportunities without a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Final

from sqlalchemy.orm import Session

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.errors import Cancelled, InvalidScenario
from service.db.rows import SatelliteRow
from service.scenarios.freezing import checked_scenario, satellites_of
from service.scenarios.opportunities import Described
from service.scenarios.scenario_limits import ScenarioLimits
from service.stores.finding import alive
from service.wire.scenarios import FileSatellite, FileTarget, HorizonIn, ScenarioFile

_WITHIN_S: Final = 20.0


def types_flown(session: Session) -> list[str]:
    """Return the spacecraft types used by satellites, by id or built-in name."""
    wanted = alive(SatelliteRow).with_only_columns(SatelliteRow.spacecraft).distinct()
    return sorted(one for one in session.scalars(wanted) if one is not None)


def fleet_of(session: Session, spacecraft_id: str) -> list[FileSatellite]:
    """Return the satellites of one type, with their current elements."""
    of_type = alive(SatelliteRow).where(SatelliteRow.spacecraft == spacecraft_id)
    ids = session.scalars(of_type.with_only_columns(SatelliteRow.id).order_by(SatelliteRow.id))
    return satellites_of(session, ids.all())


def views_of(
    satellites: Sequence[FileSatellite],
    target: FileTarget,
    start: datetime,
    end: datetime,
    limits: ScenarioLimits,
) -> Described:
    """Return the opportunities of a target between two instants.

    Raises
    ------
    InvalidScenario
        ``horizon_too_long``, ``scenario_too_large``; elements that are too old.
    """
    file = ScenarioFile(
        release=2,
        horizon=HorizonIn(start=start, end=end),
        satellites=list(satellites),
        targets=[target],
        ground_stations=[],
        use_resources=False,
    )
    scenario = checked_scenario(file, limits)
    try:
        computed = compute_opportunities(scenario, Budget(_WITHIN_S))
    except Cancelled:
        detail = f"The search took longer than {_WITHIN_S:g} s: ask for a shorter span."
        raise InvalidScenario("scenario_too_large", detail, pointer="/datetime") from None
    return Described(scenario=scenario, computed=computed)
