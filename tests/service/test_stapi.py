"""STAPI against the running service, by links and by the community's models."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, TypeVar

import httpx
import pytest
from geojson_pydantic.geometries import Geometry
from pydantic import BaseModel
from stapi_pydantic import (
    Link,
    OpportunityCollection,
    OpportunityProperties,
    Order,
    OrderCollection,
    OrderStatus,
    OrderStatuses,
    ProductsCollection,
    RootResponse,
)

from tests.service.factories import ground_station, post, satellite, tle
from tests.service.jobs.mission import Mission, running
from tests.service.problems import assert_problem

M = TypeVar("M", bound=BaseModel)
Document = dict[str, Any]
Found = OpportunityCollection[Geometry, OpportunityProperties]
NOW = datetime.now(UTC).replace(microsecond=0)
START, END = NOW - timedelta(hours=6), NOW + timedelta(hours=30)
DAY = START.replace(hour=0, minute=0, second=0)
SPAN = f"{START.isoformat()}/{END.isoformat()}"
PLACE = {"type": "Point", "coordinates": [8.5, 47.4]}
ASKED = {"datetime": SPAN, "geometry": PLACE}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mission]:
    with running(tmp_path_factory.mktemp("stapi")) as mission:
        for number in range(4):
            orbit = tle(97_000 + number, epoch=DAY, raan_deg=45.0 * number)
            post(mission.http, "/v1/satellites", satellite(name=f"EYE-{number}", tle=orbit))
        post(mission.http, "/v1/ground-stations", ground_station())
        yield mission


@pytest.fixture(scope="module")
def http(service: Mission) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service.http.base_url, timeout=60, trust_env=False) as client:
        yield client


def read(model: type[M], answer: httpx.Response) -> M:
    """Return an answer as read by the community's models."""
    assert answer.is_success, answer.text
    return model.model_validate_json(answer.content)


def follow(http: httpx.Client, links: list[Link], rel: str) -> httpx.Response:
    """Follow the link of a relation, as STAPI clients do."""
    (link,) = (one for one in links if one.rel == rel)
    return http.request(link.method or "GET", str(link.href), json=link.body)


def product_of(http: httpx.Client) -> Any:
    root = read(RootResponse, http.get("/stapi/"))
    (product,) = read(ProductsCollection, follow(http, root.links, "products")).products
    return product


def place(http: httpx.Client, **fields: Any) -> Order[OrderStatus]:
    body = ASKED | {"order_parameters": {"reward": 5}} | fields
    return read(Order[OrderStatus], http.post("/stapi/products/paper/orders", json=body))


def codes(http: httpx.Client, order: Order[OrderStatus]) -> list[str]:
    found = read(OrderStatuses[OrderStatus], follow(http, order.links, "monitor")).statuses
    assert [one.timestamp for one in found] == sorted(one.timestamp for one in found)
    seen = read(Order[OrderStatus], follow(http, order.links, "self"))
    assert seen.properties.status == found[-1]
    return [str(one.status_code) for one in found]


def planned(service: Mission, order: Order[OrderStatus]) -> tuple[Document, Document]:
    """Return the published plan of an order's catalogue, and its timeline."""
    http = service.http
    satellites = http.get("/v1/satellites").json()["items"]
    (station,) = http.get("/v1/ground-stations").json()["items"]
    body = {
        "horizon": {"start": START.isoformat(), "end": END.isoformat()},
        "satellite_ids": [one["id"] for one in satellites],
        "target_catalog_ids": [order.properties.model_extra["target_catalog_id"]],  # type: ignore[index]
        "ground_station_ids": [station["id"]],
        "objective": "delivered",
    }
    scenario = post(http, "/v1/scenarios", body)
    asked = {"scenario_id": scenario["id"], "solver": "certified", "limits": {"time_s": 5}}
    job = service.ended(http.post("/v1/jobs", json=asked))
    plan = post(http, "/v1/plans", {"job_id": job["id"]})
    for state in ("approved", "published"):
        more = {"effective_from": START.isoformat()} if state == "published" else {}
        post(http, f"/v1/plans/{plan['id']}/transitions", {"to": state} | more)
    return plan, service.timeline(job)


def report(service: Mission, plan: Document, *actions: Document) -> None:
    body = [{"action_id": one["id"], "outcome": "executed"} for one in actions]
    post_any = service.http.post(f"/v1/plans/{plan['id']}/executions", json=body)
    assert post_any.status_code == 201, post_any.text


