"""Forecasts over HTTP: stored for their owner, frozen with scenarios, reported in answers."""

from __future__ import annotations

import csv
import io
import json
from datetime import timedelta
from typing import Any

import httpx
import numpy as np
import pytest

from planner_core.errors import InvalidScenario
from service.db.rows import ForecastRow
from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.frozen_forecasts import find_forecast
from service.scenarios.translate import scenario_from_content
from service.stores.finding import find_own
from tests.missions import drawn_targets, paper_mission
from tests.service.conftest import Service
from tests.service.factories import EPOCH, post, send
from tests.service.problems import assert_problem
from tests.service.test_plan_job import run
from tests.service.test_scenarios import question

PATH = "/v1/forecasts"
LATITUDES = range(-90, 91, 10)
LONGITUDES = range(0, 360, 15)


def clear(hour: int, lat_deg: float, lon_deg: float) -> float:
    """Return an arbitrary clear-sky probability."""
    wave = np.sin(np.radians(lon_deg + 12.0 * hour)) * np.cos(np.radians(2.0 * lat_deg))
    return round(float(0.5 + 0.5 * wave), 4)


def grid(hours: range = range(0, 9, 3)) -> str:
    rows = ["time,lat_deg,lon_deg,clear_probability"]
    rows += [
        f"{(EPOCH + timedelta(hours=hour)).isoformat()},{lat},{lon},{clear(hour, lat, lon)}"
        for hour in hours
        for lat in LATITUDES
        for lon in LONGITUDES
    ]
    return "\n".join(rows)


def upload(client: httpx.Client, text: str, **params: str) -> dict[str, Any]:
    query = httpx.QueryParams(params)
    response = send(client, f"{PATH}?{query}", text, "text/csv")
    assert response.status_code == 201, response.text
    body: dict[str, Any] = response.json()
    return body


def test_a_forecast_is_told_without_its_values(client: httpx.Client) -> None:
    made = upload(client, grid(), name="Tonight", default_clear_probability="0.4")
    assert made["name"] == "Tonight"
    assert (made["kind"], made["num_times"], made["num_values"]) == ("grid", 3, 3 * 19 * 24)
    assert (made["lat_deg"], made["lon_deg"]) == ([-90.0, 90.0], [0.0, 345.0])
    assert (made["first"], made["last"]) == ("2026-03-01T00:00:00.000Z", "2026-03-01T06:00:00.000Z")
    assert made["default_clear_probability"] == 0.4
    assert made["num_targets"] is None
    assert client.get(f"{PATH}/{made['id']}").json() == made
    assert client.get(PATH).json()["items"] == [made]
    assert client.delete(f"{PATH}/{made['id']}").status_code == 204
    assert_problem(client.get(f"{PATH}/{made['id']}"), 404, "not_found")
    assert client.get(PATH).json()["items"] == []


def test_the_same_forecast_has_the_same_hash_in_any_form(client: httpx.Client) -> None:
    header, *rows = grid().splitlines()
    turned = "\n".join([header, *reversed(rows)])
    assert upload(client, grid())["sha256"] == upload(client, turned, name="b")["sha256"]
    other = upload(client, grid(range(0, 12, 3)))
    assert other["sha256"] != upload(client, grid())["sha256"]


def test_what_cannot_be_read_is_refused_whole(client: httpx.Client) -> None:
    bad = send(client, PATH, grid() + "\nnever,0,0,0.5", "text/csv")
    line = assert_problem(bad, 422, "invalid_value")["errors"][0]["row"]
    assert line == len(grid().splitlines()) + 1
    assert_problem(send(client, PATH, b"CDF\x01", "application/netcdf"), 422, "malformed_netcdf")
    assert_problem(send(client, PATH, "{}", "application/json"), 415, "unsupported_media_type")
    worse = send(client, f"{PATH}?default_clear_probability=2", grid(), "text/csv")
    assert worse.status_code == 422
    assert client.get(PATH).json()["items"] == []


def test_a_question_takes_along_what_a_forecast_says_of_its_targets(client: httpx.Client) -> None:
    made = upload(client, grid())
    body = question(client, forecast_id=made["id"])
    stored = post(client, "/v1/scenarios", body)
    assert (stored["forecast_id"], stored["has_forecast"]) == (made["id"], True)
    path = f"/v1/scenarios/{stored['id']}?expand=true"
    file = client.get(path).json()
    (series,) = file["forecast"]["series"]
    assert len(series["times"]) == 3
    targets = {target["id"]: target for target in file["targets"]}
    assert series["clear_probability"].keys() == targets.keys()
    for target_id, values in series["clear_probability"].items():
        lat, lon = targets[target_id]["lat_deg"], targets[target_id]["lon_deg"]
        assert values == pytest.approx([clear(h, lat, lon) for h in (0, 3, 6)], abs=1e-3)
    # The scenario has its own copy: changing the forecast changes nothing in it.
    client.delete(f"{PATH}/{made['id']}")
    assert client.get(path).json() == file
    assert sha256_of(canonical(file)) == stored["sha256"]
    plain = post(client, "/v1/scenarios", body | {"forecast_id": None})
    assert plain["sha256"] != stored["sha256"]
    assert (plain["forecast_id"], plain["has_forecast"]) == (None, False)


def test_forecasts_that_say_the_same_of_a_question_make_the_same_question(
    client: httpx.Client,
) -> None:
    body = question(client)
    short, long = upload(client, grid()), upload(client, grid(range(0, 24, 3)))
    ids = {
        post(client, "/v1/scenarios", body | {"forecast_id": one["id"]})["id"]
        for one in (short, long)
    }
    assert short["sha256"] != long["sha256"]
    assert len(ids) == 1


