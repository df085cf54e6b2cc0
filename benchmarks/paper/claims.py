"""The paper's statements, compared with the measurements."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from benchmarks.paper.readings import BASE
from benchmarks.paper.readings_table import joint, nearest, rankings
from benchmarks.paper.settings import Kind
from benchmarks.paper.study import Done, Study, best_forward, best_mcts
from benchmarks.paper.summary import Bar, bars, outcome_rows

Verdict = Literal["reproduces", "does not reproduce", "not measured"]
_NEAR: Final = 0.03  # of the paper's number


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A statement of the paper, and whether it holds here.

    Attributes
    ----------
    verdict
        Under the study's own reading.
    near
        Under the reading closest to the paper's number, or for a ranking of methods under the
        one closest to all four; None if no other reading was tried.
    """

    text: str
    verdict: Verdict
    evidence: str
    near: Verdict | None = None


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
        _with_readings(
            study,
            done,
            _order(
                f"Without resources {where}: forward search > MCTS (Tables 6 and 7)",
                {"forward search": forward, "MCTS": mcts},
            ),
            ("forward search", "MCTS"),
            res=False,
        ),
        _with_readings(
            study,
            done,
            _order(
                f"With resources {where}: MCTS > rule > forward search",
                {
                    "MCTS": _mean(with_, "mcts"),
                    "rule": _mean(with_, "rule"),
                    "forward search": _mean(with_, "forward_search"),
                },
            ),
            ("MCTS", "rule", "forward search"),
            res=True,
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
    """Return the mean number of images, counted as in the paper: regardless of violations."""
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


def _with_readings(
    study: Study, done: Done, claim: Claim, names: tuple[str, ...], *, res: bool
) -> Claim:
    """Add in how many readings a ranking of methods holds, and whether in the closest one."""
    ranked = rankings(study, done, names, res=res)
    near = joint(study, done)
    if near is None:
        return claim
    holds = {key: all(a > b for a, b in itertools.pairwise(v)) for key, v in ranked.items()}
    covering = (k for k in ranked if k[0].covers(near.reading, res=res) and k[1] == near.variant)
    key = next(covering, None)
    if key is None:
        return claim
    told = ", ".join(f"{name} {n}" for name, n in zip(names, ranked[key], strict=True))
    return replace(
        claim,
        near=_verdict(holds[key]),
        evidence=f"{claim.evidence}; holds in {sum(holds.values())} of {len(holds)} readings "
        f"(draw 0); in the nearest: {told}",
    )


def _level(study: Study, done: Done, *, is_mcts: bool, res: bool) -> Claim:
    """Judge a number of Tables 6 and 7; among many readings one comes close by chance."""
    near = nearest(study, done, is_mcts=is_mcts, res=res)
    name, table = ("MCTS", 7) if is_mcts else ("Forward search", 6)
    published = (best_mcts(res) if is_mcts else best_forward(res)).reward
    family = "with" if res else "without"
    text = f"{name} {family} resources takes {published:.0f} images (Table {table})"
    if near is None or near.own is None:
        return Claim(text=text, verdict="not measured", evidence="")
    own_error = near.own / published - 1.0
    evidence = (
        f"{near.own} ({own_error:+.0%}); nearest of {near.tried} readings: "
        f"{near.images} ({near.error:+.0%}), {near.told}"
    )
    is_near = _verdict(abs(near.error) <= _NEAR)
    return _claim(text, abs(own_error) <= _NEAR, evidence, is_near)


def _together(study: Study, done: Done) -> Claim:
    text = "All four of these under one reading"
    best, own = joint(study, done), joint(study, done, (BASE,))
    if best is None or own is None:
        return Claim(text=text, verdict="not measured", evidence="")
    evidence = f"{own.told}; nearest: {best.told} ({best.reading.name}, {best.variant})"
    return _claim(text, own.worst <= _NEAR, evidence, _verdict(best.worst <= _NEAR))


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


def _claim(text: str, holds: bool, evidence: str, near: Verdict | None = None) -> Claim:
    return Claim(text=text, verdict=_verdict(holds), evidence=evidence, near=near)


def _verdict(holds: bool) -> Verdict:
    return "reproduces" if holds else "does not reproduce"
