"""The results of a job: its timeline in several forms, its proof, and the targets' outcomes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Query, Response
from fastapi.responses import StreamingResponse

import planner_core
from service.answers import store as answer_store
from service.answers.answered import Answered, in_chunks
from service.answers.chunks import TIMELINE, Entry, holds, items_in
from service.api import job_intake as intake
from service.api.accept import preferred, require_offered
from service.api.conditional import matches, readable, sent
from service.api.deps import Call, CallDep, own_job_only
from service.api.errors import problem_responses
from service.api.job_shapes import etag_of_timeline
from service.api.paging import PagingDep
from service.db.rows import JobRow
from service.exports.forms import FORMS, Form
from service.problems.kinds import ServiceError
from service.stores import job_store as store
from service.wire.base import Listed
from service.wire.outcomes import TargetItem
from service.wire.timelines import Outcome

router = APIRouter(prefix="/v1/jobs", tags=["timelines"], dependencies=[Depends(own_job_only)])

_JSON: Final = "application/json"
_TIMELINE: Final = {"$ref": "#/components/schemas/Timeline"}
_PROOF: Final = {"anyOf": [{"$ref": "#/components/schemas/Proof"}, {"type": "null"}]}
_BY_SUFFIX: Final = {form.suffix: form for form in FORMS}
_BY_TYPE: Final = {form.media_type: form for form in FORMS if form.has_own_type}
_SUFFIXES: Final = ["json", *_BY_SUFFIX]

_ABOUT = "; ".join(f"`{form.suffix}`: {form.about}" for form in FORMS)
Suffix = Annotated[
    str,
    Path(description=f"Form of the answer. `json`: the document; {_ABOUT}.", examples=_SUFFIXES),
]


def timeline_responses(forms: Sequence[Form]) -> dict[int | str, dict[str, Any]]:
    """Return the entries of the OpenAPI document for a route that offers these forms and JSON."""
    # JSON stands first: generated clients read the first form they know.
    content: dict[str, Any] = {_JSON: {"schema": _TIMELINE}}
    content |= {
        form.media_type: {"schema": {"type": "string"}}
        if form.media_type.startswith("text/")
        else {}
        for form in forms
        if form.media_type != _JSON
    }
    if _JSON in (form.media_type for form in forms):
        other = [{"type": "array", "items": {"type": "object"}}, {"type": "object"}]
        # Generated clients treat all of these as text, whatever the suffix.
        del content[_JSON]
        content[_JSON] = {"schema": {"anyOf": [_TIMELINE, *other]}}
    name = {"description": "A name to save it under.", "schema": {"type": "string"}}
    headers = {"Content-Disposition": name}
    return {
        200: {"description": "The timeline.", "content": content, "headers": headers},
        **readable(406, 409),
    }


@router.get(
    "/{job_id}/timeline",
    response_class=Response,
    responses=timeline_responses(list(_BY_TYPE.values())),
)
def get_timeline(job_id: str, call: CallDep) -> Response:
    """Return the plan as judged by the referee: actions, resources, totals, violations.

    `Accept` chooses the form. The call with a suffix offers further forms.
    """
    media_type = preferred(call.request.headers.get("accept"), [_JSON, *_BY_TYPE])
    with call.database.reading() as session:
        job = intake.find_job(session, job_id)
    if media_type is None:
        raise ServiceError(
            "not_acceptable", f"The timeline is offered as {', '.join([_JSON, *_BY_TYPE])}."
        )
    return _answer(call, job, _BY_TYPE.get(media_type))


@router.get(
    "/{job_id}/timeline.{suffix}", response_class=Response, responses=timeline_responses(FORMS)
)
def get_timeline_as(job_id: str, suffix: Suffix, call: CallDep) -> Response:
    """Return the plan in the form that the suffix names, whatever `Accept` says."""
    with call.database.reading() as session:
        job = intake.find_job(session, job_id)
    return timeline_answer(call, job, suffix)


def timeline_answer(call: Call, job: JobRow, suffix: str) -> Response:
    """Return a job's plan in the form that a suffix names."""
    require_offered(suffix, _SUFFIXES, "The timeline is")
    return _answer(call, job, _BY_SUFFIX.get(suffix))


