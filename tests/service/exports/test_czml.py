"""CZML, read by another library and interpolated as Cesium does it."""

from __future__ import annotations

import json
from datetime import datetime, timedelta

import czml3
import numpy as np
import pytest
from skyfield.api import EarthSatellite, load
from skyfield.framelib import itrs

from planner_core.orbits.ephemeris import propagate
from service.answers.answered import Answered
from service.exports import czml
from tests.missions import PAPER_ORBIT, Document
from tests.service.exports.conftest import Mission


@pytest.fixture
def packets(answered: Answered) -> dict[str, Document]:
    text = "".join(czml.write(answered))
    document = json.loads(text)
    return {packet["id"]: packet for packet in document}


def lagrange(packet: Document, t_s: float) -> np.ndarray:
    """Return a sampled position as a client computes it, from the degree and the samples around."""
    position = packet["position"]
    samples = np.array(position["cartesian"]).reshape(-1, 4)
    number = position["interpolationDegree"] + 1
    first = int(np.searchsorted(samples[:, 0], t_s)) - number // 2
    near = samples[np.clip(first, 0, len(samples) - number) :][:number]
    at = near[:, 0]
    weights = [
        np.prod([(t_s - at[j]) / (at[i] - at[j]) for j in range(number) if j != i])
        for i in range(number)
    ]
    return np.asarray(weights @ near[:, 1:])


def test_another_library_takes_the_whole_document(answered: Answered) -> None:
    text = "".join(czml.write(answered))
    document = czml3.Document.model_validate_json(text)
    assert document.packets[0].version == "1.0"
    ids = [packet.id for packet in document.packets]
    assert len(set(ids)) == len(ids)
    kinds = [own_id.partition("/")[0] for own_id in ids]
    assert [kinds.count(k) for k in ("satellite", "station", "target")] == [2, 3, 63]


def test_satellites_are_where_another_propagator_sees_them(packets: dict[str, Document]) -> None:
    packet = packets["satellite/sat/1#a"]
    timescale = load.timescale(builtin=True)
    satellite = EarthSatellite.from_omm(timescale, PAPER_ORBIT)
    start = datetime.fromisoformat(packet["position"]["epoch"])
    for t_s in (0.0, 31.0, 1234.5, 43_210.0, 86_390.0):
        at = timescale.from_datetime(start + timedelta(seconds=t_s))
        seen_m = satellite.at(at).frame_xyz(itrs).m
        assert np.linalg.norm(lagrange(packet, t_s) - seen_m) < 50.0


def test_interpolation_stays_within_a_metre_of_the_planners_path(
    mission: Mission, packets: dict[str, Document]
) -> None:
    scenario = mission.scenario
    for satellite in scenario.satellites:
        packet = packets[f"satellite/{satellite.id}"]
        path = propagate(satellite, scenario.horizon)
        drawn = np.random.default_rng(0).uniform(0.0, scenario.horizon.duration_s, 200)
        there, _ = path.state_itrf(drawn)
        apart = [np.linalg.norm(lagrange(packet, t) - p) for t, p in zip(drawn, there, strict=True)]
        assert max(apart) < 1.0


def test_targets_wear_the_colour_of_their_outcome(
    mission: Mission, packets: dict[str, Document]
) -> None:
    colours = {
        (told["outcome"], tuple(packets[f"target/{told['target_id']}"]["point"]["color"]["rgba"]))
        for told in mission.told
    }
    outcomes = {outcome for outcome, _ in colours}
    assert len(colours) == len(outcomes) == len({colour for _, colour in colours}) >= 2
    out_of_reach = packets["target/@out of reach"]["properties"]
    assert out_of_reach == {"outcome": "unscheduled", "reason": "no_access"}


def test_a_line_joins_satellite_and_station_during_contacts_only(
    answered: Answered, packets: dict[str, Document]
) -> None:
    shown = {
        (own_id, interval)
        for own_id, packet in packets.items()
        if own_id.startswith("contact/")
        for interval in packet["availability"]
    }
    meant = {
        (f"contact/{satellite['id']}/{a['station_id']}", f"{a['start']}/{a['end']}")
        for satellite, a in answered.each_action()
        if a["mode"] == "contact"
    }
    assert shown == meant
    line = packets["contact/sat/1#a/Svalbard"]["polyline"]["positions"]["references"]
    assert line == ["satellite/sat/1\\#a#position", "station/Svalbard#position"]


def test_the_clock_runs_over_the_horizon(packets: dict[str, Document]) -> None:
    clock = packets["document"]["clock"]
    assert clock["interval"] == "2019-01-01T00:00:00.000Z/2019-01-02T00:00:00.000Z"
    assert clock["currentTime"] == "2019-01-01T00:00:00.000Z"
