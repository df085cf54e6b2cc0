"""Who the service takes a caller for."""

from __future__ import annotations

from fastapi import APIRouter

from service.api.deps import CallerDep
from service.wire.operations import CallerOut

router = APIRouter(prefix="/v1/me", tags=["operations"])


@router.get("")
def who_am_i(caller: CallerDep) -> CallerOut:
    """Say whose key this is and what it allows."""
    return CallerOut(
        owner=caller.owner,
        scope=caller.scope.value,
        key_id=caller.key_id,
        key_name=caller.key_name,
    )
