"""The ascent on the multipliers of targets: one for all kinds of subproblem.

A plan's parts share only the targets. The parts answer the current multipliers one after another,
in random order; after every few answers the multipliers move: up for targets that the current
answers take more than once, down for those that none takes. Steps get shorter. The mean of the
multipliers settles far sooner than they do (an incremental subgradient method, Nedic and Bertsekas
2001). Now and then all parts are evaluated at this mean, which proves a bound.

An oracle defines the parts and how each one answers: longest paths (``paths``), paths that remember
targets (``elementary``), batteries (``energy``), recorders (``data``), chains with continuous
starts (``chains``), queues (``queues``). The exact programmes of ``resources`` take seconds for an
answer and have too few parts for this: they take longer steps, whose length depends on the bound's
value.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.tuning import TUNING
from planner_core.jit import inlined
from planner_core.problem import Bools, Bytes, Floats, Ints


@bundle
class Epochs(NamedTuple):
    """The order in which parts answer in some epochs, and how far multipliers move in between.

    Attributes
    ----------
    orders
        Parts, each once in an epoch. Shape ``(num_epochs, num_parts)``.
    moves_after
        Whether multipliers move after the first, second, ... answer. Shape ``(num_parts,)``.
    lengths
        How far one move of each epoch shifts a multiplier for each answer beyond one that takes
        the target, as a share of the target's best worth. Shape ``(num_epochs,)``.
    most
        The best worth of each target, and zero for contacts. Shape ``(num_targets + 1,)``.
    newest_share
        Weight of an epoch's multipliers in the mean.
    """

    orders: Ints
    moves_after: Bools
    lengths: Floats
    most: Floats
    newest_share: float


@bundle
class Standing(NamedTuple):
    """The state of an ascent; kernels change it in place. Shape ``(num_targets + 1,)`` each.

    Attributes
    ----------
    now, mean
        The current multipliers, and their moving mean.
    taken
        How many of the parts' latest answers take each target.
    """

    now: Floats
    mean: Floats
    taken: Ints


class Oracle(Protocol):
    """Solves subproblems that share only the targets, at given multipliers.

    Multipliers and counts have an entry for each target and a last one for contacts, which stays
    zero.
    """

    @property
    def parts(self) -> Ints:
        """The parts that have any tasks."""

    def run(self, epochs: Epochs, standing: Standing, stop: Bytes) -> int:
        """Let parts answer anew, move multipliers in between; return how many epochs were run."""

    def gain(self, multipliers: Floats) -> float:
        """Return the most that all parts can gain at these multipliers."""


class OneByOne(ABC):
    """An oracle whose answers take so long that calling for each from Python costs nothing."""

    @abstractmethod
    def answer(self, part: int, multipliers: Floats, count: Ints) -> None:
        """Let a part answer anew, and update the count of the latest answers."""

    def run(self, epochs: Epochs, standing: Standing, stop: Bytes) -> int:
        """Let parts answer anew, move multipliers in between; return how many epochs were run."""
        now, mean, count = standing
        moves_after = epochs.moves_after.tolist()
        for number, order in enumerate(epochs.orders.tolist()):
            step = epochs.lengths[number] * epochs.most
            for part, is_moved in zip(order, moves_after, strict=True):
                if stop[0]:
                    return number
                self.answer(part, now, count)
                if is_moved:
                    np.clip(now + step * (count - 1), 0.0, epochs.most, out=now)
            mean += epochs.newest_share * (now - mean)
        return len(epochs.orders)


class Latest:
    """Which targets the latest answer of each part takes."""

    def __init__(self, num_parts: int) -> None:
        self._taken = [np.empty(0, dtype=np.int32)] * num_parts

    def replace(self, part: int, targets: Ints, count: Ints) -> None:
        """Replace a part's latest answer, and update the count of all parts."""
        np.subtract.at(count, self._taken[part], 1)
        np.add.at(count, targets, 1)
        self._taken[part] = targets


class Part(Protocol):
    """One satellite's dynamic programme."""

    @property
    def target(self) -> Ints:
        """The target of each task; ``num_targets`` for contacts."""


P = TypeVar("P", bound=Part)


class BestPaths(OneByOne, Generic[P]):
    """An oracle that answers with the best path of each satellite."""

    def __init__(self, satellites: Sequence[P]) -> None:
        self._satellites = satellites
        self.parts: Ints = np.arange(len(satellites), dtype=np.int32)
        self._latest = Latest(len(satellites))

    @abstractmethod
    def best(self, part: P, multipliers: Floats) -> tuple[float, Ints]:
        """Return the most that a satellite can gain, and the tasks of a path that gains it."""

    def answer(self, part: int, multipliers: Floats, count: Ints) -> None:
        """Let a satellite answer anew, and update the count of the latest answers."""
        satellite = self._satellites[part]
        _, path = self.best(satellite, multipliers)
        self._latest.replace(part, satellite.target[path], count)

    def gain(self, multipliers: Floats) -> float:
        """Return the most that all satellites can gain."""
        return sum(self.best(part, multipliers)[0] for part in self._satellites)


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """How far multipliers move.

    Attributes
    ----------
    first
        How far a multiplier moves at the initial step length, over an epoch, for each answer beyond
        one that takes the target; a share of the target's best worth.
    last
        Step length after ``num_epochs``, as a share of ``first``.
    num_epochs
        After how many epochs more are of little use.
    asked_every
        The mean is evaluated for the bound it proves each time so many epochs have passed.
    """

    first: float
    last: float
    num_epochs: int
    asked_every: int = 5


