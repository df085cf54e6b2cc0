"""Names of targets in addition to ids in a plan's actions, and when a catalogue changed."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("plan_action", sa.Column("target_name", sa.Text(), nullable=True))
    changed_at = sa.Column("changed_at", sa.DateTime(timezone=True), nullable=True)
    op.add_column("target_catalog", changed_at)


def downgrade() -> None:
    op.drop_column("target_catalog", "changed_at")
    op.drop_column("plan_action", "target_name")
