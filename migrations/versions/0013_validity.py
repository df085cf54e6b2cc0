"""The validity and the warnings of each job's plan, in the job's row."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

_JOB = sa.table("job", sa.column("id"), sa.column("validity"))
_RESULT = sa.table("job_result", sa.column("job_id"), sa.column("figures", sa.JSON))


def upgrade() -> None:
    op.add_column("job", sa.Column("validity", sa.String(length=16), nullable=True))
    op.add_column("job", sa.Column("warnings", sa.JSON(), nullable=True))
    connection = op.get_bind()
    for job_id, figures in connection.execute(sa.select(_RESULT.c.job_id, _RESULT.c.figures)):
        if figures is not None:
            changed = sa.update(_JOB).where(_JOB.c.id == job_id)
            connection.execute(changed.values(validity=figures.get("validity")))


def downgrade() -> None:
    op.drop_column("job", "warnings")
    op.drop_column("job", "validity")
