"""Scenario files: equal scenarios have one canonical form; faults have a pointer."""

from __future__ import annotations

import contextlib
import json
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.domain import Objective, Quality, Resources
from planner_core.errors import InvalidScenario, PlannerError
from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.translate import read_file, scenario_from_content
from service.wire.base import MOST
from tests.service import factories
from tests.service.factories import ground_station, target, tle


def satellite(**fields: Any) -> dict[str, Any]:
    """Return the same satellite each time, except for these fields."""
    return factories.satellite(tle=tle()) | fields


def file(**fields: Any) -> dict[str, Any]:
    return {
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-02T00:00:00Z"},
        "satellites": [satellite()],
        "targets": [target()],
    } | fields


def test_names_become_ids_that_are_unique() -> None:
    made = scenario_from_content(
        file(
            satellites=[satellite(), satellite(), satellite(name="B", id="EYE-1-2")],
            ground_stations=[ground_station(id="North"), ground_station()],
        )
    )
    assert [s.id for s in made.satellites] == ["EYE-1", "EYE-1-3", "EYE-1-2"]
    assert [g.id for g in made.ground_stations] == ["North", "North-2"]


def test_own_figures_become_fractions_per_second() -> None:
    own = {
        "battery_capacity_wh": 100.0,
        "sunpoint_power_w": 36.0,
        "collect_power_w": 72.0,
        "contact_power_w": 18.0,
        "recorder_capacity_mbit": 4000.0,
        "collect_rate_mbit_s": 400.0,
        "downlink_rate_mbit_s": 200.0,
        "telemetry_rate_mbit_s": 0.004,
    }
    made = scenario_from_content(file(satellites=[satellite(resources=own)]))
    resources = made.satellites[0].resources
    assert resources.sunpoint_charge_per_s == pytest.approx(36.0 / 360_000.0)
    assert resources.collect_drain_per_s == pytest.approx(72.0 / 360_000.0)
    assert resources.contact_drain_per_s == pytest.approx(18.0 / 360_000.0)
    assert resources.collect_fill_per_s == pytest.approx(0.1)
    assert resources.downlink_per_s == pytest.approx(0.05)
    assert resources.telemetry_per_s == pytest.approx(1e-6)
    assert resources.recorder_capacity_mbit == 4000.0
    assert (resources.battery_min_fraction, resources.recorder_max_fraction) == (0.3, 0.75)


@pytest.mark.parametrize("preset", ["paper", "paper_code"])
def test_presets_follow_the_orbits_period(preset: str) -> None:
    made = scenario_from_content(file(satellites=[satellite(resources=preset)]))
    expected = {"paper": Resources.paper, "paper_code": Resources.paper_code}[preset]
    assert made.satellites[0].resources == expected(86400.0 / 15.0)


def test_the_canonical_form_is_its_own_canonical_form() -> None:
    text = canonical(file(ground_stations=[ground_station()], name="x"))
    assert canonical(json.loads(text)) == text
    assert '"name":"x"' not in text


@pytest.mark.parametrize(
    "same",
    [
        {"name": "Another name"},
        {"use_resources": True},
        {"horizon": {"start": "2026-03-01T01:00:00+01:00", "end": "2026-03-02 00:00:00.0004Z"}},
        {"satellites": [satellite(agility={"slew_rate_deg_s": 1}, id="EYE-1")]},
        {"satellites": [satellite(tle=[line + "  " for line in tle()])]},
        {"targets": [target(reward=1, collect_s=30)]},
        {"ground_stations": []},
        {"targets": [target(release=None, due=None, sensor_type=None)]},
        {"satellites": [satellite(sensor={"sensor_type": None})]},
        {"collect_alignment": "access"},
        {"quality": {}},
        {"quality": {"off_nadir_deg": [], "sun_elevation_deg": []}},
        {"objective": "collected"},
        {"objective": "paper"},
        {"objective": {}},
        {"objective": {"collected_share": 1, "half_life_s": 3600}},
    ],
)
def test_the_same_question_has_the_same_hash(same: dict[str, Any]) -> None:
    assert sha256_of(canonical(file(**same))) == sha256_of(canonical(file()))


