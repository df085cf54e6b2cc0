"""GeoJSON against the rules of RFC 7946, and its shapes against another geometry library."""

from __future__ import annotations

import itertools
import json
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from shapely.geometry import Point, shape
from skyfield.api import EarthSatellite, load, wgs84

from planner_core.domain import GroundStation
from planner_core.orbits.ground_track import visibility_ring
from service.answers.answered import Answered
from service.exports import geojson
from service.exports.antimeridian import area
from service.scenarios.canonical import canonical
from tests.missions import PAPER_ORBIT, Document
from tests.service.answers import answered_of
from tests.service.exports.conftest import FINISHED_AT, Mission

LON, LAT = (
    {"type": "number", "minimum": -180, "maximum": 180},
    {
        "type": "number",
        "minimum": -90,
        "maximum": 90,
    },
)
POSITION: Document = {"type": "array", "prefixItems": [LON, LAT], "minItems": 2, "maxItems": 2}
LINE: Document = {"type": "array", "items": POSITION, "minItems": 2}
RING: Document = {"type": "array", "items": POSITION, "minItems": 4}
POLYGON: Document = {"type": "array", "items": RING, "minItems": 1}


def geometry(name: str, coordinates: Document) -> Document:
    return {
        "properties": {"type": {"const": name}, "coordinates": coordinates},
        "required": ["type", "coordinates"],
        "additionalProperties": False,
    }


RFC_7946: Document = {
    "type": "object",
    "required": ["type", "features"],
    "properties": {
        "type": {"const": "FeatureCollection"},
        "features": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["type", "geometry", "properties"],
                "properties": {
                    "type": {"const": "Feature"},
                    "id": {"type": "string"},
                    "properties": {"type": "object"},
                    "geometry": {
                        "oneOf": [
                            geometry("Point", POSITION),
                            geometry("LineString", LINE),
                            geometry("MultiLineString", {"type": "array", "items": LINE}),
                            geometry("Polygon", POLYGON),
                            geometry("MultiPolygon", {"type": "array", "items": POLYGON}),
                        ]
                    },
                },
            },
        },
        # Section 7.1: members defined for other types of object must not appear.
        "coordinates": False,
        "geometries": False,
        "geometry": False,
        "properties": False,
    },
}


@pytest.fixture
def collection(answered: Answered) -> Document:
    document: Document = json.loads("".join(geojson.write(answered)))
    return document


def features(collection: Document, kind: str) -> list[Document]:
    return [f for f in collection["features"] if f["properties"]["kind"] == kind]


def test_the_collection_is_of_the_standard(collection: Document) -> None:
    Draft202012Validator(RFC_7946).validate(collection)
    ids = [feature["id"] for feature in collection["features"]]
    assert len(set(ids)) == len(ids)
    for feature in collection["features"]:
        assert shape(feature["geometry"]).is_valid, feature["id"]


def test_rings_turn_as_the_standard_says_and_close(collection: Document) -> None:
    for feature in features(collection, "visibility"):
        geometry = shape(feature["geometry"])
        for polygon in getattr(geometry, "geoms", [geometry]):
            assert polygon.exterior.is_ccw
            assert polygon.exterior.coords[0] == polygon.exterior.coords[-1]


def test_every_target_is_there_with_what_became_of_it(
    collection: Document, mission: Mission
) -> None:
    shown = features(collection, "target")
    actions = {action["id"]: action for _, action in mission.answered.each_action()}
    assert len(shown) == len(mission.told) == 63
    for feature, told in zip(shown, mission.told, strict=True):
        properties = feature["properties"]
        for name in ("target_id", "outcome", "action_id", "satellite_id"):
            assert properties[name] == told[name]
        assert properties["reason"] == (told["reason"] or {}).get("code")
        action = actions.get(told["action_id"], {})
        for name in ("start", "end"):
            assert properties[name] == action.get(name)
    by_id = {f["properties"]["target_id"]: f for f in shown}
    assert by_id["-1+1"]["geometry"]["coordinates"] == [-170.0, 60.0]
    assert by_id['\'=late, "pole"']["properties"]["reward"] == 2.5
    assert {f["properties"]["outcome"] for f in shown} >= {"downlinked", "unscheduled"}


