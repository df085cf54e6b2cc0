"""STAPI, the sensor tasking interface, with the community's library `stapi-fastapi`.

The library makes a router for each product when the process starts. Spacecraft types come and go,
so one router serves them all: its product is a template, whose id is a path parameter.
"""

from __future__ import annotations

from typing import Any, Final

from fastapi import Depends, Request
from fastapi.datastructures import URL
from pydantic import AnyUrl, ValidationError
from returns.maybe import Maybe, Nothing, Some
from returns.result import ResultE, Success
from stapi_fastapi.conformance import API, PRODUCT
from stapi_fastapi.models.product import Product
from stapi_fastapi.routers.product_router import ProductRouter
from stapi_fastapi.routers.root_router import RootRouter
from stapi_pydantic import (
    Opportunity,
    OpportunityPayload,
    Order,
    OrderPayload,
    OrderStatus,
    ProductsCollection,
)
from stapi_pydantic import Product as ProductShown
from starlette.concurrency import run_in_threadpool

from service.api import stapi_backend as backend
from service.api.deps import CallDep
from service.api.stapi_bodies import (
    OrderIn,
    SearchIn,
    StapiOpportunity,
    StapiOrderParameters,
    StapiQueryables,
)
from service.problems.faults import refuse_one, validated
from service.problems.kinds import ServiceError

PREFIX: Final = "/stapi"
MOST_BYTES: Final = 16_384
"""Largest body: a point, a span and a few numbers."""
_MOST_ON_A_PAGE: Final = 100


async def _check_call(call: CallDep) -> None:
    """Refuse requests that the library would fail on, and keep the call for later steps."""
    request = call.request
    request.state.call = call
    try:
        AnyUrl(str(request.base_url))
    except ValidationError:
        raise refuse_one("invalid_value", "The header Host names no host.") from None
    limit = request.query_params.get("limit", "1")
    if not (limit.isdecimal() and len(limit) < 9 and 1 <= int(limit) <= _MOST_ON_A_PAGE):
        raise refuse_one(
            "value_out_of_range", f"limit must be a number from 1 to {_MOST_ON_A_PAGE}."
        )


async def _check_product(product_id: str, request: Request, call: CallDep) -> None:
    """Find the product that the path names; read the body before the library does."""
    request.state.product = await run_in_threadpool(backend.find_product, call, product_id)
    if request.method != "POST":
        return
    if len(await request.body()) > MOST_BYTES:
        raise ServiceError("body_too_large", f"A body here may have at most {MOST_BYTES} bytes.")
    model = OrderIn if request.url.path.endswith("/orders") else SearchIn
    request.state.asked = validated(model, await request.json())


class _Products(ProductRouter):
    """The router of all products; it shows the product that was found for the request."""

    @staticmethod
    def url_for(request: Request, name: str, /, **path_params: Any) -> URL:
        """Return the address of a call about the same product."""
        return request.url_for(name, product_id=request.state.product.shown.id, **path_params)

    def get_product(self, request: Request) -> ProductShown:
        """Return this product."""
        found: backend.Found = request.state.product
        return found.shown.with_links(super().get_product(request).links)


class _Root(RootRouter):
    """The library's root router, with products that are looked up."""

    def __init__(self, template: Product, **kwargs: Any):
        super().__init__(**kwargs)
        self._products = _Products(template, self, dependencies=[Depends(_check_product)])
        self.include_router(self._products, prefix=f"/products/{template.id}")

    def get_products(
        self,
        request: Request,
        next: str | None = None,  # noqa: A002 - the name is the library's, and STAPI's
        limit: int = 10,
    ) -> ProductsCollection:
        """List the products, by id."""
        found = backend.products(request.state.call)
        rest = [one for one in found if next is None or one.shown.id >= next]
        links = []
        if len(rest) > limit:
            name = f"{self.name}:list-products"
            links.append(self.pagination_link(request, name, rest[limit].shown.id, limit))
        shown = []
        for one in rest[:limit]:
            request.state.product = one
            shown.append(self._products.get_product(request))
        return ProductsCollection(products=shown, links=links)


# Called by the library, with its own models of a body; the checked ones are in the request.


async def _search(
    _router: ProductRouter,
    _search: OpportunityPayload,
    _next: str | None,
    _limit: int,
    request: Request,
) -> ResultE[tuple[list[Opportunity[Any, Any]], Maybe[str]]]:
    state = request.state
    found, number = await run_in_threadpool(backend.search, state.call, state.product, state.asked)
    last = int(state.asked.next or 0) + len(found)
    return Success((found, Some(str(last)) if last < number else Nothing))


async def _create_order(
    _router: ProductRouter, _payload: OrderPayload[Any], request: Request
) -> ResultE[Order[OrderStatus]]:
    state = request.state
    return Success(
        await run_in_threadpool(backend.create_order, state.call, state.product, state.asked)
    )


async def _get_orders(
    after: str | None, limit: int, request: Request
) -> ResultE[tuple[list[Order[OrderStatus]], Maybe[str], Maybe[int]]]:
    orders, last, number = await run_in_threadpool(
        backend.list_orders, request.state.call, after, limit
    )
    return Success((orders, Maybe.from_optional(last), Some(number)))


async def _get_order(order_id: str, request: Request) -> ResultE[Maybe[Order[OrderStatus]]]:
    return Success(Some(await run_in_threadpool(backend.find_order, request.state.call, order_id)))


async def _get_order_statuses(
    order_id: str, _next: str | None, _limit: int, request: Request
) -> ResultE[Maybe[tuple[list[OrderStatus], Maybe[str]]]]:
    # There are at most four, which fit on one page.
    found = await run_in_threadpool(backend.statuses, request.state.call, order_id)
    return Success(Some((found, Nothing)))


router = _Root(
    Product(
        id="{product_id}",
        license="proprietary",
        conformsTo=[PRODUCT.geojson_point],
        create_order=_create_order,
        search_opportunities=_search,
        queryables=StapiQueryables,
        opportunity_properties=StapiOpportunity,
        order_parameters=StapiOrderParameters,
    ),
    name="stapi",
    prefix=PREFIX,
    conformances=[API.core],
    openapi_endpoint_name="openapi",
    docs_endpoint_name="docs",
    get_orders=_get_orders,
    get_order=_get_order,
    get_order_statuses=_get_order_statuses,
    dependencies=[Depends(_check_call)],
    # The interface has a document of its own: https://github.com/stapi-spec/stapi-spec
    include_in_schema=False,
)
