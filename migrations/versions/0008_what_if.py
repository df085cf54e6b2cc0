"""Jobs keep the job that they vary, and the change."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("job", sa.Column("what_if_of", sa.String(length=36), nullable=True))
    op.add_column("job", sa.Column("change", sa.JSON(), nullable=True))


def downgrade() -> None:
    op.drop_column("job", "change")
    op.drop_column("job", "what_if_of")
