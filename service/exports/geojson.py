"""GeoJSON (RFC 7946): targets with outcomes, ground tracks, stations and their visibility."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from datetime import datetime, timedelta
from typing import Final

import numpy as np
import numpy.typing as npt

from planner_core.domain import GroundStation, Horizon, Satellite
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.ground_track import sub_points, visibility_ring
from service.answers.answered import Answered, Document, chunked, compact, listed
from service.exports.antimeridian import Piece, area, pieces_of_line
from service.wire.instants import instant_text

TRACK_STEP_S = 30.0
_DECIMALS = 4  # of a degree: 11 metres
_CLASS_KM = 10.0
_INSTANTS: Final = ("start", "end", "delivered_at")
_OF_IMAGES: Final = ("quality", "clear_probability")  # from 0 to 1
_TOLD: Final = np.dtype([(n, "u4") for n in _INSTANTS] + [(n, "u2") for n in _OF_IMAGES])
_SHARE: Final = 10_000
_UNKNOWN: Final = 65_535
_NEVER: Final = 2**32 - 1
_MILLISECOND: Final = timedelta(milliseconds=1)


@chunked
def write(answered: Answered) -> Iterator[str]:
    """Yield a FeatureCollection; each feature's property ``kind`` says what it is."""
    names = ("job", "scenario_sha256", "plan_sha256", "horizon")
    head = {name: answered.head[name] for name in names}
    yield f'{{"type":"FeatureCollection",{compact(head)[1:-1]},"features":[\n'
    # A loop would hold each feature until the next one exists.
    yield from listed(map(compact, _features(answered)))
    yield "\n]}\n"


def _features(answered: Answered) -> Iterator[Document]:
    yield from _targets(answered)
    yield from _stations(answered)
    horizon = answered.question.horizon
    reaches: dict[float, list[str]] = {}
    for satellite in answered.question.satellites:
        path = propagate(satellite, horizon)
        yield _track(satellite, horizon, path)
        reaches.setdefault(_altitude_class_km(path), []).append(satellite.id)
    for station in answered.question.ground_stations:
        for altitude_km, satellite_ids in sorted(reaches.items()):
            yield _reach(station, altitude_km, satellite_ids)


def _feature(kind: str, own_id: str, geometry: Document, **properties: object) -> Document:
    return {
        "type": "Feature",
        "id": f"{kind}/{own_id}",
        "geometry": geometry,
        "properties": {"kind": kind, **properties},
    }


def _point(lon_deg: float, lat_deg: float) -> Document:
    # Catalogues may give longitudes up to 360.
    lon = lon_deg - 360.0 if lon_deg > 180.0 else lon_deg
    return {"type": "Point", "coordinates": [round(lon, 7), round(lat_deg, 7)]}


def _targets(answered: Answered) -> Iterator[Document]:
    actions = _Actions(answered)
    names = {satellite["id"]: satellite["name"] for satellite in answered.satellites}
    before = {one["target_id"]: one["delivered_at"] for one in answered.each_image_on_board()}
    for target, told in zip(answered.question.each_target(), answered.each_target(), strict=True):
        done = actions.of(told["action_id"])
        reason = told["reason"]
        yield _feature(
            "target",
            target.id,
            _point(target.lon_deg, target.lat_deg),
            target_id=target.id,
            target_name=target.name,
            target_catalog_id=target.catalog_id,
            outcome=told["outcome"],
            reason=reason and reason["code"],
            reason_detail=reason and reason["detail"],
            action_id=told["action_id"],
            satellite_id=told["satellite_id"],
            satellite_name=names.get(told["satellite_id"]),
            start=done["start"],
            end=done["end"],
            delivered_at=before.get(target.id) or done["delivered_at"],
            reward=target.reward,
            worth=told.get("worth"),
            **{name: done[name] for name in _OF_IMAGES},
        )


