"""The operations behind STAPI's calls: products, opportunities and orders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from geojson_pydantic import Point
from pydantic import ValidationError
from sqlalchemy.orm import Session
from stapi_fastapi.conformance import PRODUCT
from stapi_pydantic import Opportunity, Order, OrderStatus
from stapi_pydantic import Product as ProductShown

from planner_core.errors import Fault
from service.api.deps import Call, found
from service.api.stapi_bodies import OrderIn, SearchIn, StapiOpportunity
from service.db.ids import new_id
from service.db.rows import OrderRow, SpacecraftRow
from service.plans.order_tracking import Step, steps_of
from service.problems.faults import faults_of_validation, refuse
from service.scenarios.opportunities import Described
from service.scenarios.spacecraft_views import fleet_of, types_flown, views_of
from service.scenarios.translate import target_from
from service.stores import order_store
from service.stores.finding import find, no_such, of_owner
from service.wire.scenarios import FileTarget
from service.wire.sites import TargetIn
from service.wire.spacecraft_types import BUILT_IN

_WHY = {
    "received": "Waiting to be planned.",
    "scheduled": "A published plan includes an image of it.",
    "processing": "The image was taken, and is on board.",
    "completed": "The image is on the ground.",
    "expired": "The time interval of the order has passed.",
    "cancelled": "The catalogue of the order was deleted.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A product: a spacecraft type that has satellites."""

    shown: ProductShown
    sensor_type: str | None


def products(call: Call) -> list[Found]:
    """Return the products, by id."""
    with call.database.reading() as session:
        flown = [_product(session, type_id) for type_id in types_flown(session)]
    return [one for one in flown if one is not None]


def find_product(call: Call, product_id: str) -> Found:
    """Return one product; 404 if no satellite is of this type."""
    with call.database.reading() as session:
        product = _product(session, product_id) if product_id in types_flown(session) else None
    return found(product, "product", product_id)


def _product(session: Session, type_id: str) -> Found | None:
    row = None if type_id in BUILT_IN else find(session, SpacecraftRow, type_id)
    if row is None and type_id not in BUILT_IN:
        return None  # deleted, while its satellites fly on
    body: Any = BUILT_IN[type_id] if row is None else row.body
    name = type_id if row is None else row.name
    shown = ProductShown(
        id=type_id,
        title=name,
        description=f"An image of a point by a satellite of the type {name}.",
        license="proprietary",
        conformsTo=[PRODUCT.geojson_point, PRODUCT.opportunities],
    )
    return Found(shown=shown, sensor_type=body["sensor"].get("sensor_type"))


def search(call: Call, product: Found, asked: SearchIn) -> tuple[list[Opportunity[Any, Any]], int]:
    """Return a page of the opportunities of a point, and their total number."""
    start, end = asked.span
    target = FileTarget.model_validate(_target(asked, new_id(), product).model_dump())
    with call.database.reading() as session:
        fleet = fleet_of(session, product.shown.id)
    if not fleet:  # the last satellite was deleted a moment ago
        raise no_such("product", product.shown.id)
    described = views_of(fleet, target, start, end, call.settings.scenario_limits)
    first = int(asked.next or 0)
    number = len(described.computed.opportunities)
    rows = range(first, min(first + asked.limit, number))
    return [_opportunity(described, row, product, asked) for row in rows], number


def _opportunity(
    described: Described, row: int, product: Found, asked: SearchIn
) -> Opportunity[Any, Any]:
    table, scenario = described.computed.opportunities, described.scenario
    satellite = scenario.satellites[int(table.satellite[row])]
    at = scenario.horizon.instant
    span = at(float(table.access_start_s[row])), at(float(table.access_end_s[row]))
    properties = StapiOpportunity(
        datetime=span,
        product_id=product.shown.id,
        satellite_id=satellite.id,
        satellite_name=satellite.name,
        off_nadir_deg=round(float(table.off_nadir_deg[row]), 6),
        elevation_deg=round(float(table.elevation_deg[row]), 6),
        azimuth_deg=round(float(table.azimuth_deg[row]), 6),
        sun_elevation_deg=round(float(table.sun_elevation_deg[row]), 6),
    )
    point = Point.model_validate(asked.geometry.model_dump())
    return Opportunity(type="Feature", geometry=point, properties=properties)


