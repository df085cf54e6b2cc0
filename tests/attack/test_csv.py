"""Names that spreadsheets would execute: escaped in every table, and read back unchanged."""

from __future__ import annotations

import csv

import httpx
import pytest

from tests.missions import PAPER_ORBIT
from tests.service.factories import post, send

FORMULAS = (
    '=HYPERLINK("http://x.example")', "+1+1", "-1+1", "@SUM(A1)", "'=1", "\uff1d1+1",
    "\uff20SUM(A1)",
)  # fmt: skip


@pytest.mark.parametrize("name", FORMULAS)
def test_a_formula_in_an_orbit_is_guarded(client: httpx.Client, name: str) -> None:
    made = post(
        client, "/v1/satellites", {"name": name, "omm": PAPER_ORBIT | {"OBJECT_NAME": name}}
    )
    table = client.get(f"/v1/satellites/{made['id']}/omm.csv").text
    assert next(csv.DictReader(table.splitlines()))["OBJECT_NAME"] == f"'{name}"
    answer = send(client, "/v1/satellites/import", table, "text/csv")
    assert [item["status"] for item in answer.json()["items"]] == ["unchanged"]
    elsewhere = table.replace(",1,", ",2,")
    answer = send(client, "/v1/satellites/import", elsewhere, "text/csv")
    assert answer.json()["items"][0]["name"] == name
