"""Questions that many requests ask the database at the same time, one query for each kind.

Each kind has one thread. However many requests of one owner arrive at once, they take no thread
that others wait for.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final, cast

from starlette.datastructures import State

from service.access import key_store
from service.access.callers import Caller
from service.api.batched import BatchedQueries
from service.db.rows import JobRow
from service.db.session import Database
from service.stores import job_store

_JOB_ID: Final = re.compile("[0-9a-f-]{36}")


class Questions:
    """The questions of one application.

    Attributes
    ----------
    callers
        The callers of tokens; none for a token that is wrong, expired or revoked.
    ended_keys
        Ids of keys that are revoked or expired.
    owners
        The owners of jobs.
    jobs
        Jobs, each with the hash of its scenario.
    versions
        The versions of jobs: numbers that grow with every visible change.

    Parameters
    ----------
    state
        The state of the application, with its ``database``.
    """

    def __init__(self, state: State):
        self._state = state
        self.callers = BatchedQueries(self._callers, longest_pause_s=0.0)
        self.ended_keys = BatchedQueries(self._ended_keys)
        self.owners = BatchedQueries(self._owners, longest_pause_s=0.0)
        self.jobs = BatchedQueries(self._jobs)
        self.versions = BatchedQueries(self._versions)

    @property
    def _database(self) -> Database:
        return cast(Database, self._state.database)

    def _callers(self, tokens: Sequence[str]) -> Mapping[str, Caller]:
        with self._database.asking() as connection:
            return key_store.callers_of(connection, tokens)

    def _ended_keys(self, key_ids: Sequence[str]) -> Mapping[str, bool]:
        with self._database.asking() as connection:
            return dict.fromkeys(key_store.ended_of(connection, key_ids), True)

    def _owners(self, job_ids: Sequence[str]) -> Mapping[str, str]:
        with self._database.asking() as connection:
            return job_store.owners_of(connection, _readable(job_ids))

    def _jobs(self, job_ids: Sequence[str]) -> Mapping[str, tuple[JobRow, str]]:
        with self._database.reading() as session:
            return job_store.with_hashes(session, _readable(job_ids))

    def _versions(self, job_ids: Sequence[str]) -> Mapping[str, int]:
        with self._database.asking() as connection:
            return job_store.versions_of(connection, job_ids)


def _readable(job_ids: Sequence[str]) -> list[str]:
    # A malformed id would make the query fail for all others.
    return [job_id for job_id in job_ids if _JOB_ID.fullmatch(job_id)]
