"""Lists of jobs are read from an index, newest first, however many jobs there are."""

from __future__ import annotations

from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_FILTERS = ("scenario_id", "tenant", "state", "label")
_HAD_ONE = _FILTERS[:3]


def upgrade() -> None:
    for column in _HAD_ONE:
        op.drop_index(f"ix_job_{column}", table_name="job")
    for column in _FILTERS:
        op.create_index(f"ix_job_{column}_id", "job", [column, "id"])


def downgrade() -> None:
    for column in _FILTERS:
        op.drop_index(f"ix_job_{column}_id", table_name="job")
    for column in _HAD_ONE:
        op.create_index(f"ix_job_{column}", "job", [column])