def test_an_order_is_seen_planned_collected_and_delivered(
    service: Mission, http: httpx.Client
) -> None:
    product = product_of(http)
    searched = http.post(f"/stapi/products/{product.id}/opportunities", json=ASKED)
    found = read(Found, searched)
    assert found.features
    (link,) = (one for one in found.links if one.rel == "create-order")
    body = link.body | {"order_parameters": {"reward": 7}}
    order = read(Order[OrderStatus], http.post(str(link.href), json=body))
    assert codes(http, order) == ["received"]

    plan, timeline = planned(service, order)
    assert codes(http, order) == ["received", "scheduled"]
    (collect,) = (
        action | {"satellite": one}
        for one in timeline["satellites"]
        for action in one["actions"]
        if action.get("target_id") == order.id
    )
    spans = [one.properties.datetime for one in found.features]  # type: ignore[union-attr]
    start, end = (datetime.fromisoformat(collect[name]) for name in ("start", "end"))
    assert any(first <= start and end <= last for first, last in spans)

    report(service, plan, collect)
    assert codes(http, order) == ["received", "scheduled", "processing"]
    contacts = [
        action
        for action in collect["satellite"]["actions"]
        if action["mode"] == "contact"
        and action["start"] <= collect["delivered_at"] <= action["end"]
    ]
    report(service, plan, *contacts)
    assert codes(http, order) == ["received", "scheduled", "processing", "completed"]


def test_orders_are_listed_page_by_page(http: httpx.Client) -> None:
    placed = [place(http).id for _ in range(3)]
    listed = read(OrderCollection[OrderStatus], http.get("/stapi/orders", params={"limit": 2}))
    assert [one.id for one in listed] == placed[:0:-1]
    more = read(OrderCollection[OrderStatus], follow(http, listed.links, "next"))
    assert more[0].id == placed[0]


def test_a_filter_narrows_searches_and_orders(http: httpx.Client) -> None:
    # The opportunities depend on the date, and a page may be full with and without a filter.
    asked = ASKED | {"limit": 100}
    everything = read(Found, http.post("/stapi/products/paper/opportunities", json=asked))
    angles = sorted(one.properties.off_nadir_deg for one in everything.features)  # type: ignore[union-attr]
    limit = (angles[0] + angles[-1]) / 2
    narrow = {"op": "<=", "args": [{"property": "off_nadir_deg"}, limit]}
    low = {"op": ">=", "args": [{"property": "elevation_deg"}, 10]}
    both = {"op": "and", "args": [narrow, low]}
    body = asked | {"filter": both}
    some = read(Found, http.post("/stapi/products/paper/opportunities", json=body))
    assert 0 < len(some.features) < len(everything.features)
    assert all(one.properties.off_nadir_deg <= limit for one in some.features)  # type: ignore[union-attr]
    order = place(http, filter=both)
    catalog = order.properties.model_extra["target_catalog_id"]  # type: ignore[index]
    targets = http.get(f"/v1/target-catalogs/{catalog}/targets", params={"limit": 500}).json()
    (target,) = (one for one in targets["items"] if one["id"] == order.id)
    assert (target["off_nadir_max_deg"], target["min_elevation_deg"]) == (limit, 10)


def test_opportunities_come_page_by_page(http: httpx.Client) -> None:
    address = "/stapi/products/paper/opportunities"
    whole = read(Found, http.post(address, json=ASKED | {"limit": 100}))
    starts, answer = [], http.post(address, json=ASKED | {"limit": 1})
    for _ in whole.features:
        page = read(Found, answer)
        starts += [one.properties.datetime for one in page.features]  # type: ignore[union-attr]
        if any(one.rel == "next" for one in page.links):
            answer = follow(http, page.links, "next")
    assert starts == [one.properties.datetime for one in whole.features]  # type: ignore[union-attr]


def test_a_deleted_catalogue_cancels_its_orders_and_a_new_one_follows(http: httpx.Client) -> None:
    order = place(http)
    catalog = order.properties.model_extra["target_catalog_id"]  # type: ignore[index]
    assert http.delete(f"/v1/target-catalogs/{catalog}").status_code == 204
    assert codes(http, order) == ["received", "cancelled"]
    after = place(http)
    assert after.properties.model_extra["target_catalog_id"] != catalog  # type: ignore[index]
    assert codes(http, after) == ["received"]


def test_an_order_of_the_past_has_expired(http: httpx.Client) -> None:
    span = f"{START.isoformat()}/{(START + timedelta(hours=1)).isoformat()}"
    assert codes(http, place(http, datetime=span)) == ["received", "expired"]


def nested(depth: int) -> Document:
    found: Document = {"op": "=", "args": [1, 1]}
    for _ in range(depth):
        found = {"op": "not", "args": [found]}
    return found


