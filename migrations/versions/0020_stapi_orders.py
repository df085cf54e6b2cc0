"""Orders placed through STAPI."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "stapi_order",
        sa.Column("id", sa.String(36), primary_key=True),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("product_id", sa.String(36), nullable=False),
        sa.Column("catalog_id", sa.String(36), sa.ForeignKey("target_catalog.id"), nullable=False),
        sa.Column("target", sa.JSON(), nullable=False),
        sa.Column("sent", sa.JSON(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
    )
    op.create_index("ix_stapi_order_owner_id", "stapi_order", ["owner", "id"])


def downgrade() -> None:
    op.drop_table("stapi_order")
