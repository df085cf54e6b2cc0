"""Proven bounds: the best for each scenario, and each job's with its proof."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "scenario_bound",
        sa.Column("scenario_sha256", sa.String(length=64), nullable=False),
        sa.Column("version", sa.Text(), nullable=False),
        sa.Column("value", sa.Double(), nullable=False),
        sa.Column("proof", sa.Text(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("scenario_sha256"),
    )
    op.add_column("job_result", sa.Column("proof", sa.Text(), nullable=True))


def downgrade() -> None:
    op.drop_column("job_result", "proof")
    op.drop_table("scenario_bound")
