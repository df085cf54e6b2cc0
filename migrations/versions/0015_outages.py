"""Outages of satellites and ground stations, stored once."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

_INSTANT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "outage",
        sa.Column("id", sa.String(length=36), primary_key=True),
        sa.Column("satellite_id", sa.String(36), sa.ForeignKey("satellite.id"), nullable=True),
        sa.Column("station_id", sa.String(36), sa.ForeignKey("ground_station.id"), nullable=True),
        sa.Column("start", _INSTANT, nullable=False),
        sa.Column("end", _INSTANT, nullable=False),
        sa.Column("modes", sa.JSON(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("created_at", _INSTANT, nullable=False),
        sa.Column("deleted_at", _INSTANT, nullable=True),
    )
    op.create_index("ix_outage_end", "outage", ["end"])


def downgrade() -> None:
    op.drop_table("outage")
