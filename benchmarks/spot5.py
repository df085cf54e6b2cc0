"""The SPOT-5 daily photograph scheduling instances (``python -m benchmarks.spot5 FOLDER``).

Agnese et al. 1995, Bensana et al. 1999: each photograph is taken by one of its cameras or not at
all, and some pairs or triples cannot be taken together. The files hold no times, only lists of
exclusions. Instances of several orbits also share a recorder.

The exact search here is the clique form of the planner's MILP, with cliques of the listed
conflicts, solved by the same engine.
"""

from __future__ import annotations

import csv
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine
from planner_core.certified.program.linear_program import Program, Rows

Choice = tuple[int, int]
"""A photograph and the way it is taken (a camera, or 13 for the stereo pair)."""

_HEURISTIC_EFFORT = 0.05
_LIMIT_S = 120.0
_RECORDER_UNIT = 451.0
_RECORDER_UNITS = 200  # the published results count in these, not in the file's unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Instance:
    """One file.

    Attributes
    ----------
    weight
        Worth of each photograph, by its number.
    choices
        The ways to take each photograph.
    forbidden
        Choices that cannot all be made, two or three at a time.
    fill, capacity
        How much of the recorder each choice fills, and its capacity, in the unit of the
        published results; None for a single orbit, which has no such limit.
    """

    weight: Mapping[int, int]
    choices: Mapping[int, tuple[int, ...]]
    forbidden: tuple[tuple[Choice, ...], ...]
    fill: Mapping[Choice, int]
    capacity: int | None


def read_instance(path: Path) -> Instance:
    """Return the instance of a ``.spot`` file.

    Raises
    ------
    ValueError
        If the file is not in the format.
    """
    lines = (line.split() for line in path.read_text(encoding="ascii").splitlines() if line.strip())
    weight: dict[int, int] = {}
    choices: dict[int, tuple[int, ...]] = {}
    fill: dict[Choice, int] = {}
    for _ in range(int(_next(lines, path)[0])):
        number, worth, num_values, *rest = _next(lines, path)
        i, values = int(number), rest[: 2 * int(num_values)]
        weight[i] = int(worth)
        choices[i] = tuple(int(value) for value in values[::2])
        for value, consumption in zip(choices[i], values[1::2], strict=True):
            fill[i, value] = round(float(consumption) / _RECORDER_UNIT)
    forbidden: list[tuple[Choice, ...]] = []
    capacity: int | None = None
    for _ in range(int(_next(lines, path)[0])):
        first, *numbers = map(int, _next(lines, path))
        if not numbers:
            capacity = _RECORDER_UNITS
            continue
        photographs, tuples = numbers[:first], numbers[first:]
        for at in range(0, len(tuples) - first + 1, first):
            forbidden.append(tuple(zip(photographs, tuples[at : at + first], strict=True)))
    return Instance(
        weight=weight,
        choices=choices,
        forbidden=tuple(forbidden),
        fill=fill,
        capacity=capacity,
    )


def _next(lines: Iterator[list[str]], path: Path) -> list[str]:
    found = next(lines, None)
    if found is None:
        raise ValueError(f"{path.name} ends too early")
    return found


def solve(instance: Instance, budget: Budget) -> tuple[frozenset[Choice], float]:
    """Return the best choices found and an upper bound."""
    choices = [(i, value) for i, values in instance.choices.items() for value in values]
    column = {choice: at for at, choice in enumerate(choices)}
    program = Program()
    program.add_columns(np.array([instance.weight[i] for i, _ in choices], dtype=np.float64))
    excludes = _exclusions(instance)
    cliques = [[column[c] for c in clique] for clique in _cliques(choices, excludes)]
    program.add_rows(Rows.at_most(cliques, [1.0] * len(cliques)))
    triples = [[column[c] for c in group] for group in _triples(instance)]
    program.add_rows(Rows.at_most(triples, [2.0] * len(triples)))
    if instance.capacity is not None:
        all_of_it = np.array([0, len(choices)], dtype=np.int64)
        filled = np.array([instance.fill[choice] for choice in choices], dtype=np.float64)
        everything = np.arange(len(choices))
        program.add_rows(Rows.of(all_of_it, everything, filled, upper=float(instance.capacity)))
    engine = Engine(program, budget, 0, is_chained=False)
    outcome = engine.search(None, 0.0, _HEURISTIC_EFFORT, lambda *_: None)
    taken: Iterable[int] = () if outcome.columns is None else np.flatnonzero(outcome.columns > 0.5)
    return frozenset(choices[at] for at in taken), outcome.bound


def worth_of(instance: Instance, taken: frozenset[Choice]) -> int:
    """Return the worth of choices, checked against the file's own rules.

    Raises
    ------
    ValueError
        If they break one.
    """
    photographs = [i for i, _ in taken]
    if len(set(photographs)) < len(photographs):
        raise ValueError("a photograph is taken twice")
    for together in instance.forbidden:
        if taken.issuperset(together):
            raise ValueError(f"{together} cannot be taken together")
    if instance.capacity is not None and sum(instance.fill[c] for c in taken) > instance.capacity:
        raise ValueError("the recorder does not hold them")
    return sum(instance.weight[i] for i in photographs)


def _exclusions(instance: Instance) -> Mapping[Choice, set[Choice]]:
    excludes: dict[Choice, set[Choice]] = defaultdict(set)
    for i, values in instance.choices.items():
        for value in values:
            excludes[i, value] |= {(i, other) for other in values if other != value}
    for together in instance.forbidden:
        if len(together) == 2:
            a, b = together
            excludes[a].add(b)
            excludes[b].add(a)
    return excludes


def _cliques(
    choices: Sequence[Choice], excludes: Mapping[Choice, set[Choice]]
) -> Iterator[list[Choice]]:
    """Yield sets of choices that exclude each other, until every exclusion is in one."""
    covered: set[frozenset[Choice]] = set()
    for a in choices:
        for b in sorted(excludes[a]):
            if frozenset((a, b)) in covered:
                continue
            clique = [a, b]
            common = excludes[a] & excludes[b]
            while common:
                most = max(sorted(common), key=lambda c: len(excludes[c] & common))
                clique.append(most)
                common &= excludes[most]
            covered |= {frozenset((x, y)) for x in clique for y in clique if x != y}
            yield clique


def _triples(instance: Instance) -> Iterator[list[Choice]]:
    """Yield sets of choices of which two can be made: third photographs' cameras share a row."""
    thirds: dict[tuple[Choice, Choice, int], list[Choice]] = defaultdict(list)
    for together in instance.forbidden:
        if len(together) == 3:
            a, b, c = together
            thirds[a, b, c[0]].append(c)
    for (a, b, _), last in thirds.items():
        yield [a, b, *last]


def main() -> None:
    """Print a line for each instance of the folder."""
    folder = Path(sys.argv[1])
    with (folder / "known_results.csv").open(encoding="utf-8") as lines:
        published = {row["instance"]: int(row["best_1999"]) for row in csv.DictReader(lines)}
    print(f"{'instance':>8} {'published':>9} {'found':>7} {'bound':>7} {'solve_s':>8}")
    for name, best in published.items():
        instance = read_instance(folder / f"{name}.spot")
        began_s = time.process_time()
        taken, bound = solve(instance, Budget(_LIMIT_S))
        took_s = time.process_time() - began_s
        found = worth_of(instance, taken)
        print(f"{name:>8} {best:9} {found:7} {bound:7.0f} {took_s:8.2f}", flush=True)


if __name__ == "__main__":
    main()
