"""Freezing scenarios: ids resolved, content made canonical, stored once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, TypeVar

import sqlalchemy as sa
from pydantic import BaseModel, ValidationError
from sqlalchemy.orm import Session

from planner_core.domain import Scenario
from planner_core.errors import Fault, InvalidScenario, pointing
from planner_core.mistakes import usual_mistakes
from planner_core.orbits.checks import check_element_age, check_propagation, orbit_warnings
from service.db.ids import new_id
from service.db.rows import GroundStationRow, SatelliteRow, ScenarioRow, TargetCatalogRow, TargetRow
from service.db.session import Database, inserted
from service.problems.faults import faults_of_validation
from service.scenarios.canonical import canonical_of_file, sha256_of
from service.scenarios.frozen_forecasts import find_forecast, frozen_forecast
from service.scenarios.pin_inputs import with_settled_pins
from service.scenarios.scenario_limits import ScenarioLimits
from service.scenarios.translate import horizon_from, scenario_from_file
from service.stores import outage_store, satellite_store
from service.stores import scenario_store as store
from service.wire.base import fields_of
from service.wire.pins import PlacedOutage
from service.wire.scenarios import (
    FileGroundStation,
    FileSatellite,
    FileTarget,
    Question,
    ScenarioFile,
    ScenarioIn,
    default_objective,
)
from service.wire.spacecraft_types import BUILT_IN

M = TypeVar("M", bound=BaseModel)
R = TypeVar("R", SatelliteRow, TargetCatalogRow, GroundStationRow)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenScenario:
    """A scenario that can be stored.

    Attributes
    ----------
    content
        The canonical scenario file.
    summary
        What the API shows of it.
    """

    name: str | None
    content: str
    sha256: str
    summary: dict[str, Any]


def freeze(
    database: Database, body: ScenarioIn, limits: ScenarioLimits, owner: str | None
) -> FrozenScenario:
    """Return the frozen form of a scenario made of stored things. Stores nothing.

    Parameters
    ----------
    owner
        Whose forecasts it may name; None for those of all owners.

    Raises
    ------
    InvalidScenario
        ``unknown_satellite``, ``unknown_target_catalog``, ``unknown_ground_station``,
        ``duplicate_satellite_id``, ``duplicate_target_catalog_id``, ``duplicate_target_id``,
        ``duplicate_ground_station_id``, ``horizon_inverted``, ``horizon_too_long``,
        ``scenario_too_large``, ``duplicate_pin``, ``ambiguous_name``, ``unknown_forecast``,
        ``forecast_does_not_cover``; with a pointer into the body.
    PropagationFailed
        If SGP4 cannot propagate a satellite through the horizon.
    """
    with database.reading() as session:
        number = num_targets(session, body.target_catalog_ids)
        limits.check(horizon_from(body.horizon), len(body.satellite_ids), number)
        file = _expanded(session, body)
        if body.forecast_id is not None:
            stored = find_forecast(session, body.forecast_id, owner)
            file = file.model_copy(update={"forecast": frozen_forecast(stored, file)})
    with pointing(_in_ids):
        frozen = freeze_file(with_settled_pins(file), limits)
    return replace(frozen, summary=frozen.summary | {"forecast_id": body.forecast_id})


def freeze_file(file: ScenarioFile, limits: ScenarioLimits) -> FrozenScenario:
    """Return the frozen form of a file returned by `translate.read_file`; errors as above."""
    scenario = checked_scenario(file, limits)
    content = canonical_of_file(file)
    return FrozenScenario(
        name=file.name,
        content=content,
        sha256=sha256_of(content),
        summary=_summary(file, (*orbit_warnings(scenario), *usual_mistakes(scenario))),
    )


def checked_scenario(file: ScenarioFile, limits: ScenarioLimits) -> Scenario:
    """Return a file's scenario, checking its size and that its elements cover the horizon."""
    limits.check(horizon_from(file.horizon), len(file.satellites), len(file.targets))
    scenario = scenario_from_file(file)
    check_propagation(scenario)
    check_element_age(scenario)
    return scenario


def save(
    session: Session, frozen: FrozenScenario, owner: str | None = None
) -> tuple[ScenarioRow, bool]:
    """Return the stored scenario with this content, and whether it is new.

    Parameters
    ----------
    owner
        Who alone sees it, unless the same is stored for all; None to store it for all.
    """
    same = sa.select(ScenarioRow).where(ScenarioRow.sha256 == frozen.sha256)
    stored = session.scalar(same)
    if stored is None:
        # Another request may store the same content just now; then both get that row.
        is_new = inserted(
            session,
            ScenarioRow,
            id=new_id(),
            sha256=frozen.sha256,
            name=frozen.name,
            summary=frozen.summary,
            content=frozen.content,
            created_at=datetime.now(UTC),
        )
        stored = session.scalars(same).one()
        if is_new:
            store.note_parts(session, stored.id, frozen.summary)
            if owner is not None:
                store.let_see(session, stored.id, owner)
            return stored, True
    if owner is not None:
        store.let_see_too(session, stored.id, owner)
        return stored, False
    # A caller who stores for all is not told that somebody already had it privately.
    return stored, store.disown(session, stored.id)


def _in_ids(fault: Fault) -> str:
    """Return the location in a list of ids, for a fault in the file made from it."""
    if fault.code == "forecast_does_not_cover":
        return "/forecast_id"
    return re.sub(r"^/satellites/(\d+).*", r"/satellite_ids/\1", fault.pointer or "")


