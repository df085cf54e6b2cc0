"""Explanations, what-ifs, differences and webhooks through the client."""

from __future__ import annotations

import pytest

from service.client import Client, ServiceError
from tests.service.jobs.mission import HIDDEN, ODD, small_mission


def test_a_target_is_explained_and_let_in_by_what_the_explanation_says(whole: Client) -> None:
    job = whole.jobs.submit(small_mission(), "rule").wait(120.0)
    hidden = job.explanation(HIDDEN)
    assert hidden.reason is not None
    assert (hidden.reason.code, hidden.opportunities) == ("no_access", ())
    assert job.explanation(ODD).target_id == ODD
    change = next(c for c in hidden.access_changes if "targets" in c)
    varied = job.what_if(relax=change, force=[HIDDEN], label="wider").wait(120.0)
    assert varied.label == "wider"
    assert varied.change == {"force": [HIDDEN], "forbid": [], "relax": change}
    assert varied.explanation(HIDDEN).action_id is not None
    found = whole.jobs.diff(job, varied.id)
    assert HIDDEN in {action.target_id for action in found.added}
    assert (found.is_empty, found.questions_differ_in) == (False, ("scenario",))
    assert whole.jobs.diff(job.id, job).is_empty
    with pytest.raises(ServiceError) as refused:
        job.what_if(force=["no such"])
    assert refused.value.errors[0].pointer == "/force/0"


def test_webhooks_are_made_tried_and_deleted(patient: Client) -> None:
    made = patient.webhooks.create("https://ops.example/", events=["job.failed"], name="ops")
    assert made.secret is not None
    (listed,) = patient.webhooks.list()
    assert (listed.id, listed.events, listed.secret) == (made.id, ("job.failed",), None)
    sent = patient.webhooks.test(made.id)
    assert (sent.event, [one.id for one in patient.webhooks.deliveries(made.id)]) == (
        "test", [sent.id],
    )  # fmt: skip
    patient.webhooks.delete(made.id)
    assert list(patient.webhooks.list()) == []