def test_tracks_are_where_another_propagator_sees_the_satellite(collection: Document) -> None:
    track = features(collection, "track")[0]
    satellite = EarthSatellite.from_omm(load.timescale(builtin=True), PAPER_ORBIT)
    timescale = load.timescale(builtin=True)
    coordinates, times = track["geometry"]["coordinates"], track["properties"]["times"]
    assert [len(line) for line in coordinates] == [len(line) for line in times]
    instants = list(itertools.chain(*times))
    assert instants == sorted(instants)
    assert (instants[0], instants[-1]) == ("2019-01-01T00:00:00.000Z", "2019-01-02T00:00:00.000Z")
    for line, moments in zip(coordinates[1:8], times[1:8], strict=True):
        for (lon, lat), text in list(zip(line, moments, strict=True))[1:-1:7]:
            when = timescale.from_datetime(datetime.fromisoformat(text))
            seen = wgs84.subpoint(satellite.at(when))
            assert lat == pytest.approx(seen.latitude.degrees, abs=3e-4)
            off = (lon - seen.longitude.degrees + 180.0) % 360.0 - 180.0
            assert off * np.cos(np.radians(lat)) == pytest.approx(0.0, abs=3e-4)


def test_tracks_are_sampled_every_half_minute_and_never_cross_the_map(
    collection: Document,
) -> None:
    for track in features(collection, "track"):
        assert track["geometry"]["type"] == "MultiLineString"
        moments = [datetime.fromisoformat(t) for line in track["properties"]["times"] for t in line]
        steps = [b - a for a, b in itertools.pairwise(moments)]
        assert max(steps) <= timedelta(seconds=30)
        for line in track["geometry"]["coordinates"]:
            assert np.abs(np.diff(np.array(line)[:, 0])).max() <= 90.0


def test_a_track_that_stays_on_the_map_is_one_line(mission: Mission) -> None:
    file = json.loads(mission.content)
    file["horizon"]["end"] = "2019-01-01T00:01:40Z"
    short = answered_of(mission.timeline, mission.targets, canonical(file), FINISHED_AT)
    collection = json.loads("".join(geojson.write(short)))
    Draft202012Validator(RFC_7946).validate(collection)
    for track in features(collection, "track"):
        assert track["geometry"]["type"] == "LineString"
        assert len(track["geometry"]["coordinates"]) == len(track["properties"]["times"]) == 5
        assert track["properties"]["times"][-1] == "2019-01-01T00:01:40.000Z"


def test_a_station_reaches_what_lies_inside_its_circle(collection: Document) -> None:
    circles = features(collection, "visibility")
    satellites = {s for f in circles for s in f["properties"]["satellite_ids"]}
    assert satellites == {"sat/1#a", 'EYE "2"'}
    stations = {f["properties"]["station_id"] for f in circles}
    assert stations == {"Svalbard", "Troll", "Suva"}
    by_station = {
        (f["properties"]["station_id"], "sat/1#a" in f["properties"]["satellite_ids"]): f
        for f in circles
    }
    assert shape(by_station["Svalbard", True]["geometry"]).contains(Point(-120.0, 89.9))
    suva = by_station["Suva", True]["geometry"]
    assert suva["type"] == "MultiPolygon"
    assert shape(suva).contains(Point(179.0, -18.0))
    assert shape(suva).contains(Point(-179.0, -18.0))


def area_of(**place: Any) -> Any:
    station = GroundStation(id="s", name="s", **place)
    return shape(area(*visibility_ring(station, 600_000.0), 6))


@pytest.mark.parametrize("lat_deg", [-90.0, -72.0, 0.0, 78.2, 89.99])
@pytest.mark.parametrize("lon_deg", [-180.0, 15.4, 190.0])
def test_circles_agree_with_an_independent_look_at_the_sky(lat_deg: float, lon_deg: float) -> None:
    shown = area_of(lat_deg=lat_deg, lon_deg=lon_deg, min_elevation_deg=10.0)
    assert shown.is_valid
    timescale = load.timescale(builtin=True)
    at = timescale.utc(2026, 1, 1)
    place = wgs84.latlon(lat_deg, lon_deg)
    drawn = np.random.default_rng(0)
    wrong = 0
    for lat, lon in zip(
        np.degrees(np.arcsin(drawn.uniform(-1, 1, 60))), drawn.uniform(-180, 180, 60), strict=True
    ):
        there = wgs84.latlon(float(lat), float(lon), elevation_m=600_000.0)
        elevation_deg = (there - place).at(at).altaz()[0].degrees
        if abs(elevation_deg - 10.0) > 0.5:  # the ring is a polygon
            wrong += shown.contains(Point(float(lon), float(lat))) != (elevation_deg > 10.0)
    assert wrong == 0
