"""Idempotency keys, comparisons, jobs run again, and the figures of answers."""

from __future__ import annotations

import json
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

_RESULT = sa.table(
    "job_result", *map(sa.column, ("job_id", "timeline")), sa.column("figures", sa.JSON())
)
_OF_TOTALS = (
    "reward", "bound", "gap", "bound_proof", "collects", "contacts", "downlinked_mbit",
    "downlinked_fraction",
)  # fmt: skip


def upgrade() -> None:
    op.create_table(
        "idempotency_key",
        sa.Column("tenant", sa.String(length=64), nullable=False),
        sa.Column("key", sa.String(length=255), nullable=False),
        sa.Column("request_sha256", sa.String(length=64), nullable=False),
        sa.Column("answer", sa.JSON(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("tenant", "key"),
    )
    op.create_index(op.f("ix_idempotency_key_created_at"), "idempotency_key", ["created_at"])
    op.create_table(
        "comparison",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("scenario_id", sa.String(length=36), nullable=False),
        sa.Column("tenant", sa.String(length=64), nullable=False),
        sa.Column("label", sa.Text(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["scenario_id"], ["scenario.id"]),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_table(
        "comparison_run",
        sa.Column("comparison_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.ForeignKeyConstraint(["comparison_id"], ["comparison.id"]),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"]),
        sa.PrimaryKeyConstraint("comparison_id", "position"),
    )
    # No foreign key: SQLite would have to copy the table, and jobs are never deleted.
    op.add_column("job", sa.Column("rerun_of", sa.String(length=36), nullable=True))
    op.add_column("job_result", sa.Column("figures", sa.JSON(), nullable=True))
    _fill_figures(op.get_bind())


def _fill_figures(connection: sa.Connection) -> None:
    """Repeat the numbers of each answer: of earlier versions, and of this one gone back from."""
    of_job = _RESULT.c.job_id
    for job_id in connection.scalars(sa.select(of_job)).all():
        text = connection.scalar(sa.select(_RESULT.c.timeline).where(of_job == job_id))
        change = sa.update(_RESULT).where(of_job == job_id)
        connection.execute(change.values(figures=_figures(json.loads(text))))


def _figures(timeline: dict[str, Any]) -> dict[str, Any]:
    runtime_s, totals = timeline.get("runtime_s", {}), timeline.get("totals", {})
    return {name: totals.get(name) for name in _OF_TOTALS} | {
        "solve_s": runtime_s.get("solve"),
        "runtime_s": round(sum(runtime_s.values()), 6),
        "validity": timeline.get("validity"),
        "plan_sha256": timeline.get("plan_sha256"),
    }


def downgrade() -> None:
    op.drop_column("job_result", "figures")
    op.drop_column("job", "rerun_of")
    op.drop_table("comparison_run")
    op.drop_table("comparison")
    op.drop_index(op.f("ix_idempotency_key_created_at"), table_name="idempotency_key")
    op.drop_table("idempotency_key")