WRONG: list[tuple[Document, str, str | None]] = [
    ({"datetime": "tomorrow"}, "invalid_value", "/datetime"),
    ({"datetime": f"{END.isoformat()}/{START.isoformat()}"}, "invalid_value", "/datetime"),
    ({"geometry": {"type": "Polygon", "coordinates": []}}, "invalid_request", "/geometry/type"),
    ({"geometry": PLACE | {"coordinates": [8.5, 147.4]}}, "value_out_of_range", None),
    ({"filter": {"op": "zz"}}, "invalid_value", "/filter"),
    ({"filter": nested(90)}, "invalid_value", "/filter"),
    ({"more": 1}, "unknown_field", "/more"),
]


@pytest.mark.parametrize(("fields", "code", "pointer"), WRONG)
@pytest.mark.parametrize("call", ["opportunities", "orders"])
def test_what_is_wrong_is_told(
    http: httpx.Client, call: str, fields: Document, code: str, pointer: str | None
) -> None:
    body = ASKED | ({"order_parameters": {}} if call == "orders" else {}) | fields
    answer = http.post(f"/stapi/products/paper/{call}", json=body)
    assert_problem(answer, 422, code, pointer)


def test_a_filter_that_no_target_can_hold_is_refused(http: httpx.Client) -> None:
    most = {"op": "<=", "args": [{"property": "elevation_deg"}, 50]}
    answer = http.post("/stapi/products/paper/opportunities", json=ASKED | {"filter": most})
    assert_problem(answer, 422, "invalid_value", "/filter")


def test_bodies_and_pages_have_limits(http: httpx.Client) -> None:
    padded = ASKED | {"order_parameters": {}, "padding": "x" * 20_000}
    answer = http.post("/stapi/products/paper/orders", json=padded)
    assert_problem(answer, 413, "body_too_large")
    for limit in ("0", "101", "-1", "x"):
        assert_problem(
            http.get("/stapi/orders", params={"limit": limit}), 422, "value_out_of_range"
        )
    long = f"{START.isoformat()}/{(START + timedelta(days=90)).isoformat()}"
    answer = http.post("/stapi/products/paper/opportunities", json=ASKED | {"datetime": long})
    assert_problem(answer, 422, "horizon_too_long")


@pytest.mark.parametrize(
    "address", ["/stapi/products/none", "/stapi/orders/none", "/stapi/orders/none/statuses"]
)
def test_what_is_not_there_is_not_found(http: httpx.Client, address: str) -> None:
    assert_problem(http.get(address), 404, "not_found")


def test_a_bottomless_body_is_no_json(http: httpx.Client) -> None:
    content = '{"filter":' + "[" * 8_000
    headers = {"Content-Type": "application/json"}
    address = "/stapi/products/paper/opportunities"
    answer = http.post(address, content=content + "]" * 8_000 + "}", headers=headers)
    assert answer.status_code in (400, 413, 422), answer.text
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_type_without_satellites_is_no_product(http: httpx.Client) -> None:
    assert_problem(http.get("/stapi/products/generic_sar"), 404, "not_found")
    found = http.get("/stapi/products/paper/queryables").json()
    assert set(found["properties"]) == {"off_nadir_deg", "elevation_deg", "sun_elevation_deg"}


def test_an_own_type_is_a_product_as_soon_as_it_flies(http: httpx.Client) -> None:
    made = post(http, "/v1/spacecraft", {"name": "Twin", "resources": "paper"})
    assert http.get(f"/stapi/products/{made['id']}").status_code == 404
    orbit = tle(97_900, epoch=DAY)
    own = post(http, "/v1/satellites", {"name": "TWIN-1", "tle": orbit, "spacecraft": made["id"]})
    product = http.get(f"/stapi/products/{made['id']}").json()
    assert product["title"] == "Twin"
    links = {one["rel"]: one["href"] for one in product["links"]}
    body = ASKED | {"limit": 100}
    found = read(Found, http.post(links["opportunities"], json=body)).features
    assert {one.properties.satellite_id for one in found} == {own["id"]}  # type: ignore[union-attr]
    assert http.delete(f"/v1/satellites/{own['id']}").status_code == 204
    assert http.get(f"/stapi/products/{made['id']}").status_code == 404


def test_links_have_the_scheme_that_the_proxy_tells(http: httpx.Client) -> None:
    place(http)
    for path in ("/stapi/products", "/stapi/orders"):  # the second one is served as heavy
        told = http.get(path, headers={"X-Forwarded-Proto": "https"}).json()
        (first, *_) = told.get("products") or told["features"]
        assert {httpx.URL(link["href"]).scheme for link in first["links"]} == {"https"}