@pytest.mark.parametrize(
    "other",
    [
        {"use_resources": False},
        {"dynamics": "paper"},
        {"satellites": [satellite(id="7")]},
        {"satellites": [satellite(tle=tle(raan_deg=11.0))]},
        {"targets": [target(), target(id="t2")]},
        {"targets": [target(catalog_id="c")]},
        {"targets": [target(release="2026-03-01T10:00:00Z")]},
        {"targets": [target(due="2026-03-01T10:00:00Z")]},
        {"targets": [target(sensor_type="infrared")]},
        {"satellites": [satellite(sensor={"sensor_type": "infrared"})]},
        {"collect_spacing_s": 5.0, "collect_alignment": "horizon"},
        {"ground_stations": [ground_station()]},
        {"quality": {"off_nadir_deg": [[0, 1]]}},
        {"objective": "delivered"},
        {"objective": {"collected_share": 0.5}},
        {"objective": {"collected_share": 0.5, "half_life_s": 3600}},
        {"objective": {"prefer": ["early"]}},
        {"objective": {"collected_share": 0.5, "prefer": ["early"]}},
        {"objective": {"prefer": ["early", "off_nadir"]}},
        {"objective": {"prefer": ["off_nadir", "early"]}},
    ],
)
def test_another_question_has_another_hash(other: dict[str, Any]) -> None:
    assert sha256_of(canonical(file(**other))) != sha256_of(canonical(file()))


def test_questions_frozen_by_earlier_versions_keep_their_hash() -> None:
    """Created before targets had times and sensors a type."""
    stations = {"ground_stations": [ground_station()], "collect_spacing_s": 15.0}
    assert [sha256_of(canonical(file(**fields))) for fields in ({}, stations)] == [
        "ec8499406a946db350eb7b5ce64364c2a4fe4aa70ce8da18c9db220a82c98b7b",
        "de5abf2e2c8e4fa0d0fe1596b38f289a0e2a6ada3a6cfcccb4502d0b22b0dfdf",
    ]


def test_curves_survive_their_file() -> None:
    text = canonical(file(quality={"sun_elevation_deg": [[10, 0.5], [40, 1]]}))
    assert canonical(json.loads(text)) == text
    curve = ((10.0, 0.5), (40.0, 1.0))
    made = scenario_from_content(json.loads(text))
    assert made.quality == Quality(sun_elevation_deg=curve)


def test_an_objective_survives_its_file() -> None:
    text = canonical(file(objective={"collected_share": 0.5, "half_life_s": 7200}))
    assert canonical(json.loads(text)) == text
    made = scenario_from_content(json.loads(text))
    assert made.objective == Objective(collected_share=0.5, half_life_s=7200.0)
    named, spelled = ({"objective": o} for o in ("delivered", {"collected_share": 0}))
    assert canonical(file(**named)) == canonical(file(**spelled))


def test_preferences_survive_their_file() -> None:
    for share in (0.9, 1.0):
        text = canonical(file(objective={"collected_share": share, "prefer": ["sun", "balance"]}))
        assert canonical(json.loads(text)) == text
        made = scenario_from_content(json.loads(text))
        assert made.objective == Objective(collected_share=share, prefer=("sun", "balance"))
    with_half_life = {"half_life_s": 60, "prefer": ["sun"]}
    assert canonical(file(objective=with_half_life)) == canonical(
        file(objective={"prefer": ["sun"]})
    )


def test_an_objective_before_preferences_keeps_its_form() -> None:
    text = canonical(file(objective={"collected_share": 0.5, "half_life_s": 7200}))
    assert json.loads(text)["objective"] == {"collected_share": 0.5, "half_life_s": 7200.0}