def _target(asked: SearchIn | OrderIn, own_id: str, product: Found) -> TargetIn:
    fields = {"sensor_type": product.sensor_type}
    if isinstance(asked, OrderIn):
        fields |= asked.order_parameters.model_dump()
    body = asked.as_target(own_id, **fields)
    try:
        target = TargetIn.model_validate(body)
    except ValidationError as error:
        # The pointers would be into a target, which the client did not send.
        faults = faults_of_validation(error, body)
        raise refuse([Fault(code=one.code, detail=one.detail) for one in faults]) from None
    target_from(target)
    return target


def create_order(call: Call, product: Found, asked: OrderIn) -> Order[OrderStatus]:
    """Store an order as a target of the owner's standing catalogue."""
    target = _target(asked, new_id(), product).model_dump(mode="json")
    sent = asked.model_dump(mode="json")
    with call.database.transaction() as session:
        call.count_stored(session, num_rows=1, num_bytes=len(str(sent)) + len(str(target)))
        row = order_store.add(session, call.caller.owner, product.shown.id, target, sent)
        call.audit.record(session, "create", "order", row.id)
        return _order(row, [Step(code="received", at=row.created_at)])


def list_orders(
    call: Call, after: str | None, limit: int
) -> tuple[list[Order[OrderStatus]], str | None, int]:
    """Return a page of the caller's orders, newest first, its last id if more follow, the total."""
    wanted = sa.select(OrderRow).where(of_owner(OrderRow.owner, call.caller.visible_owner))
    with call.database.reading() as session:
        count = session.scalar(sa.select(sa.func.count()).select_from(wanted.subquery())) or 0
        if after is not None:
            wanted = wanted.where(OrderRow.id < after)
        read = session.scalars(wanted.order_by(OrderRow.id.desc()).limit(limit + 1)).all()
        rows = read[:limit]
        orders = [
            _order(row, steps) for row, steps in zip(rows, steps_of(session, rows), strict=True)
        ]
    return orders, rows[-1].id if len(read) > limit else None, count


def find_order(call: Call, order_id: str) -> Order[OrderStatus]:
    """Return one of the caller's orders."""
    row, steps = _find(call, order_id)
    return _order(row, steps)


def statuses(call: Call, order_id: str) -> list[OrderStatus]:
    """Return the statuses that one of the caller's orders has had, in order of time."""
    return [_status(step) for step in _find(call, order_id)[1]]


def _find(call: Call, order_id: str) -> tuple[OrderRow, Sequence[Step]]:
    with call.database.reading() as session:
        row = call.own(session, OrderRow, "order", order_id)
        return row, steps_of(session, [row])[0]


def _order(row: OrderRow, steps: Sequence[Step]) -> Order[OrderStatus]:
    asked = OrderIn.model_validate(row.sent)
    return Order.model_validate(
        {
            "id": row.id,
            "geometry": asked.geometry.model_dump(),
            "properties": {
                "product_id": row.product_id,
                "created": row.created_at,
                "status": _status(steps[-1]),
                "search_parameters": {
                    "datetime": asked.span,
                    "geometry": asked.geometry.model_dump(),
                    "filter": row.sent["filter"],
                },
                "opportunity_properties": {},
                "order_parameters": row.sent["order_parameters"],
                "target_catalog_id": row.catalog_id,
            },
        }
    )


def _status(step: Step) -> OrderStatus:
    return OrderStatus.model_validate(
        {"timestamp": step.at, "status_code": step.code, "reason_text": _WHY[step.code]}
    )
