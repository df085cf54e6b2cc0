"""What attacks are aimed at: servers with owners and keys, on SQLite or the named PostgreSQL."""

from __future__ import annotations

from tests.service.access.conftest import Door, MakeDoor, door, make_door
from tests.service.jobs.conftest import Jobs, jobs, template_url, workers

__all__ = ["Door", "Jobs", "MakeDoor", "door", "jobs", "make_door", "template_url", "workers"]