class Ascent:
    """Multipliers that get better epoch by epoch; in each epoch every part answers once.

    The result depends on the seed, not on how many epochs are asked for at a time.

    Parameters
    ----------
    most
        The best worth of each target. Shape ``(num_targets,)``.
    begin
        The initial multipliers. Shape ``(num_targets,)``.

    Attributes
    ----------
    value, multipliers
        The lowest bound proven so far, and the multipliers that prove it. Shape ``(num_targets,)``.
    """

    def __init__(
        self, oracle: Oracle, most: Floats, begin: Floats, steps: Steps, seed: int
    ) -> None:
        self._oracle, self._steps = oracle, steps
        self._most = np.append(most, 0.0)
        now = np.clip(np.append(begin, 0.0), 0.0, self._most)
        self._standing = Standing(now, now.copy(), np.zeros(len(now), dtype=np.int32))
        self._rng = np.random.default_rng(seed)
        self._epoch = 0
        # With multipliers of their best worth, targets leave nothing for any task to earn.
        self.value, self.multipliers = float(most.sum()), most

    @property
    def is_settled(self) -> bool:
        """Whether more epochs are of little use."""
        return self._epoch >= self._steps.num_epochs

    @property
    def mean(self) -> Floats:
        """The moving mean of the multipliers. Shape ``(num_targets,)``."""
        mean: Floats = self._standing.mean[:-1]
        return mean

    def improve(self, num_epochs: int, stop: Bytes) -> None:
        """Run so many epochs, and evaluate the mean every ``asked_every`` epochs."""
        every, last = self._steps.asked_every, self._epoch + num_epochs
        while self._epoch < last:
            num_next = min(last - self._epoch, every - self._epoch % every)
            self._epoch += self._oracle.run(self._next(num_next), self._standing, stop)
            if stop[0]:
                return
            if self._epoch % every == 0:
                self.ask()

    def run(self, level: float, stop: Bytes) -> None:
        """Go on until more epochs are of little use, or the bound is down to ``level``."""
        while not (self.is_settled or self.value <= level or stop[0]):
            self.improve(self._steps.asked_every, stop)

    def _next(self, num_epochs: int) -> Epochs:
        steps, parts = self._steps, self._oracle.parts
        num_moves = min(TUNING.moves_per_epoch, len(parts))
        moves_after = np.zeros(len(parts), dtype=np.bool_)
        moves_after[len(parts) * np.arange(1, num_moves + 1) // max(1, num_moves) - 1] = True
        numbers = range(self._epoch, self._epoch + num_epochs)
        shorter = [steps.last ** (number / max(1, steps.num_epochs)) for number in numbers]
        # Until all parts have answered once it is unknown which targets are taken twice.
        first = [steps.first if number else 0.0 for number in numbers]
        return Epochs(
            orders=np.array([self._rng.permutation(parts) for _ in numbers]),
            moves_after=moves_after,
            lengths=np.array(first) * np.array(shorter) / max(1, num_moves),
            most=self._most,
            newest_share=TUNING.newest_share,
        )

    def ask(self) -> None:
        """Evaluate the bound that the mean of the multipliers proves; keep the lowest."""
        mean = self._standing.mean
        value = float(mean.sum()) + self._oracle.gain(mean)
        if value < self.value:
            self.value, self.multipliers = value, mean[:-1].copy()


@inlined
def weigh(
    begin: int,
    end: int,
    site: Ints,
    worth: Floats,
    standing: Standing,
    weight: Floats,
    is_on_path: Bools,
) -> None:
    """Weigh a part's nodes at the current multipliers, and take its last path off the count."""
    for a in range(begin, end):
        weight[a] = max(0.0, worth[a] - standing.now[site[a]])
        if is_on_path[a]:
            is_on_path[a] = False
            standing.taken[site[a]] -= 1


@inlined
def move(standing: Standing, epochs: Epochs, number: int, i: int) -> None:
    """Move multipliers if they move after the i-th answer; update the mean at an epoch's end.

    Each multiplier stays between 0 and the best worth of its target.
    """
    length, most, now, taken = epochs.lengths[number], epochs.most, standing.now, standing.taken
    if epochs.moves_after[i]:
        for j in range(len(now)):
            now[j] = min(max(now[j] + length * most[j] * (taken[j] - 1), 0.0), most[j])
    if i + 1 == len(epochs.moves_after):
        for j in range(len(now)):
            standing.mean[j] += epochs.newest_share * (now[j] - standing.mean[j])
