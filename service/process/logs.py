"""Structured logs: one JSON object per line, with the request it belongs to."""

from __future__ import annotations

import faulthandler
import json
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Final

from opentelemetry import trace

from service.access.tokens import masked

STDERR: Final = 2  # the file descriptor, for other processes

request_id: ContextVar[str | None] = ContextVar("request_id", default=None)
job_id: ContextVar[str | None] = ContextVar("job_id", default=None)

_STANDARD = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "color_message"}


def _trace_id() -> str | None:
    context = trace.get_current_span().get_span_context()
    return trace.format_trace_id(context.trace_id) if context.is_valid else None


@contextmanager
def about_job(job: str, request: str | None) -> Iterator[None]:
    """Name a job, and the request that submitted it, in each log line of this thread."""
    tokens = job_id.set(job), request_id.set(request)
    try:
        yield
    finally:
        job_id.reset(tokens[0])
        request_id.reset(tokens[1])


class JsonFormatter(logging.Formatter):
    """Writes a record with its ``extra`` fields as one line of JSON, with API keys masked."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        fields: dict[str, object] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            "request_id": request_id.get(),
            "job_id": job_id.get(),
            "trace_id": _trace_id(),
        }
        fields |= {k: v for k, v in vars(record).items() if k not in _STANDARD}
        if record.exc_info:
            fields["traceback"] = self.formatException(record.exc_info)
        kept = {k: v for k, v in fields.items() if v is not None}
        return masked(json.dumps(kept, default=str, ensure_ascii=False))


def configure_logging() -> None:
    """Send all logs of this process to standard error as JSON lines, and crashes with stacks."""
    faulthandler.enable(STDERR)
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
    # Otherwise each HTTP call that the service makes would be a line.
    logging.getLogger("httpx").setLevel(logging.WARNING)