def test_what_a_file_leaves_out_is_of_its_release() -> None:
    default = Objective(collected_share=0.9, prefer=("early", "off_nadir"))
    of_paper = satellite(spacecraft="paper")
    assert scenario_from_content(file()).objective == Objective()
    generic = satellite(spacecraft="generic_optical")
    generic.pop("resources", None)
    new = {"release": 2, "satellites": [generic]}
    assert scenario_from_content(file(**new)).objective == default
    assert scenario_from_content(file(release=2, satellites=[of_paper])).objective == Objective()
    spelled = {"collected_share": 0.9, "prefer": ["early", "off_nadir"]}
    assert canonical(file(**new, objective=spelled)) == canonical(file(**new))
    plain = file(**new, objective="paper")
    assert scenario_from_content(plain).objective == Objective()


@pytest.mark.parametrize(
    "objective",
    [
        "downlinked",
        {"collected_share": 1.1},
        {"half_life_s": 0},
        {"share": 1},
        {"prefer": ["late"]},
    ],
)
def test_an_objective_that_cannot_be_is_refused(objective: object) -> None:
    with pytest.raises(InvalidScenario) as refused:
        read_file(file(objective=objective))
    assert str(refused.value.fault.pointer).startswith("/objective")


def test_times_types_and_alignment_survive_their_file() -> None:
    asked = file(
        satellites=[satellite(sensor={"sensor_type": "infrared"})],
        targets=[
            target(release="2026-03-01T12:00:00+02:00", due="2026-03-01T11:00:00.25Z"),
            target(id="t2", sensor_type="infrared"),
        ],
        collect_spacing_s=5.0,
        collect_alignment="horizon",
    )
    text = canonical(asked)
    assert canonical(json.loads(text)) == text
    made = scenario_from_content(json.loads(text))
    first, second = made.targets
    assert first.release == datetime(2026, 3, 1, 10, tzinfo=UTC)
    assert first.due == datetime(2026, 3, 1, 11, 0, 0, 250_000, tzinfo=UTC)
    assert (first.sensor_type, second.sensor_type) == (None, "infrared")
    assert made.satellites[0].sensor.sensor_type == "infrared"
    assert made.collect_alignment == "horizon"


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        (
            {"targets": [target(release="2026-03-01T10:00:00Z", due="2026-03-01T09:00:00Z")]},
            "value_out_of_range",
            "/targets/0/due",
        ),
        ({"collect_alignment": "horizon"}, "value_out_of_range", "/collect_alignment"),
        ({"collect_alignment": "grid"}, "unknown_value", "/collect_alignment"),
        (
            {"quality": {"off_nadir_deg": [[0, 1], [20, 0.9], [20, 0.5]]}},
            "value_out_of_range",
            "/quality/off_nadir_deg/2",
        ),
        (
            {"quality": {"sun_elevation_deg": [[10, 1.5]]}},
            "value_out_of_range",
            "/quality/sun_elevation_deg/0",
        ),
        (
            {"quality": {"off_nadir_deg": [[0, 1], [20]]}},
            None,
            "/quality/off_nadir_deg/1",
        ),
        (
            {"quality": {"off_nadir_deg": [[0, 1], [20, "0.5"]]}},
            None,
            "/quality/off_nadir_deg/1/1",
        ),
        ({"quality": {"haze": [[0, 1]]}}, "unknown_field", "/quality/haze"),
        (
            {"quality": {"off_nadir_deg": [[0, 1]]}, "continuous_starts": True},
            "value_out_of_range",
            "/continuous_starts",
        ),
        ({"satellite_ids": []}, "unknown_field", "/satellite_ids"),
        ({"satellites": []}, "value_out_of_range", "/satellites"),
        ({"satellites": [satellite(tle=[*tle()[:1], "2"])]}, None, "/satellites/0/tle/1"),
        ({"satellites": [satellite(colour=1)]}, "unknown_field", "/satellites/0/colour"),
        (
            {"satellites": [satellite(), satellite(tle=None, omm={})]},
            "omm_missing_key",
            "/satellites/1/omm/EPOCH",
        ),
        ({"targets": [target(), target()]}, "duplicate_target_id", "/targets/1/id"),
        (
            {"targets": [target(off_nadir_min_deg=9, off_nadir_max_deg=8)]},
            "value_out_of_range",
            "/targets/0/off_nadir_max_deg",
        ),
        (
            {"satellites": [satellite(id="a"), satellite(id="a")]},
            "duplicate_satellite_id",
            "/satellites/1/id",
        ),
        (
            {"ground_stations": [ground_station(elevation_mask=[[9, 1], [8, 1]])]},
            "value_out_of_range",
            "/ground_stations/0/elevation_mask/1",
        ),
        (
            {"horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T00:00:00Z"}},
            "horizon_inverted",
            "/horizon/end",
        ),
    ],
)
def test_what_is_wrong_in_a_file_has_a_pointer(
    change: dict[str, Any], code: str | None, pointer: str
) -> None:
    with pytest.raises(PlannerError) as caught:
        scenario_from_content(file(**change))
    assert caught.value.fault.pointer == pointer
    assert code is None or caught.value.code == code


