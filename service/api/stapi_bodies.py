"""Bodies of STAPI's searches and orders, with limits that the library does not set.

The library accepts any geometry and any CQL2 filter, however deep. These models are checked first,
and accept what a target can express.
"""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Final, Literal

from pydantic import Field, field_validator
from stapi_pydantic import OpportunityProperties, OrderParameters, Queryables

from service.problems.faults import refuse_one
from service.wire.base import Body, Duration, NonNegative, parse_instant

Angle = Annotated[float, Field(ge=0, le=90)]
Property = Literal["off_nadir_deg", "elevation_deg", "sun_elevation_deg"]

LIMITS: Final[dict[tuple[str, str], str]] = {
    ("off_nadir_deg", "<="): "off_nadir_max_deg",
    ("off_nadir_deg", ">="): "off_nadir_min_deg",
    ("elevation_deg", ">="): "min_elevation_deg",
    ("sun_elevation_deg", ">="): "sun_elevation_min_deg",
    ("sun_elevation_deg", "<="): "sun_elevation_max_deg",
}
"""The limit of a target that each comparison sets."""


Span = tuple[datetime, datetime]


class StapiQueryables(Queryables):
    """Properties that a filter may compare with <= or >=, several of them joined by "and"."""

    off_nadir_deg: Angle | None = Field(None, description="At the satellite.")
    elevation_deg: Angle | None = Field(None, description="At the target; >= only.")
    sun_elevation_deg: Annotated[float, Field(ge=-90, le=90)] | None = Field(
        None, description="Of the sun at the target."
    )


class StapiOrderParameters(OrderParameters):
    """Parameters of an order besides point, time and filter."""

    reward: NonNegative = Field(1.0, description="What an image earns: its priority.")
    collect_s: Duration = Field(30.0, description="How long one image takes.")


class StapiOpportunity(OpportunityProperties):
    """An access of one satellite to the point. Angles are those at its middle."""

    satellite_id: str
    satellite_name: str
    off_nadir_deg: float
    elevation_deg: float
    azimuth_deg: float
    sun_elevation_deg: float


class PointIn(Body):
    """A GeoJSON point."""

    type: Literal["Point"]
    coordinates: list[float] = Field(
        min_length=2, max_length=3, description="Longitude, latitude, and metres of altitude."
    )


class _Named(Body):
    property: Property


class ComparisonIn(Body):
    """A comparison of a queryable with a number (CQL2)."""

    op: Literal["<=", ">="]
    args: Annotated[tuple[_Named, float], Field(strict=False)]


class AllIn(Body):
    """Several comparisons that hold together (CQL2)."""

    op: Literal["and"]
    args: list[ComparisonIn] = Field(min_length=2, max_length=5)


class _AskIn(Body):
    datetime: str = Field(max_length=100)
    geometry: PointIn
    filter: Annotated[ComparisonIn | AllIn, Field(discriminator="op")] | None = None

    @field_validator("datetime")
    @classmethod
    def _is_span(cls, value: str) -> str:
        start, end = _span(value)
        if end <= start:
            raise ValueError("the end must be later than the start")
        return value

    @property
    def span(self) -> Span:
        """Return when it starts and ends."""
        return _span(self.datetime)

    def as_target(self, own_id: str, **fields: Any) -> dict[str, Any]:
        """Return the fields of the target with this point, span and filter.

        Raises
        ------
        ServiceError
            If the filter compares what no target limits.
        """
        lon_deg, lat_deg, *above = self.geometry.coordinates
        start, end = self.span
        made = {
            "id": own_id,
            "lon_deg": lon_deg,
            "lat_deg": lat_deg,
            "alt_m": above[0] if above else 0.0,
            "release": start,
            "due": end,
        }
        return made | self._limits() | fields

    def _limits(self) -> dict[str, float]:
        match self.filter:
            case None:
                return {}
            case AllIn(args=parts):
                pass
            case single:
                parts = [single]
        found: dict[str, float] = {}
        for part in parts:
            named, number = part.args
            limit = LIMITS.get((named.property, part.op))
            if limit is None or limit in found:
                detail = f"{named.property} {part.op} is not supported here, or is given twice."
                raise refuse_one("invalid_value", detail, "/filter")
            found[limit] = number
        return found


class SearchIn(_AskIn):
    """The body of a search for opportunities."""

    next: Annotated[str, Field(pattern=r"^[0-9]{1,9}$")] | None = None
    limit: int = Field(10, ge=1, le=100)


class OrderIn(_AskIn):
    """The body of an order."""

    order_parameters: StapiOrderParameters


def _span(text: str) -> Span:
    parts = text.split("/")
    if len(parts) != 2:
        raise ValueError("two instants separated by a slash are needed")
    return parse_instant(parts[0]), parse_instant(parts[1])
