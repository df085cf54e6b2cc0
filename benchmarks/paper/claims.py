"""What the paper says, held against what was measured."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from benchmarks.paper.readings import BASE
from benchmarks.paper.readings_table import joint, nearest
from benchmarks.paper.settings import Kind
from benchmarks.paper.study import Done, Study, best_forward, best_mcts
from benchmarks.paper.summary import Bar, bars, outcome_rows

Verdict = Literal["reproduces", "does not reproduce", "not measured"]
_NEAR: Final = 0.03  # of the paper's number


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A statement of the paper, and whether it holds here."""

    text: str
    verdict: Verdict
    evidence: str


def claims(study: Study, done: Done) -> list[Claim]:
    """Return every statement that was checked."""
    size = study.grid_targets
    without = bars(study, done, size, res=False)
    with_ = bars(study, done, size, res=True)
    small = bars(study, done, min(study.targets), res=True)
    found = [
        _level(study, done, is_mcts=is_mcts, res=res)
        for res in (False, True)
        for is_mcts in (False, True)
    ]
    found.append(_together(study, done))
    found += [
        _breadth(study, done, solver, res=res)
        for res in (False, True)
        for solver in ("forward_search", "mcts")
    ]
    rule, forward, mcts = (_mean(without, name) for name in ("rule", "forward_search", "mcts"))
    milp, graph = _mean(without, "milp"), _mean(without, "graph", "ours")
    draws = max((bar.draws for bar in (*without, *with_)), default=0)
    where = f"at {size} targets (mean of {draws} draw{'' if draws == 1 else 's'})"
    found += [
        _order(
            f"Without resources {where}: MILP > graph > forward search > rule "
            "(graph with request history; MILP starts from its plan, so is never below it)",
            {"MILP": milp, "graph": graph, "forward search": forward, "rule": rule},
        ),
        _order(
            f"Without resources {where}: graph as listed (Algorithm 3) > forward search",
            {"graph as listed": _mean(without, "graph"), "forward search": forward},
        ),
        _order(
            f"Without resources {where}: forward search > MCTS (Tables 6 and 7)",
            {"forward search": forward, "MCTS": mcts},
        ),
        _order(
            f"With resources {where}: MCTS > rule > forward search",
            {
                "MCTS": _mean(with_, "mcts"),
                "rule": _mean(with_, "rule"),
                "forward search": _mean(with_, "forward_search"),
            },
        ),
        _order(
            f"With resources at {min(study.targets)} targets: forward search > rule",
            {"forward search": _mean(small, "forward_search"), "rule": _mean(small, "rule")},
        ),
        _order(
            f"Without resources {where}, reward per second: rule > forward search > MCTS",
            {
                "rule": _per_s(without, "rule"),
                "forward search": _per_s(without, "forward_search"),
                "MCTS": _per_s(without, "mcts"),
            },
        ),
        _order(
            f"Without resources {where}, runtime in CPU seconds: MCTS and MILP > forward search",
            {
                "the quicker of MCTS and MILP": _quicker_of_both(without),
                "forward search": _seconds(without, "forward_search"),
            },
        ),
    ]
    return found


def _find(among: Sequence[Bar], name: str, kind: Kind) -> Bar | None:
    return next((bar for bar in among if bar.solver == name and bar.kind == kind), None)


def _mean(among: Sequence[Bar], name: str, kind: Kind = "paper") -> float | None:
    """Return the mean number of images, as the paper counts them: whatever is broken."""
    bar = _find(among, name, kind)
    return bar.images if bar else None


def _per_s(among: Sequence[Bar], name: str) -> float | None:
    bar = _find(among, name, "paper")
    return bar.reward_per_s if bar else None


def _seconds(among: Sequence[Bar], name: str) -> float | None:
    bar = _find(among, name, "paper")
    return bar.seconds if bar else None


def _quicker_of_both(among: Sequence[Bar]) -> float | None:
    mcts, milp = _seconds(among, "mcts"), _seconds(among, "milp")
    return None if mcts is None or milp is None else min(mcts, milp)


def _order(text: str, values: dict[str, float | None]) -> Claim:
    known = {name: value for name, value in values.items() if value is not None}
    evidence = ", ".join(f"{name} {value:.4g}" for name, value in known.items())
    if len(known) < len(values):
        absent = ", ".join(name for name in values if name not in known)
        return Claim(text=text, verdict="not measured", evidence=f"no run of {absent}; {evidence}")
    ranked = list(known.values())
    return _claim(text, all(a > b for a, b in itertools.pairwise(ranked)), evidence)


def _level(study: Study, done: Done, *, is_mcts: bool, res: bool) -> Claim:
    """Judge by the study's own reading: among many readings one comes near by chance."""
    name, table = ("MCTS", 7) if is_mcts else ("Forward search", 6)
    row = best_mcts(res) if is_mcts else best_forward(res)
    family = "with" if res else "without"
    text = f"{name} {family} resources takes {row.reward:.0f} images (Table {table})"
    near = nearest(study, done, is_mcts=is_mcts, res=res)
    own = done.get(study.reading_task(row, BASE))
    if near is None or own is None:
        return Claim(text=text, verdict="not measured", evidence="")
    variant = near.method.removeprefix("MCTS")
    evidence = (
        f"{own.images} ({own.images / row.reward - 1.0:+.0%}); nearest of {near.tried} readings: "
        f"{near.images} ({near.error:+.0%}), {near.reading.name}{variant if is_mcts else ''}"
    )
    return _claim(text, abs(own.images / row.reward - 1.0) <= _NEAR, evidence)


def _together(study: Study, done: Done) -> Claim:
    text = "All four of these under one reading"
    best = joint(study, done)
    if best is None:
        return Claim(text=text, verdict="not measured", evidence="")
    pairs = zip(best.images, best.published, strict=True)
    told = ", ".join(f"{images} for {published:.0f}" for images, published in pairs)
    evidence = f"nearest: {told} ({best.reading.name}, {best.variant})"
    return _claim(text, best.worst <= _NEAR, evidence)


def _breadth(study: Study, done: Done, solver: str, *, res: bool) -> Claim:
    name = "MCTS" if solver == "mcts" else "forward search"
    text = f"Best reward of {name} {'with' if res else 'without'} resources falls as N_a grows"
    rows = [row for row in outcome_rows(study, done, solver) if row.published.use_resources == res]
    rewards = [row.best.images for row in rows if row.best is not None]
    evidence = ", ".join(
        f"{row.best.images:.0f} at N_a = {row.published.breadth}" for row in rows if row.best
    )
    if len(rewards) < len(rows):
        return Claim(text=text, verdict="not measured", evidence=evidence)
    return _claim(text, all(a > b for a, b in itertools.pairwise(rewards)), evidence)


def _claim(text: str, holds: bool, evidence: str) -> Claim:
    verdict: Verdict = "reproduces" if holds else "does not reproduce"
    return Claim(text=text, verdict=verdict, evidence=evidence)