instants = st.datetimes(
    min_value=datetime(1960, 1, 2),  # noqa: DTZ001 - hypothesis adds the zone
    max_value=datetime(2100, 1, 1),  # noqa: DTZ001
    timezones=st.just(UTC),
)


@given(start=instants, lat=st.floats(-90, 90), reward=st.floats(0, MOST))
def test_a_file_survives_its_canonical_form(start: datetime, lat: float, reward: float) -> None:
    content = file(
        horizon={"start": start.isoformat(), "end": "2101-01-01T00:00:00Z"},
        targets=[target(lat_deg=lat, reward=reward)],
    )
    made = scenario_from_content(json.loads(canonical(content)))
    assert abs((made.horizon.start - start).total_seconds()) <= 0.0005 + 1e-9
    assert (made.targets[0].lat_deg, made.targets[0].reward) == (lat, reward)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(
    where=st.sampled_from(["horizon", "satellites", "targets", "ground_stations", "dynamics"]),
    value=json_values,
)
def test_any_json_is_read_or_refused_never_worse(where: str, value: object) -> None:
    with contextlib.suppress(PlannerError):
        scenario_from_content(file(**{where: value}))


def test_a_preset_takes_fractions_of_its_own_and_one_question_has_one_hash() -> None:
    plain, changed = file(), file()
    plain["satellites"][0]["resources"] = {"preset": "paper"}
    assert canonical(plain) == canonical(changed)
    own: dict[str, Any] = {
        "preset": "paper_code",
        "battery_min_fraction": 0.2,
        "eclipse_aware": True,
    }
    changed["satellites"][0]["resources"] = own
    text = canonical(changed)
    assert canonical(json.loads(text)) == text
    (made,) = scenario_from_content(changed).satellites
    preset = Resources.paper_code(made.orbit.period_s)
    assert made.resources == replace(preset, battery_min_fraction=0.2, eclipse_aware=True)
    own["collect_power_w"] = 3.0
    with pytest.raises(InvalidScenario) as refused:
        canonical(changed)
    fault = refused.value.fault
    assert (fault.code, fault.pointer) == (
        "unknown_field", "/satellites/0/resources/collect_power_w",
    )  # fmt: skip


def test_turns_to_the_sun_are_asked_for_and_questions_without_keep_their_hash() -> None:
    plain, same, slewing = file(), file(), file()
    same["satellites"][0]["resources"] = {
        "preset": "paper", "sun_pointing": "free", "panel_angle_deg": 180.0,
    }  # fmt: skip
    assert canonical(same) == canonical(plain)
    slewing["satellites"][0]["resources"] = {
        "preset": "paper", "sun_pointing": "slew", "panel_angle_deg": 90.0,
    }  # fmt: skip
    text = canonical(slewing)
    assert text != canonical(plain)
    assert canonical(json.loads(text)) == text
    (made,) = scenario_from_content(slewing).satellites
    assert (made.resources.sun_pointing, made.resources.panel_angle_deg) == ("slew", 90.0)
    slewing["dynamics"] = "paper"
    with pytest.raises(InvalidScenario) as refused:
        scenario_from_content(slewing)
    assert refused.value.fault.pointer == "/dynamics"


