"""The semi-Markov decision process of the paper (eqs. 2-7, Table 1), hard limits included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import inlined
from planner_core.mdp.actions import may_wait, next_action
from planner_core.mdp.resource_columns import take
from planner_core.mdp.track import NO_TASK, Track
from planner_core.problem import Bytes, Floats

WAIT: Final = -1
"""The sun-point action: wait for the first opportunity that could be taken, and let it pass."""


@bundle
class Guidance(NamedTuple):
    """The weights of Table 2, which guide a search but are never part of a plan's reward.

    They are per second of contact and of sun-pointing, and for each limit that is broken.
    ``is_contact_by_wait`` counts a contact by the time until it starts, not by its duration.
    ``image_needs`` is what an image needs to count as made, an index of ``IMAGE_NEEDS``.
    """

    gamma: float
    contact_reward_per_s: float
    sunpoint_reward_per_s: float
    penalty: float
    is_contact_by_wait: bool = False
    image_needs: int = 0


IMAGE_NEEDS: Final = ("nothing", "limits", "room")
"""Nothing; battery and recorder within limits (the paper); room on board (the authors' code)."""


@inlined
def counts_as_made(
    track: Track, guidance: Guidance, battery_after: float, recorder_after: float
) -> bool:
    """Return whether an image that leaves these levels enters the images of eq. 2."""
    if guidance.image_needs == 0 or not track.use_resources:
        return True
    if guidance.image_needs == 1:
        return (
            battery_after > track.resources.battery_min
            and recorder_after < track.resources.recorder_max
        )
    return recorder_after < 1.0


@inlined
def task_reward(
    track: Track,
    guidance: Guidance,
    worth: Floats,
    collected: Bytes,
    waited_s: float,
    discount: float,
    row: int,
    battery_after: float,
    recorder_after: float,
) -> float:
    """Return R(s, a) of Table 2 for a collect or a contact.

    ``worth`` is what an image by each row earns, ``waited_s`` is t_s - t, and ``discount`` is gamma
    to the power of ``waited_s``.
    """
    reward = 0.0
    if track.is_contact[row]:
        counted_s = track.end_s[row] - track.start_s[row]
        if guidance.is_contact_by_wait:
            counted_s = waited_s
        reward += guidance.contact_reward_per_s * counted_s
    elif not collected[track.site[row]]:
        reward += discount * worth[row]
    if track.use_resources:
        if battery_after <= track.resources.battery_min:
            reward -= guidance.penalty
        if recorder_after >= track.resources.recorder_max:
            reward -= guidance.penalty
    return reward


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """Eq. 2: time (start of row ``cursor``), last task, images, recorder and battery.

    Battery and recorder are those right after the last task; idle time is added when the
    next task is taken, which is exact because both are linear in between.
    """

    cursor: int
    last: int
    battery: float
    recorder: float
    collected: frozenset[int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What an action leads to: next state, R(s, a), and the sojourn time (t_s - t)."""

    state: State
    reward: float
    sojourn_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """The readable semi-MDP of one satellite; compiled searches are compared with it.

    Attributes
    ----------
    worth
        What an image by each row of the track earns. Shape ``(m,)``.
    """

    track: Track
    worth: Floats
    guidance: Guidance
    is_hard: bool = True
    unimaged_only: bool = True
    contact_above: float = 0.0

    def initial_state(self) -> State:
        """Return the state at the start of the horizon."""
        return State(
            cursor=NO_TASK,
            last=NO_TASK,
            battery=self.track.resources.battery_start,
            recorder=self.track.resources.recorder_start,
            collected=frozenset(),
        )

    def now_s(self, state: State) -> float:
        """Return the time of the most recent action."""
        return float(self.track.start_s[state.cursor]) if state.cursor >= 0 else 0.0

    def actions(self, state: State, breadth: int) -> Sequence[int]:
        """Return the first ``breadth`` tasks of A(s) in time order, then ``WAIT`` if allowed.

        Only the first feasible collect of each access is included.
        """
        collected = self._mask(state)
        rows: list[int] = []
        row = state.cursor
        while len(rows) < breadth:
            row = next_action(
                self.track, state.last, row + 1, state.battery, state.recorder,
                self.is_hard, collected, self.unimaged_only, self.contact_above,
            )  # fmt: skip
            if row == len(self.track.start_s):
                break
            if all(self.track.first_offer[row] != self.track.first_offer[r] for r in rows):
                rows.append(row)
        if rows and self.track.use_resources and self._may_wait(state, rows[0]):
            rows.append(WAIT)
        return rows

    def step(self, state: State, action: int, first_row: int) -> Step:
        """Return where ``action`` leads; ``first_row`` is the first task of A(s)."""
        now_s = self.now_s(state)
        row = first_row if action == WAIT else action
        sojourn_s = float(self.track.start_s[row]) - now_s
        if action == WAIT:
            waited = State(
                cursor=row,
                last=state.last,
                battery=state.battery,
                recorder=state.recorder,
                collected=state.collected,
            )
            reward = self.guidance.sunpoint_reward_per_s * sojourn_s
            return Step(state=waited, reward=reward, sojourn_s=sojourn_s)
        battery, recorder, _ = take(
            self.track.resources, state.last, row, state.battery, state.recorder
        )
        reward = task_reward(
            self.track, self.guidance, self.worth, self._mask(state),
            sojourn_s, self.guidance.gamma**sojourn_s, row, battery, recorder,
        )  # fmt: skip
        images = state.collected
        is_image = not self.track.is_contact[row]
        if is_image and counts_as_made(self.track, self.guidance, battery, recorder):
            images = images | {int(self.track.site[row])}
        taken = State(cursor=row, last=row, battery=battery, recorder=recorder, collected=images)
        return Step(state=taken, reward=float(reward), sojourn_s=sojourn_s)

    def _may_wait(self, state: State, row: int) -> bool:
        return may_wait(self.track, state.last, row, state.battery, state.recorder, self.is_hard)

    def _mask(self, state: State) -> Bytes:
        mask = np.zeros(int(self.track.site.max(initial=-1)) + 1, dtype=np.uint8)
        mask[list(state.collected)] = 1
        return mask
