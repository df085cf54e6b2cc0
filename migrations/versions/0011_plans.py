"""Plans in operations: approved, published, superseded, reported on."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_INSTANT = sa.DateTime(timezone=True)


def _plan_id(*, is_key: bool = False) -> sa.Column[str]:
    return sa.Column(
        "plan_id",
        sa.String(length=36),
        sa.ForeignKey("plan.id"),
        nullable=False,
        primary_key=is_key,
    )


def _by() -> list[sa.Column[str]]:
    return [
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("key_name", sa.String(length=64), nullable=True),
    ]


def upgrade() -> None:
    op.create_table(
        "plan",
        sa.Column("id", sa.String(length=36), primary_key=True),
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("name", sa.Text(), nullable=True),
        sa.Column("job_id", sa.String(length=36), sa.ForeignKey("job.id"), nullable=False),
        sa.Column("parent_id", sa.String(length=36), sa.ForeignKey("plan.id"), nullable=True),
        sa.Column("state", sa.String(length=16), nullable=False),
        sa.Column("plan_sha256", sa.String(length=64), nullable=False),
        sa.Column("horizon_start", _INSTANT, nullable=False),
        sa.Column("horizon_end", _INSTANT, nullable=False),
        sa.Column("validity", sa.String(length=16), nullable=False),
        sa.Column("violations", sa.JSON(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", _INSTANT, nullable=False),
    )
    op.create_index("ix_plan_job_id", "plan", ["job_id"])
    op.create_index("ix_plan_parent_id", "plan", ["parent_id"])
    op.create_index("ix_plan_owner_state_id", "plan", ["owner", "state", "id"])
    op.create_table(
        "plan_satellite",
        _plan_id(is_key=True),
        sa.Column("satellite_id", sa.Text(), primary_key=True),
        sa.Column("satellite_name", sa.Text(), nullable=False),
        sa.Column("in_force_from", _INSTANT, nullable=True),
        sa.Column("in_force_until", _INSTANT, nullable=True),
    )
    op.create_index("ix_plan_satellite_satellite_id", "plan_satellite", ["satellite_id"])
    op.create_table(
        "plan_action",
        _plan_id(is_key=True),
        sa.Column("position", sa.Integer(), primary_key=True, autoincrement=False),
        sa.Column("action_id", sa.Text(), nullable=False),
        sa.Column("satellite_id", sa.Text(), nullable=False),
        sa.Column("mode", sa.String(length=16), nullable=False),
        sa.Column("start", _INSTANT, nullable=False),
        sa.Column("end", _INSTANT, nullable=False),
        sa.Column("target_id", sa.Text(), nullable=True),
        sa.Column("station_id", sa.Text(), nullable=True),
    )
    op.create_table(
        "plan_event",
        sa.Column("id", sa.String(length=36), primary_key=True),
        _plan_id(),
        sa.Column("at", _INSTANT, nullable=False),
        sa.Column("from_state", sa.String(length=16), nullable=True),
        sa.Column("to_state", sa.String(length=16), nullable=False),
        *_by(),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("effective_from", _INSTANT, nullable=True),
        sa.Column("waivers", sa.JSON(), nullable=False),
    )
    op.create_index("ix_plan_event_plan_id", "plan_event", ["plan_id"])
    op.create_table("publisher", sa.Column("owner", sa.String(length=64), primary_key=True))
    op.create_table(
        "plan_execution",
        sa.Column("id", sa.String(length=36), primary_key=True),
        _plan_id(),
        sa.Column("action_id", sa.Text(), nullable=False),
        sa.Column("outcome", sa.String(length=16), nullable=False),
        sa.Column("at", _INSTANT, nullable=True),
        sa.Column("mbit", sa.Double(), nullable=True),
        sa.Column("detail", sa.Text(), nullable=True),
        *_by(),
        sa.Column("reported_at", _INSTANT, nullable=False),
    )
    op.create_index("ix_plan_execution_plan_id", "plan_execution", ["plan_id"])


def downgrade() -> None:
    for name in (
        "plan_execution",
        "publisher",
        "plan_event",
        "plan_action",
        "plan_satellite",
        "plan",
    ):
        op.drop_table(name)
