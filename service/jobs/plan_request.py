"""What travels between a worker and the process that plans: a request and its answer.

Nothing here needs the planner, so that a worker can start without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from service.answers.chunks import Chunk, targets_text, timeline_text


class Parcel:
    """Bytes that are handed on once, so that only the taker keeps them in memory."""

    def __init__(self, content: bytes | None):
        self._content = content

    def take(self) -> bytes | None:
        """Return the bytes the first time; None if there are none or they were taken."""
        content, self._content = self._content, None
        return content


@dataclass(frozen=True, slots=True, kw_only=True)
class Parent:
    """The parent plan of a replan, as stored by its own job.

    Attributes
    ----------
    content, bound, opportunity_block
        As in ``PlanRequest``.
    imaged
        The ids of the targets that it images.
    """

    scenario_sha256: str
    content: str
    bound: str | None
    imaged: frozenset[str]
    opportunity_block: Parcel = field(default_factory=lambda: Parcel(None))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """What one job is to do, as sent to the solver's process.

    Attributes
    ----------
    run
        The number of this run of the job, from 1.
    content
        The canonical scenario file (JSON text).
    params
        The solver's parameters, including defaults.
    limits
        ``time_s`` and ``memory_mb``.
    opportunity_block
        The scenario's stored opportunities; empty if they are still to be computed.
    bound
        The best known bound for the scenario with its proof (JSON text), or None.
    parent
        The parent plan, if this is a replan.
    held_in
        The worker's folder of ``HeldBlocks``, or None if it has none.
    """

    job_id: str
    scenario_sha256: str
    content: str
    solver: str
    params: Mapping[str, Any]
    seed: int
    limits: Mapping[str, Any]
    run: int = 1
    opportunity_block: Parcel = field(default_factory=lambda: Parcel(None))
    bound: str | None = None
    parent: Parent | None = None
    held_in: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAnswer:
    """The answer of a job.

    Attributes
    ----------
    chunks
        The timeline document, and each target with its outcome.
    termination
        Why the search ended.
    reward, bound
        The reward by the referee; the value that no plan can exceed, if known.
    proof
        The bound with its proof (JSON text).
    opportunity_block
        Opportunities to store, if this job was the first to compute them.
    figures
        The timeline's numbers for tables.
    warnings
        The timeline's messages for people.
    """

    chunks: tuple[Chunk, ...]
    termination: str
    reward: float
    bound: float | None = None
    proof: str | None = None
    opportunity_block: bytes | None = None
    figures: Mapping[str, Any] | None = None
    warnings: tuple[str, ...] = ()

    @property
    def timeline(self) -> str:
        """Return the timeline document (JSON text)."""
        return timeline_text(self.chunks)

    @property
    def targets(self) -> str:
        """Return all targets with their outcomes (JSON text of a list)."""
        return targets_text(self.chunks)