@router.get(
    "/{job_id}/proof",
    responses={
        200: {"content": {_JSON: {"schema": _PROOF}}, "description": "The proof document."},
        **readable(409),
    },
)
def get_proof(job_id: str, call: CallDep) -> Response:
    """Return the proof of the timeline's bound, or `null` if it has none.

    `proof` names the argument and `value` the bound. `prices` holds a multiplier for each
    target, in the order of the scenario: the dual function at these multipliers is the bound.
    """
    with call.database.reading() as session:
        job = intake.find_job(session, job_id)
        intake.require_answer(session, job)
        proof = answer_store.proof_of(session, job_id)
    return sent(call.request, proof or "null", _JSON, {"ETag": f'"{job_id}"'})


@router.get(
    "/{job_id}/targets", responses=problem_responses(404, 409), response_model_exclude_unset=True
)
def list_outcomes(
    job_id: str,
    call: CallDep,
    paging: PagingDep,
    outcome: Annotated[Outcome | None, Query(description="Only this outcome.")] = None,
    reason: Annotated[str | None, Query(description="Only this reason's code.")] = None,
    target_id: Annotated[str | None, Query(description="Only this target.")] = None,
) -> Listed[TargetItem]:
    """List every target of the scenario once, with its outcome and why it was left out."""
    after = paging.after_number()
    with call.database.reading() as session:
        intake.require_answer(session, intake.find_job(session, job_id))
        contents = answer_store.contents(session, job_id, "targets")
    entries = (
        entry
        for entry in contents
        if entry.first + entry.num_items - 1 > after and holds(entry.tally, outcome, reason)
    )
    found = (
        (position, target)
        for entry, text in answer_store.texts(call.database.reading, job_id, entries)
        if target_id is None or json.dumps(target_id) in text
        for position, target in enumerate(items_in(text), entry.first)
        if position > after
        and target_id in (None, target["target_id"])
        and outcome in (None, target["outcome"])
        and reason in (None, (target["reason"] or {}).get("code"))
    )
    page = paging.answer(list(islice(found, paging.limit + 1)), lambda row: row[0])
    return page.listed(lambda row: TargetItem(**row[1]))


def _answer(call: Call, job: JobRow, form: Form | None) -> Response:
    """Return a timeline in a form, or as the document itself."""
    suffix, etag = "json", etag_of_timeline(job.id)
    if form is not None:
        # The content of a form may change with the version of the service.
        suffix, etag = form.suffix, f'"{job.id}-{form.suffix}-{planner_core.__version__}"'
    headers = {
        "ETag": etag,
        "Vary": "Accept",
        "Content-Disposition": f'inline; filename="timeline-{job.id}.{suffix}"',
    }
    with call.database.reading() as session:
        finished_at = intake.require_answer(session, job)
        if matches(call.request.headers.get("if-none-match"), etag):
            return Response(status_code=304, headers=headers)
        contents = answer_store.contents(session, job.id, *TIMELINE, "targets")
        content = "" if form is None else store.content_of(session, job.id)

    def texts(entries: Iterable[Entry]) -> Iterator[tuple[Entry, str]]:
        return answer_store.texts(call.database.reading, job.id, entries)

    if form is None:
        entries = (entry for entry in contents if entry.kind in TIMELINE)
        pieces = in_chunks(text for _, text in texts(entries))
        return StreamingResponse(pieces, media_type=_JSON, headers=headers)
    answered = Answered(contents, texts, content, finished_at)
    return StreamingResponse(form.write(answered), media_type=form.media_type, headers=headers)
