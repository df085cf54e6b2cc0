"""Documents in chunks: the same documents, in pieces of bounded size."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

import pytest

from service.answers.chunks import (
    NUM_CHARS,
    NUM_ITEMS,
    Chunk,
    contents_of,
    head_in,
    holds,
    items_in,
    proof_chunks,
    satellite_in,
    target_chunks,
    targets_text,
    timeline_text,
)
from tests.service.answers import chunks_of_timeline

Document = dict[str, Any]


def action(number: int) -> Document:
    return {"id": f"a{number + 1}", "mode": "collect", "target_id": f"t{number}", "reward": 0.1}


def timeline_of(*num_actions: int) -> Document:
    """Return a timeline of satellites with these numbers of actions."""
    numbers = iter(range(sum(num_actions)))
    satellites = [
        {
            "id": f"s{i}",
            "name": f'"EYE", {i}',
            "actions": [action(next(numbers)) for _ in range(count)],
            "eclipses": [],
            "resources": {"time": ["2026-01-01T00:00:00.000Z"] * 5000} if i == 0 else None,
        }
        for i, count in enumerate(num_actions)
    ]
    return {"schema_version": "1.0", "totals": {"reward": 1.5}, "satellites": satellites}


def target(number: int) -> Document:
    is_out = number % 3 == 0
    reason = {"code": "battery" if number % 2 else "recorder", "detail": "é"} if is_out else None
    outcome = "unscheduled" if is_out else "collected"
    return {"target_id": f"t{number}", "outcome": outcome, "reason": reason}


@pytest.mark.parametrize(
    "num_actions", [(), (0,), (1,), (NUM_ITEMS,), (3, 0, 2 * NUM_ITEMS + 1, 5)], ids=str
)
def test_a_timeline_in_blocks_is_the_same_document(num_actions: tuple[int, ...]) -> None:
    timeline = timeline_of(*num_actions)
    chunks = list(chunks_of_timeline(timeline))
    assert timeline_text(chunks) == json.dumps(timeline)
    assert max(chunk.num_items for chunk in chunks) <= NUM_ITEMS
    assert max(len(chunk.text) for chunk in chunks if not chunk.num_items) <= NUM_CHARS


def test_each_block_of_a_timeline_can_be_read_alone() -> None:
    timeline = timeline_of(3, 0, 2 * NUM_ITEMS + 1)
    chunks = list(chunks_of_timeline(timeline))
    by_kind: dict[str, list[Chunk]] = {}
    for chunk in chunks:
        by_kind.setdefault(chunk.kind, []).append(chunk)
    (head,) = by_kind["head"]
    assert head_in(head.text) == {k: v for k, v in timeline.items() if k != "satellites"}
    told = [satellite_in(chunk.text) for chunk in by_kind["satellite"]]
    assert told == [{"id": s["id"], "name": s["name"]} for s in timeline["satellites"]]
    for chunk in by_kind["actions"]:
        numbers = range(chunk.first, chunk.first + chunk.num_items)
        assert items_in(chunk.text) == [action(number) for number in numbers]


def test_targets_in_blocks_are_the_same_list_and_say_what_they_hold() -> None:
    targets = [target(number) for number in range(2 * NUM_ITEMS + 7)]
    chunks = list(target_chunks(targets))
    assert targets_text(chunks) == json.dumps(targets)
    assert [chunk.num_items for chunk in chunks] == [NUM_ITEMS, NUM_ITEMS, 7]
    for chunk in chunks:
        own = targets[chunk.first : chunk.first + chunk.num_items]
        assert items_in(chunk.text) == own
        assert chunk.tally == Counter(
            f"{one['outcome']}/{one['reason']['code'] if one['reason'] else ''}" for one in own
        )
        assert holds(chunk.tally, "unscheduled", "battery")
        assert not holds(chunk.tally, "collected", "battery")
        assert not holds(chunk.tally, "excluded", None)
    assert targets_text(target_chunks([])) == "[]"


def test_a_proof_in_blocks_is_the_same_text() -> None:
    proof = json.dumps({"prices": [0.1] * NUM_CHARS})
    chunks = list(proof_chunks(proof))
    assert "".join(chunk.text for chunk in chunks) == proof
    assert len(chunks) > 1
    assert [entry.position for entry in contents_of(chunks)] == list(range(len(chunks)))
