"""A huge answer: a page reads only its own chunks, and no form holds the answer as a whole."""

from __future__ import annotations

import gc
import json
import tracemalloc
from dataclasses import dataclass

import httpx
import pytest
import sqlalchemy as sa

from service.answers.chunks import NUM_ITEMS, target_chunks
from service.db.rows import JobChunkRow
from service.exports.forms import FORMS
from tests.missions import Document
from tests.service.answers import chunks_of_timeline
from tests.service.conftest import Service
from tests.service.exports.conftest import Mission, store_job

NUM_TARGETS = 12_000
NUM_LEFT_OUT = 4_000
BLOCK_BYTES = 100_000
"""Approximate size of a chunk of this answer."""
NUM_HELD = 30
"""Blocks in memory at a time, as text and as objects made of them (tracks need most)."""


OTHERS = [
    pytest.param(form.suffix, marks=pytest.mark.full_size)
    for form in FORMS
    if form.suffix != "czml"
]
"""Forms that need less memory at a time than tracks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Large:
    """A stored answer, and sizes in characters."""

    path: str
    question_size: int
    answer_size: int


def large_mission(mission: Mission) -> Mission:
    """Return a scenario and an answer of the same form as a mission's, but much larger."""
    file, timeline = json.loads(mission.content), mission.document
    place = file["targets"][0]
    file["targets"] = [
        place | {"id": f"t{n}", "lon_deg": n * 0.01 - 150.0} for n in range(NUM_TARGETS)
    ]
    collects = [a for a in timeline["satellites"][0]["actions"] if a["mode"] == "collect"]
    left_out = next(one for one in mission.told if one["outcome"] == "unscheduled")
    actions: list[Document] = []
    targets: list[Document] = []
    for number in range(NUM_TARGETS):
        own_id = f"t{number}"
        if number < NUM_LEFT_OUT:
            targets.append(left_out | {"target_id": own_id})
            continue
        action = collects[number % len(collects)] | {"id": f"a{len(actions) + 1}"}
        actions.append(action | {"target_id": own_id})
        told = {"target_id": own_id, "target_catalog_id": None, "outcome": "collected"}
        rest = {"action_id": action["id"], "satellite_id": "sat/1#a", "reason": None}
        targets.append(told | rest)
    timeline["satellites"][0]["actions"] = actions
    timeline["satellites"][1]["actions"] = []
    chunks = (*chunks_of_timeline(timeline), *target_chunks(targets))
    content = json.dumps(file, sort_keys=True, separators=(",", ":"))
    return Mission(content=content, chunks=chunks)


@pytest.fixture
def large(service: Service, mission: Mission) -> Large:
    found = large_mission(mission)
    size = sum(len(chunk.text) for chunk in found.chunks)
    path = store_job(service, found)
    return Large(path=path, question_size=len(found.content), answer_size=size)


def spoil_targets(service: Service, *firsts: int) -> None:
    """Make all chunks of targets unreadable except those that begin with these numbers."""
    row = JobChunkRow
    with service.database.transaction() as session:
        others = sa.and_(row.kind == "targets", row.first.not_in(firsts))
        session.execute(sa.update(row).where(others).values(text="no JSON"))
        timeline = sa.update(row).where(row.kind != "targets")
        session.execute(timeline.values(text="no JSON"))


def cursor_to(client: httpx.Client, path: str, after: int, limit: int) -> str:
    """Return the cursor of the page that begins after this number of targets."""
    cursor = None
    for _ in range(after // limit):
        query = {"limit": limit} | ({"cursor": cursor} if cursor else {})
        cursor = client.get(path, params=query).json()["next"]
    return str(cursor)


def test_a_page_reads_its_own_blocks_and_no_others(
    service: Service, client: httpx.Client, large: Large
) -> None:
    path, limit = f"{large.path}/targets", 500
    cursor = cursor_to(client, path, 2 * limit, limit)
    spoil_targets(service, 1000, 1200, 1400)
    assert {1000 % NUM_ITEMS, 1400 % NUM_ITEMS} == {0}
    page = client.get(path, params={"limit": limit, "cursor": cursor})
    assert [one["target_id"] for one in page.json()["items"]] == [
        f"t{n}" for n in range(1000, 1500)
    ]


def test_a_filtered_page_passes_over_blocks_without_what_is_wanted(
    service: Service, client: httpx.Client, large: Large
) -> None:
    spoil_targets(service, NUM_LEFT_OUT)
    query: dict[str, str | int] = {"outcome": "collected", "limit": 100}
    page = client.get(f"{large.path}/targets", params=query).json()
    first = NUM_LEFT_OUT
    assert [one["target_id"] for one in page["items"]] == [f"t{first + n}" for n in range(100)]
    nothing = client.get(f"{large.path}/targets", params={"reason": "no_such_reason"}).json()
    assert nothing == {"items": [], "next": None}


@pytest.mark.parametrize("suffix", ["json", "czml", *OTHERS])
def test_no_form_holds_the_answer_as_a_whole(
    client: httpx.Client, large: Large, suffix: str
) -> None:
    assert large.answer_size > 2 * NUM_HELD * BLOCK_BYTES
    # Forms that show targets' positions hold the scenario as text; all else is held by the chunk.
    question = 0 if suffix == "json" else large.question_size
    # Not the client that checks answers against their schema: it reads them whole.
    address = client.base_url.join(f"{large.path}/timeline.{suffix}")
    # Whatever is created once, at the first request, does not count.
    with httpx.stream("GET", address, timeout=60) as first:
        for _ in first.iter_bytes():
            pass
    gc.collect()
    tracemalloc.start()
    try:
        with httpx.stream("GET", address, timeout=60) as answer:
            assert answer.status_code == 200
            length = sum(len(piece) for piece in answer.iter_bytes())
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert length > (100 if suffix == "ics" else 10 * BLOCK_BYTES)
    assert peak < question + NUM_HELD * BLOCK_BYTES
