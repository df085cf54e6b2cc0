"""Scenarios that came with jobs are visible to the owners of those jobs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

_JOB = sa.table("job", *map(sa.column, ("scenario_id", "tenant", "what_if_of", "rerun_of")))
_OWNER = sa.table("scenario_owner", *map(sa.column, ("scenario_id", "owner")))


def upgrade() -> None:
    op.create_table(
        "scenario_owner",
        sa.Column("scenario_id", sa.String(length=36), nullable=False),
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.ForeignKeyConstraint(["scenario_id"], ["scenario.id"]),
        sa.PrimaryKeyConstraint("scenario_id", "owner"),
    )
    # What earlier versions can tell: a what-if's scenario holds what a job has planned.
    is_plain = _JOB.c.what_if_of.is_(None) & _JOB.c.rerun_of.is_(None)
    private = sa.select(_JOB.c.scenario_id, _JOB.c.tenant).where(
        _JOB.c.scenario_id.in_(sa.select(_JOB.c.scenario_id).where(_JOB.c.what_if_of.is_not(None))),
        _JOB.c.scenario_id.not_in(sa.select(_JOB.c.scenario_id).where(is_plain)),
    )
    op.execute(sa.insert(_OWNER).from_select(["scenario_id", "owner"], private.distinct()))


def downgrade() -> None:
    op.drop_table("scenario_owner")
