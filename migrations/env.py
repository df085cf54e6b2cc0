"""Alembic's environment: runs on the caller's connection, in the caller's transaction."""

from __future__ import annotations

from alembic import context

from service.db.rows import Row

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Row.metadata,
    render_as_batch=True,
)
with context.begin_transaction():
    context.run_migrations()