def test_a_load_at_all_times_is_a_fraction_of_the_battery() -> None:
    own = {
        "battery_capacity_wh": 100.0, "sunpoint_power_w": 36.0, "collect_power_w": 72.0,
        "contact_power_w": 18.0, "recorder_capacity_mbit": 4000.0, "collect_rate_mbit_s": 400.0,
        "downlink_rate_mbit_s": 200.0, "telemetry_rate_mbit_s": 0.004,
    }  # fmt: skip
    without = canonical(file(satellites=[satellite(resources=own)]))
    assert "idle_power_w" not in without
    assert "sun_pointing" not in without
    loaded = file(satellites=[satellite(resources=own | {"idle_power_w": 7.2})])
    assert '"idle_power_w":7.2' in canonical(loaded)
    (made,) = scenario_from_content(loaded).satellites
    assert made.resources.idle_drain_per_s == pytest.approx(2e-5)


def test_turns_in_motion_and_angles_to_the_sun_keep_the_hash_of_questions_without() -> None:
    plain, same, other = file(), file(), file()
    same["satellites"][0]["agility"] = {"slew_model": "rest", "sun_exclusion_deg": None}
    same["satellites"][0]["sensor"] = {"sun_exclusion_deg": None}
    assert canonical(same) == canonical(plain)
    other["satellites"][0]["agility"] = {"slew_model": "moving", "acceleration_deg_s2": 0.5}
    other["satellites"][0]["sensor"] = {"sun_exclusion_deg": 30.0}
    text = canonical(other)
    assert canonical(json.loads(text)) == text
    (made,) = scenario_from_content(other).satellites
    assert made.agility.tracks
    assert made.sensor.sun_exclusion_deg == 30.0
    del other["satellites"][0]["agility"]["acceleration_deg_s2"]
    with pytest.raises(InvalidScenario) as refused:
        scenario_from_content(other)
    assert refused.value.fault.pointer == "/satellites/0/agility/slew_model"


def test_a_downlink_follows_the_elevation_and_questions_without_keep_their_hash() -> None:
    own = {
        "battery_capacity_wh": 100.0, "sunpoint_power_w": 36.0, "collect_power_w": 72.0,
        "contact_power_w": 18.0, "recorder_capacity_mbit": 4000.0, "collect_rate_mbit_s": 400.0,
        "downlink_rate_mbit_s": [[5.0, 100.0], [40.0, 300.0]], "telemetry_rate_mbit_s": 0.004,
    }  # fmt: skip
    varied = file(
        satellites=[satellite(resources=own)],
        ground_stations=[ground_station(setup_s=30.0, downlink_gain=1.5)],
    )
    text = canonical(varied)
    assert canonical(json.loads(text)) == text
    scenario = scenario_from_content(varied)
    resources, (station,) = scenario.satellites[0].resources, scenario.ground_stations
    assert resources.downlink_by_elevation == ((5.0, 0.025), (40.0, 0.075))
    assert (station.setup_s, station.downlink_gain) == (30.0, 1.5)
    plain = file(ground_stations=[ground_station()])
    same = file(ground_stations=[ground_station(setup_s=0.0, downlink_gain=1.0)])
    assert canonical(plain) == canonical(same)
    assert "setup_s" not in canonical(plain)
    own["downlink_rate_mbit_s"] = [[40.0, 100.0], [5.0, 300.0]]
    with pytest.raises(InvalidScenario) as refused:
        scenario_from_content(file(satellites=[satellite(resources=own)]))
    pointer = "/satellites/0/resources/downlink_rate_mbit_s/1"
    assert refused.value.fault.pointer == pointer
