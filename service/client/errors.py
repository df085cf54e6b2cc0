"""What can go wrong between a program and the service."""

from __future__ import annotations

from email.utils import parsedate_to_datetime
from typing import TYPE_CHECKING

import httpx
from pydantic import ValidationError

from service.wire.base import read
from service.wire.operations import FaultOut as Fault
from service.wire.operations import ProblemOut

if TYPE_CHECKING:
    from service.client.jobs import Job


class ClientError(Exception):
    """The base class of all errors of this package."""


class Unreachable(ClientError):
    """No answer came within the client's patience."""


class UnexpectedAnswer(ClientError):
    """The answer does not fit the API: another program, or an incompatible version."""


class ServiceError(ClientError):
    """The service refused a request, or failed at it.

    Attributes
    ----------
    status, code, detail
        From the problem document; ``code`` is stable. It is ``http_502`` or the like if the
        answer does not come from the service itself.
    errors
        Each single fault, with its JSON pointer or line of the file.
    request_id
        The id to search for in the service's log.
    retry_after_s
        When to try again, if the service said so.
    """

    def __init__(
        self,
        *,
        status: int,
        code: str,
        detail: str,
        errors: tuple[Fault, ...] = (),
        request_id: str | None = None,
        retry_after_s: float | None = None,
    ):
        super().__init__(f"{code} ({status}): {detail}")
        self.status = status
        self.code = code
        self.detail = detail
        self.errors = errors
        self.request_id = request_id
        self.retry_after_s = retry_after_s


class JobFailed(ClientError):
    """A job ended without a result; ``job.error`` says why."""

    def __init__(self, job: Job):
        why = f"{job.error.code}: {job.error.detail}" if job.error else "no reason is given"
        super().__init__(f"job {job.id} {job.state}: {why}")
        self.job = job


class WaitTimedOut(ClientError):
    """The expected state was not reached in time. Only the waiting ends; the job goes on."""


def error_of(response: httpx.Response) -> ServiceError:
    """Return the error of an answer, which may or may not be a problem document."""
    try:
        told = read(ProblemOut, response.content)
        about = {name: told[name] for name in ("code", "detail", "errors", "request_id")}
    except ValidationError:
        # For example from a proxy that answers in HTML.
        where = response.headers.get("location")
        detail = response.reason_phrase or "no explanation"
        about = {
            "code": f"http_{response.status_code}",
            "detail": f"{detail}, to {where}" if where else detail,
            "request_id": response.headers.get("x-request-id"),
        }
    return ServiceError(status=response.status_code, retry_after_s=seconds_asked(response), **about)


def seconds_asked(response: httpx.Response) -> float | None:
    """Return the seconds asked for by ``Retry-After``; None if it is missing or unreadable."""
    text = response.headers.get("retry-after", "").strip()
    if text.isdecimal():
        return float(text)
    try:
        at = parsedate_to_datetime(text)
        sent = parsedate_to_datetime(response.headers.get("date", ""))
        return max(0.0, (at - sent).total_seconds())
    except (TypeError, ValueError):
        return None
