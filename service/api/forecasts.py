"""Forecasts of clear skies: uploaded, listed, deleted."""

from __future__ import annotations

from typing import Annotated, Final

import sqlalchemy as sa
from fastapi import APIRouter, Query, Response

from service.api.conditional import matched, readable, unless_known
from service.api.deps import ANY_FILE, CallDep, RawBodyDep, file_type
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.imports import BYTES, request_body
from service.api.paging import PagingDep, newest_first
from service.db.rows import ForecastRow
from service.forecasts.csv_file import read_csv
from service.forecasts.fields import instant_of, sha256_of, to_bytes
from service.forecasts.netcdf_file import read_netcdf
from service.stores.finding import of_owner
from service.wire.base import Listed, Name
from service.wire.forecasts import ForecastOut
from service.wire.stored import from_row

router = APIRouter(prefix="/v1/forecasts", tags=["forecasts"])

_CSV: Final = "text/csv"
_NETCDF: Final = ("application/netcdf", "application/x-netcdf")
_UNNAMED: Final = "Forecast"

_REQUEST_BODY: Final = request_body(
    {
        _CSV: {
            "type": "string",
            "description": "A full grid, `time,lat_deg,lon_deg,clear_probability`; or values by "
            "target, `target_id,time,clear_probability`.",
        },
        ANY_FILE: BYTES,
        _NETCDF[0]: {
            "type": "string",
            "format": "binary",
            "description": "NetCDF 4 with axes of time, latitude, longitude and optionally "
            "member: `clear_probability` from 0 to 1, or total cloud cover (`tcc` or the standard "
            "name `cloud_area_fraction`), from 0 to 1 or in %.",
        },
    }
)


@router.post(
    "", status_code=201, openapi_extra=_REQUEST_BODY, responses=problem_responses(413, 415)
)
def create_forecast(
    call: CallDep,
    data: RawBodyDep,
    once: OnceDep,
    name: Annotated[Name | None, Query(description="Name for people.")] = None,
    default_clear_probability: Annotated[
        float | None,
        Query(ge=0, le=1, description="For targets and instants that the file does not cover."),
    ] = None,
) -> ForecastOut:
    """Store a forecast, whole or not at all. Only its owner sees it.

    Scenarios that name it copy its values for their targets, so that deleting it, or uploading
    the next one, does not change them.
    """
    kind = file_type(call.request, data, _CSV, *_NETCDF)
    field, notes = read_csv(data) if kind == _CSV else read_netcdf(data)
    block = to_bytes(field)
    with once.transaction() as session:
        call.count_stored(session, num_rows=1, num_bytes=len(block))
        row = ForecastRow(
            owner=call.caller.owner,
            name=name or _UNNAMED,
            sha256=sha256_of(field),
            first_at=instant_of(field.first_ms),
            last_at=instant_of(field.last_ms),
            default_clear_probability=default_clear_probability,
            summary=field.describe() | {"notes": notes},
            block=block,
        )
        session.add(row)
        session.flush()
        return once.created(session, "forecast", row.id, _shown(row))


@router.get("")
def list_forecasts(call: CallDep, paging: PagingDep) -> Listed[ForecastOut]:
    """List your forecasts, newest first; the scope `admin` sees all."""
    query = sa.select(ForecastRow).where(of_owner(ForecastRow.owner, call.caller.visible_owner))
    with call.database.reading() as session:
        return newest_first(session, query, ForecastRow.id, paging).listed(_shown)


@router.get("/{forecast_id}", response_model=ForecastOut, responses=readable())
def get_forecast(forecast_id: str, call: CallDep) -> ForecastOut | Response:
    """Return the description of one forecast, without its values."""
    with call.database.reading() as session:
        return unless_known(call, _shown(call.own(session, ForecastRow, "forecast", forecast_id)))


@router.delete("/{forecast_id}", status_code=204, responses=problem_responses(404, 412))
def delete_forecast(forecast_id: str, call: CallDep) -> None:
    """Delete a forecast. Scenarios that use it keep its values for their targets."""
    with call.noted("delete", "forecast", forecast_id) as session:
        row = matched(call, call.own(session, ForecastRow, "forecast", forecast_id), _shown)
        session.delete(row)


def _shown(row: ForecastRow) -> ForecastOut:
    return from_row(ForecastOut, row, first=row.first_at, last=row.last_at, **row.summary)
