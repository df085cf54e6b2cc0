"""Satellites and ground stations are changed in place, and later imports recognise them."""

from __future__ import annotations

import httpx

from service.wire.sites import GroundStationIn, GroundStationPatch
from tests.service.conftest import Service
from tests.service.factories import ground_station, post, satellite, send, target
from tests.service.problems import assert_problem

STATIONS = "name,lat_deg,lon_deg,antennas\n"


def imported(client: httpx.Client, *lines: str) -> list[tuple[str, str]]:
    """Import stations; return the id and status of each."""
    text = STATIONS + "".join(f"{line}\n" for line in lines)
    answer = send(client, "/v1/ground-stations/import", text, "text/csv")
    assert answer.status_code == 200, answer.text
    return [(one["id"], one["status"]) for one in answer.json()["items"]]


def test_only_the_settings_given_change(service: Service) -> None:
    body = satellite(agility={"slew_rate_deg_s": 2.0, "settle_s": 5.0})
    before = post(service.client, "/v1/satellites", body)
    where = f"/v1/satellites/{before['id']}"
    changes = {"name": "EYE-2", "agility": {"slew_rate_deg_s": 3.0}}
    answer = service.client.patch(where, json=changes)
    assert answer.status_code == 200, answer.text
    agility = before["agility"] | {"slew_rate_deg_s": 3.0}
    assert answer.json() == before | {"name": "EYE-2", "agility": agility}
    again = service.client.get(where)
    assert again.json() == answer.json()
    assert again.headers["etag"] == answer.headers["etag"]


def test_a_null_setting_is_set_and_a_null_part_stays(service: Service) -> None:
    body = satellite(agility={"acceleration_deg_s2": 0.5})
    before = post(service.client, "/v1/satellites", body)
    changes = {"agility": {"acceleration_deg_s2": None}, "sensor": None, "name": None}
    after = service.client.patch(f"/v1/satellites/{before['id']}", json=changes).json()
    assert after["agility"]["acceleration_deg_s2"] is None
    assert (after["sensor"], after["name"]) == (before["sensor"], before["name"])


def test_what_somebody_changed_meanwhile_is_not_overwritten(service: Service) -> None:
    for path, body in (
        ("/v1/satellites", satellite()),
        ("/v1/ground-stations", ground_station()),
    ):
        where = f"{path}/{post(service.client, path, body)['id']}"
        seen = {"If-Match": service.client.get(where).headers["etag"]}
        first = service.client.patch(where, json={"name": "mine"}, headers=seen)
        assert first.status_code == 200, first.text
        late = service.client.patch(where, json={"name": "yours"}, headers=seen)
        assert_problem(late, 412, "precondition_failed")
        assert service.client.get(where).json()["name"] == "mine"


def test_wrong_figures_change_nothing(service: Service) -> None:
    where = "/v1/satellites/" + post(service.client, "/v1/satellites", satellite())["id"]
    before = service.client.get(where).json()
    refused = service.client.patch(where, json={"sensor": {"off_nadir_min_deg": 89.0}})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"].startswith("/sensor")
    assert service.client.get(where).json() == before


def test_a_station_can_change_in_all_that_it_is_made_of(service: Service) -> None:
    assert GroundStationPatch.model_fields.keys() == GroundStationIn.model_fields.keys()
    before = post(service.client, "/v1/ground-stations", ground_station(antennas=2))
    where = f"/v1/ground-stations/{before['id']}"
    changes = {"min_elevation_deg": 12.5, "elevation_mask": [[0.0, 5.0], [180.0, 20.0]]}
    answer = service.client.patch(where, json=changes)
    assert answer.status_code == 200, answer.text
    assert answer.json() == before | changes == service.client.get(where).json()


def test_a_station_that_is_imported_again_is_updated(service: Service) -> None:
    client = service.client
    ((north, _),) = imported(client, "North,78.2,15.4,1")
    assert imported(client, "North,78.2,15.4,1") == [(north, "unchanged")]
    assert imported(client, "North,78.2,15.4,3") == [(north, "updated")]
    assert client.get(f"/v1/ground-stations/{north}").json()["antennas"] == 3
    assert len(client.get("/v1/ground-stations").json()["items"]) == 1


def test_two_stations_of_one_name_stay_two(service: Service) -> None:
    client = service.client
    first = imported(client, "Twin,10,20,1", "Twin,30,40,1")
    assert [status for _, status in first] == ["created", "created"]
    again = imported(client, "Twin,10,20,1", "Twin,30,40,2")
    assert [status for _, status in again] == ["unchanged", "created"]


def test_a_change_of_nothing_is_refused(service: Service) -> None:
    where = "/v1/satellites/" + post(service.client, "/v1/satellites", satellite())["id"]
    assert_problem(service.client.patch(where, json={}), 422, "invalid_value")


def test_priorities_and_the_name_of_a_catalogue_change(service: Service) -> None:
    client = service.client
    sent = {"name": "Points", "targets": [target(id="a"), target(id="b/~c"), target(id="d")]}
    where = f"/v1/target-catalogs/{post(client, '/v1/target-catalogs', sent)['id']}"
    before = client.get(where)
    changes = {"name": "Places", "rewards": {"b/~c": 7.5, "a": 0}}
    seen = {"If-Match": before.headers["etag"]}
    answer = client.patch(where, json=changes, headers=seen)
    assert answer.status_code == 200, answer.text
    assert answer.json()["name"] == "Places"
    targets = client.get(f"{where}/targets").json()["items"]
    assert {one["id"]: one["reward"] for one in targets} == {"a": 0.0, "b/~c": 7.5, "d": 1.0}
    # A client that read it before the change is refused.
    late = client.patch(where, json={"rewards": {"d": 2}}, headers=seen)
    assert_problem(late, 412, "precondition_failed")
    assert client.get(where).headers["etag"] == answer.headers["etag"]


def test_a_priority_of_no_target_changes_none(service: Service) -> None:
    client = service.client
    sent = {"name": "Points", "targets": [target(id="a")]}
    where = f"/v1/target-catalogs/{post(client, '/v1/target-catalogs', sent)['id']}"
    refused = client.patch(where, json={"name": "New", "rewards": {"a": 5, "b/": 5}})
    assert_problem(refused, 422, "unknown_target", "/rewards/b~1")
    assert client.get(where).json()["name"] == "Points"
    (same,) = client.get(f"{where}/targets").json()["items"]
    assert same["reward"] == 1.0
    assert_problem(client.patch(where, json={}), 422, "invalid_value")
    negative = client.patch(where, json={"rewards": {"a": -1}})
    assert_problem(negative, 422, "value_out_of_range", "/rewards/a")
