"""``slewline replan``: what happened to a plan to the service, the plan that follows back."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from service.client import Client, Job, PlanAction, PlanChanges
from service.commands.plan import follow_to_plan
from service.commands.summary import table
from service.wire.instants import instant_text

_HEADER = ("change", "cause", "satellite", "action", "of", "was at", "is at")


def follow_to_draft(
    client: Client, plan_id: str, happened: Mapping[str, Any], *, out: Path | None, detach: bool
) -> int:
    """Have a plan replanned; print a summary, the draft and its changes.

    Where the job is cancelled, the best plan that it had by then is a draft all the same.

    Parameters
    ----------
    plan_id
        Of the plan that goes on.
    happened
        The body of the call, as the API takes it.

    Takes, returns and raises else what ``follow_to_plan`` does.
    """
    key = secrets.token_hex(16)
    submit = partial(client.jobs.replan, plan_id, happened, idempotency_key=key)

    def tell(job: Job) -> None:
        draft = client.plans.draft_of(job)
        print(f"\ndraft {draft.id}, after {plan_id}")
        print(changes_text(client.plans.changes(draft.id)))

    return follow_to_plan(client, submit, out=out, detach=detach, tell=tell)


def changes_text(changes: PlanChanges) -> str:
    """Return what a replan has changed, a line for each action."""
    if not changes.items:
        return "Nothing changes."
    rows = [_HEADER]
    for item in changes.items:
        one = item.action or item.parent_action
        assert one is not None
        rows.append(
            (item.change, item.cause, one.satellite_name or one.satellite_id, one.mode, _of(one),
             _start(item.parent_action), _start(item.action))
        )  # fmt: skip
    shares = f"{changes.changed_share:.1%} of the actions change, {changes.forced_share:.1%} must."
    return f"{table(rows)}\n{shares}"


def _of(action: PlanAction) -> str:
    return action.target_name or action.target_id or action.station_name or action.station_id or ""


def _start(action: PlanAction | None) -> str:
    return "-" if action is None else instant_text(action.start)