def test_a_forecast_that_does_not_cover_the_question_is_refused(client: httpx.Client) -> None:
    body = question(client)
    short = grid(range(0, 6, 3))
    made = upload(client, short)
    refused = client.post("/v1/scenarios", json=body | {"forecast_id": made["id"]})
    error = assert_problem(refused, 422, "forecast_does_not_cover", pointer="/forecast_id")
    assert "'-80/-180'" in error["detail"]
    assert "2026-03-01T03:00:00Z" in error["detail"]
    with_default = upload(client, short, default_clear_probability="0.3")
    assert post(client, "/v1/scenarios", body | {"forecast_id": with_default["id"]})["id"]
    unknown = client.post("/v1/scenarios", json=body | {"forecast_id": "x"})
    assert_problem(unknown, 422, "unknown_forecast", pointer="/forecast_id")


def test_a_forecast_is_its_owners_alone(service: Service) -> None:
    made = upload(service.client, grid())
    with service.database.reading() as session:
        assert find_own(session, ForecastRow, made["id"], "somebody else") is None
        assert find_own(session, ForecastRow, made["id"], None) is not None
        with pytest.raises(InvalidScenario, match="There is no forecast"):
            find_forecast(session, made["id"], "somebody else")


def mission(**fields: Any) -> dict[str, Any]:
    targets = [target | {"reward": 1.0 + i % 3} for i, target in enumerate(drawn_targets(150))]
    return paper_mission(targets, **fields)


def skies(file: dict[str, Any]) -> dict[str, Any]:
    draw = np.random.default_rng(7)
    return {
        "default_clear_probability": 0.25,
        "series": [
            {
                "times": [file["horizon"]["start"], file["horizon"]["end"]],
                "clear_probability": {
                    target["id"]: draw.random(2).round(4).tolist()
                    for target in file["targets"][:100]
                },
            }
        ],
    }


def test_every_collect_tells_how_clear_its_sky_is() -> None:
    file = mission()
    forecast = skies(file)
    answer = run(mission(forecast=forecast), "rule")
    timeline = json.loads(answer.timeline)
    own = forecast["series"][0]["clear_probability"]
    horizon = scenario_from_content(file).horizon
    reward = {target["id"]: target["reward"] for target in file["targets"]}
    found = []
    for action in timeline["satellites"][0]["actions"]:
        if action["mode"] != "collect":
            assert action["clear_probability"] is None
            continue
        first, last = own.get(action["target_id"], (0.25, 0.25))
        instants = [np.datetime64(action[name].rstrip("Z")) for name in ("start", "end")]
        start = np.datetime64(horizon.start.replace(tzinfo=None))
        middle_s = np.mean([(t - start) / np.timedelta64(1, "s") for t in instants])
        sky = first + (last - first) * middle_s / horizon.duration_s
        assert action["clear_probability"] == pytest.approx(sky, abs=1e-6)
        assert action["worth"] == pytest.approx(reward[action["target_id"]] * sky, rel=1e-5)
        if action["reward"]:
            found.append(action)
    totals = timeline["totals"]
    assert totals["images"] == len(found)
    expected = sum(action["clear_probability"] for action in found)
    assert totals["expected_clear"] == pytest.approx(expected, abs=1e-6)
    assert totals["expected_clear"] < 0.9 * totals["images"]
    angles = [action["off_nadir_deg"] for action in found]
    assert totals["off_nadir_deg"]["mean"] == pytest.approx(np.mean(angles), abs=1e-3)
    assert totals["off_nadir_deg"]["median"] == pytest.approx(np.median(angles), abs=1e-3)
    assert 0 < totals["night_images"] < totals["images"]
    of_satellite = timeline["satellites"][0]["totals"]
    assert of_satellite == {name: totals[name] for name in of_satellite}


def test_falling_rewards_are_another_question() -> None:
    targets = drawn_targets(150)
    urgent = [target | {"reward_half_life_s": 3600.0} for target in targets]
    text = canonical(paper_mission(urgent))
    assert sha256_of(text) != sha256_of(canonical(paper_mission(targets)))
    assert canonical(json.loads(text)) == text
    unset = [target | {"reward_half_life_s": None} for target in targets]
    assert canonical(paper_mission(unset)) == canonical(paper_mission(targets))


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"clear_probability": {"nobody": [0.5, 0.5]}}, "unknown_target", "clear_probability"),
        ({"clear_probability": {"first": [0.5]}}, "value_out_of_range", "clear_probability"),
        ({"times": ["2026-03-01T00:00:00Z"] * 2}, "value_out_of_range", "times"),
    ],
)
def test_skies_of_a_file_that_cannot_be_are_named(
    client: httpx.Client, change: dict[str, Any], code: str, pointer: str
) -> None:
    file = mission()
    forecast = skies(file)
    if "first" in change.get("clear_probability", {}):
        change = {"clear_probability": {file["targets"][0]["id"]: [0.5]}}
    forecast["series"][0] |= change
    body = {"scenario": mission(forecast=forecast), "solver": "rule"}
    response = client.post("/v1/jobs", json=body)
    assert_problem(response, 422, code, pointer=f"/scenario/forecast/series/0/{pointer}")


def test_a_catalogue_may_tell_how_reward_falls(client: httpx.Client) -> None:
    rows = "id,lat_deg,lon_deg,reward_half_life_s\nbern,46.9,7.4,3600\nrome,41.9,12.5,\n"
    made = send(client, "/v1/target-catalogs?name=T", rows, "text/csv").json()
    targets = client.get(made["links"]["targets"]).json()["items"]
    assert [target["reward_half_life_s"] for target in targets] == [3600.0, None]
    columns = next(csv.reader(io.StringIO(rows)))
    assert not made["ignored_columns"], columns
