"""Who the service takes a caller for."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel, Field

from service.access.callers import Scope
from service.api.deps import CallerDep

router = APIRouter(prefix="/v1/me", tags=["operations"])


class CallerOut(BaseModel):
    """The caller of this request."""

    owner: str = Field(description="Whose jobs it sends; `local` without a key.")
    scope: Scope = Field(description="Each of read, submit and admin includes those before it.")
    key_id: str | None = Field(description="Public part of the key; null without one.")
    key_name: str | None


@router.get("")
def who_am_i(caller: CallerDep) -> CallerOut:
    """Say whose key this is and what it allows."""
    return CallerOut(
        owner=caller.owner,
        scope=caller.scope,
        key_id=caller.key_id,
        key_name=caller.key_name,
    )
