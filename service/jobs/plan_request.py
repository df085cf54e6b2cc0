"""What travels between a worker and the process that plans: the question, and its answer.

Nothing here needs the planner, so that a worker starts without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from service.answers.blocks import Block, targets_text, timeline_text


class Parcel:
    """Bytes that are handed on once: who takes them is alone in holding them."""

    def __init__(self, content: bytes | None):
        self._content = content

    def take(self) -> bytes | None:
        """Return the bytes the first time; None where there are none, or no longer."""
        content, self._content = self._content, None
        return content


@dataclass(frozen=True, slots=True, kw_only=True)
class Parent:
    """The plan that a replan goes on from, as its own job has stored it.

    Attributes
    ----------
    content, bound, opportunity_block
        As those of a request.
    imaged
        The targets that it images.
    """

    scenario_sha256: str
    content: str
    bound: str | None
    imaged: frozenset[str]
    opportunity_block: Parcel = field(default_factory=lambda: Parcel(None))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """The frozen question of one job, as it travels to the solver's process.

    Attributes
    ----------
    run
        Which run of the job this is, from 1.
    content
        The canonical scenario file (JSON text).
    params
        The solver's parameters, defaults filled in.
    limits
        ``time_s`` and ``memory_mb``.
    opportunity_block
        The scenario's stored opportunities; none where they are still to be computed.
    bound
        The best bound known of the scenario with its proof (JSON text), or None.
    parent
        Of a replan: the plan before.
    held_in
        The worker's folder of ``HeldBlocks``; None where nothing is held.
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
    """What a job leaves behind.

    Attributes
    ----------
    blocks
        The timeline document, and every target with its outcome.
    termination
        Why the search ended.
    reward, bound
        What the referee awarded; what no plan can exceed, where it is known.
    proof
        That bound with what proves it (JSON text).
    opportunity_block
        Opportunities to store, where this job was the first to compute them.
    figures
        The timeline's numbers for tables.
    warnings
        What the timeline says to people.
    """

    blocks: tuple[Block, ...]
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
        return timeline_text(self.blocks)

    @property
    def targets(self) -> str:
        """Return every target with its outcome (JSON text of a list)."""
        return targets_text(self.blocks)
