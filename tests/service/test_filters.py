"""Lists that are narrowed by a part of a name."""

from __future__ import annotations

import httpx
import pytest

from tests.service.factories import ground_station, post, satellite, target, tle

NAMES = ("Eye-1", "eye_2", "100% far")
HORIZON = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T02:00:00Z"}


@pytest.mark.parametrize("path", ["satellites", "ground-stations", "target-catalogs", "scenarios"])
def test_lists_are_narrowed_by_a_part_of_a_name(client: httpx.Client, path: str) -> None:
    first = post(client, "/v1/satellites", satellite(name="none", tle=tle(90009)))["id"]
    for number, name in enumerate(NAMES):
        match path:
            case "satellites":
                body = satellite(name=name, tle=tle(90010 + number))
            case "ground-stations":
                body = ground_station(name=name)
            case "target-catalogs":
                body = {"name": name, "targets": [target(id="a")]}
            case _:
                catalog = {"name": name, "targets": [target(id=name)]}
                made = post(client, "/v1/target-catalogs", catalog)["id"]
                body = {
                    "name": name,
                    "horizon": HORIZON,
                    "satellite_ids": [first],
                    "target_catalog_ids": [made],
                }
        post(client, f"/v1/{path}", body)

    def named(text: str) -> list[str]:
        items = client.get(f"/v1/{path}", params={"name": text}).json()["items"]
        return [item["name"] for item in items]

    assert named("EYE") == ["eye_2", "Eye-1"]
    assert named("%") == ["100% far"]
    assert named("_") == ["eye_2"]
    assert named("nothing like it") == []
