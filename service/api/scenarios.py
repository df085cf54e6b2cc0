"""Scenarios: frozen questions, and the opportunities they offer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
import sqlalchemy as sa
from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from planner_core.access.scenario_opportunities import view_at
from planner_core.orbits.sites import View
from planner_core.problem import COLLECT, CONTACT, Opportunities
from service.access.callers import Caller
from service.api import job_intake as intake
from service.api.conditional import etag_of, located, matched, readable, sent, unless_known
from service.api.deps import CallDep, found
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.paging import (
    NameQuery,
    PagingDep,
    SatelliteQuery,
    StationQuery,
    StoredDep,
    by_name,
    newest_first,
    size_of,
)
from service.db.rows import ScenarioRow
from service.scenarios.opportunities import Described
from service.scenarios.stored_question import StoredQuestion
from service.stores import deletion, scenario_store
from service.wire.base import Listed
from service.wire.scenarios import (
    Kind,
    OpportunityOut,
    ScenarioFile,
    ScenarioIn,
    ScenarioOut,
    ScenarioSummary,
    ViewOut,
)
from service.wire.stored import from_row

router = APIRouter(prefix="/v1/scenarios", tags=["scenarios"])

_KINDS: dict[str, int] = {"collect": COLLECT, "contact": CONTACT}


@router.post(
    "",
    status_code=201,
    responses={200: {"model": ScenarioOut, "description": "The same scenario is stored already."}},
)
def create_scenario(body: ScenarioIn, call: CallDep, once: OnceDep) -> ScenarioOut:
    """Freeze a planning question: everything it names is copied into it.

    If the same content is stored already, under any name, the answer is 200 with that scenario.
    """
    frozen = intake.freeze(call, body)
    with once.transaction() as session:
        row, is_new = intake.save(session, call, frozen)
        call.response.status_code = 201 if is_new else 200
        return once.keep(session, located(call, _shown(row), f"/v1/scenarios/{row.id}"))


@router.get("")
def list_scenarios(
    call: CallDep,
    paging: PagingDep,
    stored: StoredDep,
    name: NameQuery = None,
    satellite_id: SatelliteQuery = None,
    station_id: StationQuery = None,
) -> Listed[ScenarioSummary]:
    """List the scenarios, newest first, without their pins, outages and states.

    Those that were sent with a job, or made by a what-if, are listed only for their owner; the
    scope `admin` sees all.
    """
    query = sa.select(ScenarioRow).where(scenario_store.seen_by(call.caller.visible_owner))
    query = by_name(stored.narrow(query, ScenarioRow.created_at), ScenarioRow.name, name)
    query = query.where(*scenario_store.with_parts(ScenarioRow.id, satellite_id, station_id))
    with call.database.reading() as session:
        weight = size_of(ScenarioRow.summary)
        return newest_first(session, query, ScenarioRow.id, paging, weight).listed(_summary)


@router.get("/{scenario_id}", response_model=ScenarioOut | ScenarioFile, responses=readable())
def get_scenario(
    scenario_id: str,
    call: CallDep,
    expand: Annotated[
        bool, Query(description="Return the self-contained scenario file instead.")
    ] = False,
) -> ScenarioOut | Response:
    """Return one scenario; with `expand`, as the file that `slewline solve` takes."""
    with call.database.reading() as session:
        row = _find(session, scenario_id, call.caller)
        if expand:
            text = StoredQuestion(row.content).exported(row.name)
            return sent(call.request, text, "application/json", {"ETag": etag_of(text)})
        return unless_known(call, _shown(row))


@router.delete("/{scenario_id}", status_code=204, responses=problem_responses(404, 409, 412))
def delete_scenario(scenario_id: str, call: CallDep) -> None:
    """Delete a scenario and its opportunities permanently, unless a job uses it."""
    with call.noted("delete", "scenario", scenario_id) as session:
        row = matched(call, _find(session, scenario_id, call.caller), _shown)
        deletion.delete_scenario(session, row)


@router.get("/{scenario_id}/opportunities", responses=problem_responses(404, 503))
def list_opportunities(
    scenario_id: str,
    call: CallDep,
    paging: PagingDep,
    target_id: Annotated[str | None, Query(description="Only collects of this target.")] = None,
    satellite_id: Annotated[str | None, Query(description="Only with this satellite.")] = None,
    kind: Annotated[Kind | None, Query(description="Only collects or only contacts.")] = None,
    edges: Annotated[bool, Query(description="Add the geometry at start and end.")] = False,
) -> Listed[OpportunityOut]:
    """List the opportunities of a scenario, in order of start.

    The first call computes them, which may take a while: 503 with `Retry-After` asks to try
    again later.
    """
    with call.database.reading() as session:
        sha256 = _find(session, scenario_id, call.caller).sha256
    described = intake.described(call, scenario_id, sha256)
    rows = _matching(described, target_id, satellite_id, kind)
    first = int(np.searchsorted(rows, paging.after_number(), side="right"))
    page = paging.answer(rows[first : first + paging.limit + 1].tolist(), lambda row: row)
    seen = _edges(described, page.rows) if edges else [{} for _ in page.rows]
    items = [_opportunity(described, row, **at) for row, at in zip(page.rows, seen, strict=True)]
    return Listed(items=items, next=page.next)


def _edges(described: Described, rows: Sequence[int]) -> list[dict[str, ViewOut]]:
    """Return the geometry at start and end of each of these opportunities."""
    scenario, table = described.scenario, described.computed.opportunities
    chosen = np.array(rows, dtype=np.int64)
    first = view_at(scenario, table, chosen, table.start_s[chosen])
    last = view_at(scenario, table, chosen, table.end_s[chosen])
    return [
        {"at_start": ViewOut(**_seen(first, i)), "at_end": ViewOut(**_seen(last, i))}
        for i in range(len(rows))
    ]


def _seen(seen: View | Opportunities, row: int) -> dict[str, Any]:
    """Return the geometry between a satellite and a site, as answers show it."""
    angles = ("off_nadir_deg", "elevation_deg", "azimuth_deg", "sun_elevation_deg")
    return {
        **{name: round(float(getattr(seen, name)[row]), 6) for name in angles},
        "range_km": round(float(seen.range_m[row]) / 1000.0, 6),
        "eclipse": bool(seen.in_eclipse[row]),
    }


def _matching(
    described: Described, target_id: str | None, satellite_id: str | None, kind: Kind | None
) -> np.ndarray[Any, np.dtype[np.int64]]:
    scenario, table = described.scenario, described.computed.opportunities
    wanted = np.ones(len(table), dtype=np.bool_)
    if kind is not None:
        wanted &= table.kind == _KINDS[kind]
    if satellite_id is not None:
        known = [i for i, s in enumerate(scenario.satellites) if s.id == satellite_id]
        wanted &= np.isin(table.satellite, known)
    if target_id is not None:
        sites = [i for i, t in enumerate(scenario.targets) if t.id == target_id]
        wanted &= (table.kind == COLLECT) & np.isin(table.site, sites)
    return np.flatnonzero(wanted)


def _opportunity(described: Described, row: int, **edges: ViewOut) -> OpportunityOut:
    scenario, table = described.scenario, described.computed.opportunities
    is_collect = int(table.kind[row]) == COLLECT
    sites = scenario.targets if is_collect else scenario.ground_stations
    site = sites[int(table.site[row])]
    satellite = scenario.satellites[int(table.satellite[row])]
    at = scenario.horizon.instant
    return OpportunityOut(
        id=f"o{row}",
        satellite_id=satellite.id,
        satellite_name=satellite.name,
        kind="collect" if is_collect else "contact",
        target_id=site.id if is_collect else None,
        target_name=site.name if is_collect else None,
        station_id=None if is_collect else site.id,
        station_name=None if is_collect else site.name,
        start=at(float(table.start_s[row])),
        end=at(float(table.end_s[row])),
        access_start=at(float(table.access_start_s[row])),
        access_end=at(float(table.access_end_s[row])),
        nadir=satellite.sensor.nadir,
        **_seen(table, row),
        **edges,
    )


def _find(session: Session, scenario_id: str, caller: Caller) -> ScenarioRow:
    row = scenario_store.find(session, scenario_id, caller.visible_owner)
    return found(row, "scenario", scenario_id)


def _shown(row: ScenarioRow) -> ScenarioOut:
    question = StoredQuestion(row.content)
    parts = {name: getattr(question, name) for name in ("pins", "outages", "states")}
    return ScenarioOut(**dict(_summary(row)), **parts)


def _summary(row: ScenarioRow) -> ScenarioSummary:
    where = f"/v1/scenarios/{row.id}"
    summary = {name: value for name, value in row.summary.items() if name != "pins"}
    links = {"opportunities": f"{where}/opportunities", "file": f"{where}?expand=true"}
    return from_row(ScenarioSummary, row, links=links, **summary)
