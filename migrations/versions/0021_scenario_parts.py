"""The satellites and ground stations of each scenario, by which lists are filtered."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

_KINDS = {"satellite_ids": "satellite", "ground_station_ids": "station"}
_AT_A_TIME = 200


def upgrade() -> None:
    part = op.create_table(
        "scenario_part",
        sa.Column("part_id", sa.Text(), nullable=False),
        sa.Column("scenario_id", sa.String(length=36), nullable=False),
        sa.Column("kind", sa.String(length=16), nullable=False),
        sa.ForeignKeyConstraint(["scenario_id"], ["scenario.id"]),
        sa.PrimaryKeyConstraint("part_id", "scenario_id", "kind"),
    )
    op.create_index("ix_scenario_part_scenario_id", "scenario_part", ["scenario_id"])
    scenario = sa.table("scenario", sa.column("id"), sa.column("summary", sa.JSON()))
    bind, last = op.get_bind(), ""
    while True:
        wanted = sa.select(scenario).where(scenario.c.id > last).order_by(scenario.c.id)
        found = bind.execute(wanted.limit(_AT_A_TIME)).all()
        if not found:
            return
        rows = [
            {"part_id": part_id, "scenario_id": own_id, "kind": kind}
            for own_id, summary in found
            for name, kind in _KINDS.items()
            for part_id in dict.fromkeys(summary.get(name, ()))
        ]
        if rows:
            bind.execute(sa.insert(part), rows)
        last = found[-1].id


def downgrade() -> None:
    op.drop_table("scenario_part")
