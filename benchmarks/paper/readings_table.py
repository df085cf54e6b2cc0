"""The paper's best settings under every reading, and which is closest to its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.paper.measure import Outcome
from benchmarks.paper.readings import BASE, Reading
from benchmarks.paper.study import MCTS_VARIANTS, Done, Study, best_forward, best_mcts

FORWARD = "forward search"
RULE = "rule"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadRow:
    """One reading of the mission: each method's result, by name of the method."""

    reading: Reading
    outcomes: Mapping[str, Outcome]


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """One reading for both families and both searches.

    Attributes
    ----------
    images, published
        Forward search and MCTS without resources, then with.
    """

    reading: Reading
    variant: str
    images: tuple[int, ...]
    published: tuple[float, ...]

    @property
    def told(self) -> str:
        """Return our numbers and theirs, in words."""
        pairs = zip(self.images, self.published, strict=True)
        return ", ".join(f"{images} for {published:.0f}" for images, published in pairs)

    @property
    def worst(self) -> float:
        """Return the greatest error of the four, relative to the paper's number."""
        pairs = zip(self.images, self.published, strict=True)
        return max(abs(images / published - 1.0) for images, published in pairs)


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearest:
    """The reading in which a method is closest to the paper, and how many images it takes.

    Attributes
    ----------
    tried
        The number of readings tried; among many, one comes close by chance.
    own
        How many images it takes under the study's own reading, if that was run.
    """

    tried: int
    own: int | None
    published: float
    reading: Reading
    method: str
    images: int

    @property
    def told(self) -> str:
        """Return the reading in words, including the algorithm's if it has several."""
        return self.reading.name + self.method.removeprefix("MCTS").removeprefix(FORWARD)

    @property
    def error(self) -> float:
        """Return the relative error to the paper's number."""
        return self.images / self.published - 1.0


def columns() -> list[str]:
    """Return the methods of the table in order."""
    return [RULE, FORWARD, *(f"MCTS, {name}" for name in MCTS_VARIANTS)]


def read_rows(study: Study, done: Done, *, res: bool) -> list[ReadRow]:
    """Return the results under each reading of one family."""
    found = []
    for reading in study.of_family(res=res):
        tasks = {
            RULE: study.rule_task(reading, res=res),
            FORWARD: study.reading_task(best_forward(res), reading),
        }
        for name in MCTS_VARIANTS:
            tasks[f"MCTS, {name}"] = study.reading_task(best_mcts(res), reading, name)
        outcomes = {name: done[task] for name, task in tasks.items() if task in done}
        if outcomes:
            found.append(ReadRow(reading=reading, outcomes=outcomes))
    return found


def nearest(study: Study, done: Done, *, is_mcts: bool, res: bool) -> Nearest | None:
    """Return the reading closest to the paper's best row; the paper counts every image."""
    row = best_mcts(res) if is_mcts else best_forward(res)
    own = done.get(study.reading_task(row, BASE))
    measured = [
        (read.reading, name, outcome.images)
        for read in read_rows(study, done, res=res)
        for name, outcome in read.outcomes.items()
        if (name.startswith("MCTS") if is_mcts else name == FORWARD)
    ]
    found = [
        Nearest(
            tried=len(measured),
            own=own.images if own else None,
            published=row.reward,
            reading=reading,
            method=name,
            images=images,
        )
        for reading, name, images in measured
    ]
    return min(found, key=lambda near: abs(near.error), default=None)


def joint(study: Study, done: Done, among: Sequence[Reading] | None = None) -> Joint | None:
    """Return the one reading that minimises the greatest error of the paper's four numbers."""
    among = study.readings_with if among is None else among
    without = {row.reading.look_deg: row.outcomes for row in read_rows(study, done, res=False)}
    published = tuple(
        row.reward for res in (False, True) for row in (best_forward(res), best_mcts(res))
    )
    found = []
    for row in read_rows(study, done, res=True):
        if row.reading not in among:
            continue
        for variant in MCTS_VARIANTS:
            names = (FORWARD, f"MCTS, {variant}")
            both = (without.get(row.reading.look_deg, {}), row.outcomes)
            if all(name in outcomes for outcomes in both for name in names):
                images = tuple(outcomes[name].images for outcomes in both for name in names)
                found.append(
                    Joint(reading=row.reading, variant=variant, images=images, published=published)
                )
    return min(found, key=lambda one: one.worst, default=None)


def rankings(
    study: Study, done: Done, names: Sequence[str], *, res: bool
) -> dict[tuple[Reading, str], list[int]]:
    """Return the images of these methods by reading of the mission and of MCTS, if all ran."""
    found = {}
    for row in read_rows(study, done, res=res):
        for variant in MCTS_VARIANTS:
            keys = [f"MCTS, {variant}" if name == "MCTS" else name for name in names]
            if all(key in row.outcomes for key in keys):
                found[row.reading, variant] = [row.outcomes[key].images for key in keys]
    return found
