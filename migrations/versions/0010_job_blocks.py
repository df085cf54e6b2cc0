"""Answers in blocks, so that pages and exports read only what they need."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

Block = tuple[str, int, int, dict[str, int] | None, str]

_NUM_ITEMS = 200
_NUM_CHARS = 1 << 16
_RESULT = sa.table(
    "job_result", *map(sa.column, ("job_id", "timeline", "targets", "proof", "created_at"))
)
_BLOCK = sa.table(
    "job_block",
    *map(sa.column, ("job_id", "position", "kind", "first", "num_items", "size")),
    sa.column("tally", sa.JSON(none_as_null=True)),
    sa.column("text"),
)


def upgrade() -> None:
    op.create_table(
        "job_block",
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("kind", sa.String(length=16), nullable=False),
        sa.Column("first", sa.Integer(), nullable=False),
        sa.Column("num_items", sa.Integer(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("tally", sa.JSON(), nullable=True),
        sa.Column("text", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["job_result.job_id"]),
        sa.PrimaryKeyConstraint("job_id", "position"),
    )
    connection = op.get_bind()
    # One answer at a time, since all of them may not fit into memory.
    for job_id in connection.scalars(sa.select(_RESULT.c.job_id)).all():
        columns = (_RESULT.c.timeline, _RESULT.c.targets, _RESULT.c.proof)
        stored = connection.execute(sa.select(*columns).where(_RESULT.c.job_id == job_id)).one()
        rows = [
            {
                "job_id": job_id,
                "position": position,
                "kind": kind,
                "first": first,
                "num_items": num_items,
                "size": len(text),
                "tally": tally,
                "text": text,
            }
            for position, (kind, first, num_items, tally, text) in enumerate(_blocks(*stored))
        ]
        connection.execute(sa.insert(_BLOCK), rows)
    for name in ("timeline", "targets", "proof"):
        op.drop_column("job_result", name)


def downgrade() -> None:
    for name in ("timeline", "targets"):
        column = sa.Column(name, sa.Text(), nullable=False, server_default="")
        op.add_column("job_result", column)
    op.add_column("job_result", sa.Column("proof", sa.Text(), nullable=True))
    connection = op.get_bind()
    for job_id in connection.scalars(sa.select(_RESULT.c.job_id)).all():
        columns = (_BLOCK.c.kind, _BLOCK.c.text)
        wanted = sa.select(*columns).where(_BLOCK.c.job_id == job_id).order_by(_BLOCK.c.position)
        texts = {"targets": "", "proof": "", "timeline": ""}
        for kind, text in connection.execute(wanted):
            texts[kind if kind in texts else "timeline"] += text
        connection.execute(
            sa.update(_RESULT)
            .where(_RESULT.c.job_id == job_id)
            .values(
                timeline=texts["timeline"],
                targets=f"[{texts['targets']}]",
                proof=texts["proof"] or None,
            )
        )
    op.drop_table("job_block")


def _blocks(timeline: str, targets: str, proof: str | None) -> Iterator[Block]:
    """Yield the blocks of an answer as ``service.answers.blocks`` made them at the time."""
    head = json.loads(timeline)
    satellites = head.pop("satellites")
    yield "head", 0, 0, None, json.dumps(head)[:-1] + ', "satellites": ['
    first = 0
    for number, satellite in enumerate(satellites):
        about = json.dumps({name: satellite.pop(name) for name in ("id", "name")})
        comma = ", " if number else ""
        yield "satellite", number, 0, None, f'{comma}{about[:-1]}, "actions": ['
        actions = satellite.pop("actions")
        for num_items, text in _grouped(actions):
            yield "actions", first, num_items, None, text
            first += num_items
        rest = f"], {json.dumps(satellite)[1:]}" if satellite else "]}"
        for text in _cut(rest):
            yield "rest", number, 0, None, text
    yield "tail", 0, 0, None, "]}"
    told: list[Any] = json.loads(targets)
    first = 0
    for num_items, text in _grouped(told):
        tally = Counter(
            f"{one['outcome']}/{(one['reason'] or {}).get('code', '')}"
            for one in told[first : first + num_items]
        )
        yield "targets", first, num_items, tally, text
        first += num_items
    for text in _cut(proof or ""):
        yield "proof", 0, 0, None, text


def _grouped(items: list[Any]) -> Iterator[tuple[int, str]]:
    for at in range(0, len(items), _NUM_ITEMS):
        some = items[at : at + _NUM_ITEMS]
        yield len(some), (", " if at else "") + ", ".join(map(json.dumps, some))


def _cut(text: str) -> Iterator[str]:
    return (text[at : at + _NUM_CHARS] for at in range(0, len(text), _NUM_CHARS))
