"""What ``slewline replan`` prints: the draft that it made, and the changes in it."""

from __future__ import annotations

from service.client import Client, Job, PlanAction, PlanChanges
from service.commands.summary import table
from service.wire.instants import instant_text

_HEADER = ("change", "cause", "satellite", "action", "of", "was at", "is at")


def print_draft(client: Client, plan_id: str, job: Job) -> None:
    """Print the draft that a job has made from a plan, and a line for each changed action."""
    draft = client.plans.draft_of(job)
    print(f"\ndraft {draft.id}, after {plan_id}")
    changes = client.plans.changes(draft.id)
    print(_changes_text(changes) if changes.items else "Nothing changes.")


def _changes_text(changes: PlanChanges) -> str:
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