def num_targets(session: Session, catalog_ids: Sequence[str]) -> int:
    """Return how many targets the catalogues hold, without reading them."""
    total = sa.func.coalesce(sa.func.sum(TargetCatalogRow.num_targets), 0)
    wanted = sa.select(total).where(TargetCatalogRow.id.in_(set(catalog_ids)))
    return int(session.scalars(wanted).one())


def _expanded(session: Session, body: ScenarioIn) -> ScenarioFile:
    shared = fields_of(body, Question)
    del shared["outages"]
    satellites = satellites_of(session, body.satellite_ids)
    if "objective" not in body.model_fields_set:
        shared["objective"] = default_objective(satellite.spacecraft for satellite in satellites)
    return ScenarioFile(
        **shared,
        satellites=satellites,
        targets=_targets(session, body.target_catalog_ids),
        ground_stations=_ground_stations(session, body.ground_station_ids),
        outages=_outages(session, body),
    )


def _outages(session: Session, body: ScenarioIn) -> list[PlacedOutage]:
    """Return the scenario's own outages, and the stored ones that concern it."""
    stored = outage_store.concerning(
        session, body.satellite_ids, body.ground_station_ids, body.horizon.start, body.horizon.end
    )
    named = {one.id for one in body.outages}
    return [*body.outages, *(outage_store.placed(row) for row in stored if row.id not in named)]


def satellites_of(session: Session, ids: Sequence[str]) -> list[FileSatellite]:
    """Return stored satellites with their current elements, as in a scenario file."""
    rows = _find(session, SatelliteRow, "satellite", ids)
    elements = satellite_store.in_force(session, ids)
    return [
        _of_today(
            FileSatellite,
            {
                "id": row.id,
                "name": row.name,
                "spacecraft": row.spacecraft if row.spacecraft in BUILT_IN else None,
                "agility": row.agility,
                "sensor": row.sensor,
                "resources": row.resources,
                **elements[row.id].orbit,
            },
            f"/satellite_ids/{position}",
        )
        for position, row in enumerate(rows)
    ]


def _targets(session: Session, catalog_ids: Sequence[str]) -> list[FileTarget]:
    targets = targets_by_catalog(session, catalog_ids)
    seen: set[str] = set()
    for position, target in targets:
        if target.id in seen:
            raise InvalidScenario(
                "duplicate_target_id",
                f"Target {target.id!r} is in an earlier catalogue too.",
                pointer=f"/target_catalog_ids/{position}",
            )
        seen.add(target.id)
    return [target for _, target in targets]


def targets_by_catalog(
    session: Session, catalog_ids: Sequence[str]
) -> list[tuple[int, FileTarget]]:
    """Return the targets of catalogues, each with its catalogue's index; none may be missing."""
    _find(session, TargetCatalogRow, "target_catalog", catalog_ids)
    targets: list[tuple[int, FileTarget]] = []
    for position, catalog_id in enumerate(catalog_ids):
        of_catalog = sa.select(TargetRow).where(TargetRow.catalog_id == catalog_id)
        for row in session.scalars(of_catalog.order_by(TargetRow.position)):
            body = row.body | {"catalog_id": catalog_id}
            target = _of_today(FileTarget, body, f"/target_catalog_ids/{position}")
            targets.append((position, target))
    return targets


def _ground_stations(session: Session, ids: Sequence[str]) -> list[FileGroundStation]:
    rows = _find(session, GroundStationRow, "ground_station", ids)
    return [
        _of_today(FileGroundStation, {"id": row.id, **row.body}, f"/ground_station_ids/{position}")
        for position, row in enumerate(rows)
    ]


def _of_today(model: type[M], body: dict[str, Any], pointer: str) -> M:
    """Return a stored thing validated as of today; an earlier release may have stored it."""
    try:
        return model.model_validate(body)
    except ValidationError as error:
        first = faults_of_validation(error, body)[0]
        name = body.get("name") or body["id"]
        detail = f"The stored {name!r} must be changed at {first.pointer}: {first.detail}"
        raise InvalidScenario(first.code, detail, pointer=pointer) from None


def _find(session: Session, table: type[R], what: str, ids: Sequence[str]) -> list[R]:
    """Return the rows with these ids, in order; none may be missing or named twice."""
    query = sa.select(table).where(table.id.in_(set(ids)), table.deleted_at.is_(None))
    rows = {row.id: row for row in session.scalars(query)}
    for position, own_id in enumerate(ids):
        pointer = f"/{what}_ids/{position}"
        words = what.replace("_", " ")
        if own_id not in rows:
            raise InvalidScenario(
                f"unknown_{what}", f"There is no {words} {own_id!r}.", pointer=pointer
            )
        if own_id in ids[:position]:
            raise InvalidScenario(
                f"duplicate_{what}_id", f"The {words} {own_id!r} is named twice.", pointer=pointer
            )
    return [rows[own_id] for own_id in ids]


def _summary(file: ScenarioFile, warnings: Iterable[str]) -> dict[str, Any]:
    shown = file.model_dump(
        mode="json", include=set(Question.model_fields) - {"name", "pins", "outages", "states"}
    )
    catalogs = dict.fromkeys(t.catalog_id for t in file.targets if t.catalog_id is not None)
    return shown | {
        "satellite_ids": [satellite.id for satellite in file.satellites],
        "target_catalog_ids": list(catalogs),
        "ground_station_ids": [station.id for station in file.ground_stations],
        "counts": {
            "satellites": len(file.satellites),
            "targets": len(file.targets),
            "ground_stations": len(file.ground_stations),
        },
        "has_forecast": file.forecast is not None,
        "warnings": list(warnings),
    }