class _Actions:
    """Start and end of actions, the figures of their images, and when those are delivered.

    Stored only as small numbers, since there may be very many: milliseconds from the horizon's
    start, and shares in ten-thousandths.
    """

    def __init__(self, answered: Answered):
        self._start = answered.question.horizon.start
        # Action ids are numbered through all satellites: a1, a2, ...
        each = (self._numbers(action) for _, action in answered.each_action())
        self._told = np.fromiter(each, dtype=_TOLD)

    def of(self, action_id: str | None) -> Document:
        """Return what is known of an action; null for what is not, or if there is none."""
        if action_id is None:
            return dict.fromkeys(_INSTANTS + _OF_IMAGES)
        numbers = self._told[int(action_id.removeprefix("a")) - 1].item()
        told = dict(zip(_INSTANTS + _OF_IMAGES, numbers, strict=True))
        instants = {name: self._instant(told[name]) for name in _INSTANTS}
        return instants | {name: _share(told[name]) for name in _OF_IMAGES}

    def _numbers(self, action: Document) -> tuple[int, ...]:
        # Answers of the first release have no figures of images.
        instants, shares = ([action.get(n) for n in names] for names in (_INSTANTS, _OF_IMAGES))
        return (
            *(_NEVER if at is None else self._ms(at) for at in instants),
            *(_UNKNOWN if share is None else round(share * _SHARE) for share in shares),
        )

    def _ms(self, instant: str) -> int:
        return (datetime.fromisoformat(instant) - self._start) // _MILLISECOND

    def _instant(self, ms: int) -> str | None:
        return None if ms == _NEVER else instant_text(self._start + ms * _MILLISECOND)


def _share(number: int) -> float | None:
    return None if number == _UNKNOWN else number / _SHARE


def _stations(answered: Answered) -> Iterator[Document]:
    contacts = Counter(action["station_id"] for _, action in answered.each_action())
    for station in answered.question.ground_stations:
        yield _feature(
            "station",
            station.id,
            _point(station.lon_deg, station.lat_deg),
            station_id=station.id,
            station_name=station.name,
            name=station.name,
            min_elevation_deg=station.min_elevation_deg,
            antennas=station.antennas,
            contacts=contacts[station.id],
        )


def _track(satellite: Satellite, horizon: Horizon, path: Ephemeris) -> Document:
    num_steps = max(1, math.ceil(horizon.duration_s / TRACK_STEP_S - 1e-9))
    t_s = np.linspace(0.0, horizon.duration_s, num_steps + 1)
    lon_deg, lat_deg, _ = sub_points(path, t_s)
    pieces = list(pieces_of_line(lon_deg, lat_deg, t_s))
    lines = [_coordinates(piece) for piece in pieces]
    times = [_instants(horizon, piece.t_s) for piece in pieces]
    is_one = len(pieces) == 1
    return _feature(
        "track",
        satellite.id,
        {
            "type": "LineString" if is_one else "MultiLineString",
            "coordinates": lines[0] if is_one else lines,
        },
        satellite_id=satellite.id,
        satellite_name=satellite.name,
        name=satellite.name,
        norad_cat_id=satellite.orbit.norad_cat_id,
        times=times[0] if is_one else times,
    )


def _coordinates(piece: Piece) -> list[list[float]]:
    points = np.stack([piece.lon_deg, piece.lat_deg], axis=1).round(_DECIMALS)
    coordinates: list[list[float]] = points.tolist()
    return coordinates


def _instants(horizon: Horizon, t_s: npt.NDArray[np.float64]) -> list[str]:
    """Return the texts of many instants at once; `instant_text` for each would take seconds."""
    start = np.datetime64(horizon.instant(0.0).replace(tzinfo=None), "ms")
    instants = start + np.rint(t_s * 1000.0).astype("timedelta64[ms]")
    texts: list[str] = np.datetime_as_string(instants, timezone="UTC").tolist()
    return texts


def _altitude_class_km(path: Ephemeris) -> float:
    _, _, altitude_m = sub_points(path, path.node_s)
    return float(max(1.0, np.rint(altitude_m.mean() / 1000.0 / _CLASS_KM)) * _CLASS_KM)


def _reach(station: GroundStation, altitude_km: float, satellite_ids: list[str]) -> Document:
    ring = visibility_ring(station, altitude_km * 1000.0)
    return _feature(
        "visibility",
        f"{station.id}/{altitude_km:g}",
        area(*ring, _DECIMALS),
        station_id=station.id,
        station_name=station.name,
        altitude_km=altitude_km,
        min_elevation_deg=station.min_elevation_deg,
        satellite_ids=satellite_ids,
    )
