"""The part of a replan that a change can affect: its answers equal those of the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import event, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Agility, Stability
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import COLLECT, Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted
from planner_core.replanning.nearby import nearby
from planner_core.replanning.question import Lost, News, Question
from planner_core.replanning.replan import solve_replan
from planner_core.replanning.undo import value
from planner_core.solvers.registry import Certified, Rule
from tests.examples import examples
from tests.planner_core.problems import Task, make_problem

SEEDS = st.integers(0, 10**6)
NUM_TARGETS = 30
HORIZON_S = 12_000.0
URGENT = 500.0  # more than all others together


def problem_at_random(rng: np.random.Generator, num_new: int) -> Problem:
    """Return hours of two satellites without batteries; the first targets are new and urgent."""
    tasks = []
    for target in range(NUM_TARGETS):
        for _ in range(rng.integers(1, 4)):
            start_s = float(np.round(rng.uniform(0.0, HORIZON_S - 30.0), 3))
            tasks.append(
                Task(
                    kind=COLLECT, site=target, start_s=start_s, end_s=start_s + 30.0,
                    satellite=int(rng.integers(2)), angle_deg=float(rng.uniform(-60.0, 60.0)),
                )
            )  # fmt: skip
    return make_problem(
        tasks, num_targets=NUM_TARGETS, num_satellites=2, horizon_s=HORIZON_S, use_resources=False,
        agility=Agility(slew_rate_deg_s=float(rng.uniform(0.3, 1.0)), settle_s=15.0),
        rewards=[URGENT] * num_new + rng.integers(1, 4, NUM_TARGETS - num_new).tolist(),
    )  # fmt: skip


def question_at_random(seed: int, num_new: int) -> Question:
    """Return a replan with urgent targets after a plan of the others, parts of which are lost."""
    rng = np.random.default_rng(seed)
    whole = problem_at_random(rng, num_new)
    table = whole.opportunities
    known = np.flatnonzero(table.site >= num_new).astype(np.int32)
    plan = Rule().solve(restricted(whole, known), Budget(), 0).plan
    base = np.sort(known[[action.opportunity for action in plan.actions]])
    frozen_until_s = float(rng.uniform(0.0, HORIZON_S / 3.0))
    is_frozen = table.start_s[base] < frozen_until_s
    kept = tuple(
        Kept(row=int(row), pointer=f"/replan/base/{i}") for i, row in enumerate(base[is_frozen])
    )
    gone = rng.permutation(base[~is_frozen])[: rng.integers(3)]
    problem = apply_pins(
        whole,
        Pinned(
            kept=kept, skipped={int(row): "/pins/skip/0" for row in gone},
            frozen_until_s=frozen_until_s,
        ),
    )  # fmt: skip
    assert problem.origin is not None
    still = np.flatnonzero(np.isin(problem.origin, base)).astype(np.int32)
    imaged = problem.opportunities.site[still]
    return Question(
        problem=problem, base=still, num_base=int((~is_frozen).sum()),
        promised=tuple(rng.permutation(imaged)[: rng.integers(4)].tolist()),
        stability=Stability(weight=float(rng.choice([0.0, 0.03, 0.5]))),
        news=News(
            targets=frozenset(range(num_new)),
            lost=tuple(
                Lost(satellite=int(table.satellite[row]), start_s=float(table.start_s[row]),
                     target=int(table.site[row]))
                for row in gone
            ),
        ),
    )  # fmt: skip


@examples(300)
@given(seed=SEEDS, num_new=st.integers(0, 2))
def test_an_answer_to_the_part_is_worth_in_the_whole_what_it_is_worth_there(
    seed: int, num_new: int
) -> None:
    question = question_at_random(seed, num_new)
    start = Plan.of(question.problem, question.base.tolist()).with_kept(question.problem)
    part = nearby(question, start)
    if part is None:
        event("no part")
        return
    own = part.of(start)
    assert part.put_into(start, own) == start
    problem = part.question.problem
    found = Rule().solve(problem, Budget(), 0).plan
    new = part.put_into(start, found)
    assert question.may_fly(new)
    assert np.isclose(
        value(question, new) - value(question, start),
        value(part.question, found) - value(part.question, own),
    )
    assert question.changed(new) - question.changed(start) == part.question.changed(
        found
    ) - part.question.changed(own)
    assert question.missing(new) == part.question.missing(found)


@examples(300)
@given(seed=SEEDS, num_new=st.integers(0, 2))
def test_what_is_urgent_is_imaged_and_what_is_far_from_it_stays(seed: int, num_new: int) -> None:
    question = question_at_random(seed, num_new)
    problem, table = question.problem, question.problem.opportunities
    start = Plan.of(problem, question.base.tolist()).with_kept(problem)
    part = nearby(question, start)
    plan = solve_replan(question, Certified(gap=1.0), Budget(), 0).plan
    assert question.may_fly(plan)
    assert not question.missing(plan)
    taken = {action.opportunity for action in plan.actions}
    assert set(problem.kept_rows.tolist()) <= taken
    urgent = {row for target in range(num_new) for row in problem.collects_of(target).tolist()}
    # Each is worth more than all that could be dropped for it, promised targets aside.
    assert taken & urgent or not urgent or question.promised
    if part is not None:
        changed = taken ^ {action.opportunity for action in start.actions}
        assert changed <= set(part.rows.tolist())
        event(f"rows of the part: {10 * len(part.rows) // len(table)} tenths")


def test_there_is_no_part_where_nothing_is_known_or_all_is_near() -> None:
    question = question_at_random(1, 1)
    start = Plan.of(question.problem, question.base.tolist()).with_kept(question.problem)
    assert nearby(question, start) is not None
    assert nearby(replace(question, news=None), start) is None
    everything = News(targets=frozenset(range(NUM_TARGETS)))
    assert nearby(replace(question, news=everything), start) is None
    drained = replace(question, problem=replace(question.problem, use_resources=True))
    assert nearby(drained, start) is None
