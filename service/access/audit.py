"""The record of changes: who changed what, written in the transaction of the change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.access.callers import Caller, Scope
from service.db.clock import utc_now
from service.db.ids import new_id
from service.db.rows import AuditEventRow


@dataclass(frozen=True, slots=True, kw_only=True)
class Audit:
    """Records the changes of one request."""

    caller: Caller
    request_id: str | None

    def record(self, session: Session, action: str, kind: str, *object_ids: str) -> None:
        """Add one event for each object to the caller's transaction."""
        if not object_ids:
            return
        shared = {
            "at": utc_now(),
            "owner": self.caller.owner,
            "key_id": self.caller.key_id,
            "key_name": self.caller.key_name,
            "request_id": self.request_id,
            "action": action,
            "kind": kind,
        }
        session.execute(
            sa.insert(AuditEventRow).values(shared),
            [{"id": new_id(), "object_id": object_id} for object_id in object_ids],
        )


BY_COMMAND_LINE: Final = Audit(
    caller=Caller(owner="command line", scope=Scope.ADMIN), request_id=None
)
"""Whoever has access to the database itself."""
