"""Differences of plans: empty for equal plans; sums match the listed changes."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from planner_core.referee.plan_diff import PlannedAction, PlanView, plan_diff
from planner_core.referee.timeline import Mode
from tests.examples import examples

START = datetime(2026, 3, 1, tzinfo=UTC)


def action(site: str, at_s: float, satellite: str = "s", mode: Mode = "collect") -> PlannedAction:
    start = START + timedelta(seconds=at_s)
    return PlannedAction(
        start=start, end=start + timedelta(seconds=30), satellite_id=satellite, mode=mode,
        site_id=site,
    )  # fmt: skip


def view(*actions: PlannedAction, **totals: float | None) -> PlanView:
    return PlanView(actions=tuple(sorted(actions)), totals=totals)


ACTIONS = st.lists(
    st.builds(
        action,
        st.sampled_from("abc"),
        st.integers(0, 5).map(lambda n: 100.0 * n),
        st.sampled_from(["s", "t"]),
        st.sampled_from(["collect", "contact"]),
    ),
    max_size=7,
    unique=True,
)


@examples(300)
@given(first=ACTIONS, second=ACTIONS)
def test_a_difference_applied_to_the_first_plan_gives_the_second(
    first: list[PlannedAction], second: list[PlannedAction]
) -> None:
    diff = plan_diff(view(*first, reward=1.0), view(*second, reward=3.5))
    left = set(first) - set(diff.removed) - {before for before, _ in diff.moved}
    assert left | set(diff.added) | {after for _, after in diff.moved} == set(second)
    assert left == set(first) & set(second)
    assert {a.site_id for a in diff.added if a.mode == "collect"}.isdisjoint(
        a.site_id for a in diff.removed if a.mode == "collect"
    )
    assert diff.totals == {"reward": 2.5}
    assert not diff.is_empty
    assert plan_diff(view(*first, reward=1.0), view(*first, reward=1.0)).is_empty


def test_a_target_imaged_at_another_time_has_moved_to_the_nearest_one() -> None:
    before = view(action("a", 0), action("b", 100), action("g", 200, mode="contact"))
    after = view(action("a", 300, "t"), action("c", 100), action("g", 200, "t", mode="contact"))
    diff = plan_diff(before, after)
    assert diff.moved == ((action("a", 0), action("a", 300, "t")),)
    # A contact of another satellite is a different contact.
    assert diff.removed == (action("b", 100), action("g", 200, mode="contact"))
    assert diff.added == (action("c", 100), action("g", 200, "t", mode="contact"))


def test_rounding_to_the_millisecond_moves_nothing() -> None:
    assert plan_diff(view(action("a", 0.0)), view(action("a", 0.001))).is_empty
    assert plan_diff(view(action("a", 0.0)), view(action("a", 0.002))).moved


def test_unknown_totals_differ_without_a_number() -> None:
    assert plan_diff(view(margin=None), view(margin=0.5)).totals == {"margin": None}
    assert plan_diff(view(margin=None), view(margin=None)).is_empty
