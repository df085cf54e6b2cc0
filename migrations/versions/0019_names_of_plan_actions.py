"""Names in addition to ids in a plan's actions."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    action = _table("plan_action", "plan_id", "satellite_id", "station_id", *_NAMES)
    satellite = _table("plan_satellite", "plan_id", "satellite_id", "satellite_name")
    station = _table("ground_station", "id", "name")
    for name in _NAMES:
        op.add_column("plan_action", sa.Column(name, sa.Text(), nullable=True))
    of_satellite = sa.select(satellite.c.satellite_name).where(
        satellite.c.plan_id == action.c.plan_id,
        satellite.c.satellite_id == action.c.satellite_id,
    )
    of_station = sa.select(station.c.name).where(station.c.id == action.c.station_id)
    op.execute(
        action.update().values(
            satellite_name=of_satellite.scalar_subquery(),
            station_name=of_station.scalar_subquery(),
        )
    )


def downgrade() -> None:
    for name in _NAMES:
        op.drop_column("plan_action", name)


_NAMES = ("satellite_name", "station_name")


def _table(name: str, *columns: str) -> sa.TableClause:
    return sa.table(name, *(sa.column(each) for each in columns))
