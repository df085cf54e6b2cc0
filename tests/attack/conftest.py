"""What attacks are aimed at: servers with owners and keys, on SQLite or the named PostgreSQL."""

from __future__ import annotations

from tests.service.access.conftest import Door, MakeDoor, door, make_door
from tests.service.jobs.conftest import Jobs, client, jobs, template_url, workers
from tests.service.webhooks.conftest import courier, post

__all__ = [
    "Door",
    "Jobs",
    "MakeDoor",
    "client",
    "courier",
    "door",
    "jobs",
    "make_door",
    "post",
    "template_url",
    "workers",
]
