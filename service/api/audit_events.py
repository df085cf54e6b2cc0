"""The record of changes, for administrators."""

from __future__ import annotations

from typing import Annotated

import sqlalchemy as sa
from fastapi import APIRouter, Depends, Query

from service.api.deps import CallDep, admin_only
from service.api.paging import PagingDep, newest_first
from service.db.rows import AuditEventRow
from service.stores.finding import with_values
from service.wire.base import Listed
from service.wire.operations import AuditEventOut
from service.wire.stored import from_row

router = APIRouter(
    prefix="/v1/audit-events", tags=["operations"], dependencies=[Depends(admin_only)]
)


@router.get("")
def list_audit_events(
    call: CallDep,
    paging: PagingDep,
    object_id: Annotated[str | None, Query(description="Only of this object.")] = None,
    kind: Annotated[str | None, Query(description="Only of objects of this kind.")] = None,
    action: Annotated[str | None, Query(description="Only this action.")] = None,
    owner: Annotated[str | None, Query(description="Only by keys of this owner.")] = None,
) -> Listed[AuditEventOut]:
    """List who changed what, newest first. Needs the scope `admin`."""
    wanted = {"object_id": object_id, "kind": kind, "action": action, "owner": owner}
    query = sa.select(AuditEventRow).where(*with_values(AuditEventRow, **wanted))
    with call.database.reading() as session:
        page = newest_first(session, query, AuditEventRow.id, paging)
        return page.listed(lambda row: from_row(AuditEventOut, row))
