"""A published day's plan, changed by events and replanned, on a whole service."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from service.client import Client, JobFailed, Plan, PlanAction, ServiceError
from service.commands.cli import main
from service.commands.outcome import OK, WRONG_INPUT
from service.wire.instants import instant_text
from tests.missions import drawn_targets, paper_mission

Task = tuple[str, str, str | None, str | None, datetime]


@pytest.fixture(scope="module")
def base(served: str) -> Plan:
    """A published plan of a day."""
    with Client(served) as client:
        job = client.jobs.submit(paper_mission(drawn_targets(120)), "certified", time_s=20).wait()
        plan = client.plans.create(job.id, name="Monday")
        client.plans.approve(plan.id)
        return client.plans.publish(plan.id, effective_from=plan.horizon.start)


def tasks(client: Client, plan: Plan) -> dict[Task, PlanAction]:
    return {
        (a.satellite_id, a.mode, a.target_id, a.station_id, a.start): a
        for a in client.plans.actions(plan.id)
    }


def scenario_of(client: Client, plan: Plan) -> dict[str, Any]:
    content: dict[str, Any] = client.scenarios.file(client.jobs.get(plan.job_id).scenario.id)
    return content


def noon(plan: Plan) -> datetime:
    middle: datetime = plan.horizon.start + (plan.horizon.end - plan.horizon.start) / 3
    return middle


def replanned(client: Client, plan: Plan, **happened: Any) -> Plan:
    job = client.plans.replan(plan.id, now=noon(plan), limits={"time_s": 20}, **happened).wait(120)
    assert job.links["replan_of"] == f"/v1/plans/{plan.id}"
    draft = client.plans.draft_of(job)
    assert (draft.state, draft.parent_id, draft.job_id) == ("draft", plan.id, job.id)
    return draft


def test_a_replan_to_which_nothing_happened_is_the_plan(whole: Client, base: Plan) -> None:
    draft = replanned(whole, base)
    assert tasks(whole, draft).keys() == tasks(whole, base).keys()
    changes = whole.plans.changes(draft.id)
    assert (changes.changed_share, changes.forced_share, changes.items) == (0.0, 0.0, ())


def test_passes_hold_the_contacts(whole: Client, base: Plan) -> None:
    contacts = {a.id: a for a in whole.plans.actions(base.id) if a.mode == "contact"}
    passes = list(whole.plans.passes(base.id))
    assert {own_id for one in passes for own_id in one.action_ids} == contacts.keys()
    station_id = passes[0].station_id
    narrowed = whole.plans.passes(
        base.id, station_id=station_id, planned=True, from_=noon(base), to=base.horizon.end
    )
    wanted = [
        one
        for one in passes
        if one.station_id == station_id and one.planned and one.los > noon(base)
    ]
    assert list(narrowed) == wanted


def test_a_lost_station_and_an_urgent_request(whole: Client, base: Plan) -> None:
    before = tasks(whole, base)
    later = [a for a in before.values() if a.start >= noon(base)]
    contact = next(a for a in later if a.mode == "contact")
    promised = [a.target_id for a in later if a.mode == "collect"][:3]
    outage = {
        "station_id": contact.station_id,
        "start": instant_text(contact.start - timedelta(minutes=5)),
        "end": instant_text(contact.end + timedelta(minutes=5)),
        "reason": "antenna in service",
    }
    urgent = {"id": "urgent", "lat_deg": 20.0, "lon_deg": 10.0, "reward": 40.0}
    draft = replanned(
        whole, base, outages=[outage], add_targets=[urgent], name="Monday, second",
        promises=[{"target_id": target_id} for target_id in promised],
    )  # fmt: skip
    assert draft.name == "Monday, second"
    after = tasks(whole, draft)
    frozen = {key: a for key, a in before.items() if a.start < noon(base)}
    assert {key: a.end for key, a in after.items() if a.start < noon(base)} == {
        key: a.end for key, a in frozen.items()
    }
    assert set(promised) <= {a.target_id for a in after.values()}
    changes = whole.plans.changes(draft.id)
    kept = before.keys() & after.keys()
    moved_or_removed = [item for item in changes.items if item.parent_action is not None]
    assert len(moved_or_removed) == len(before) - len(kept)
    assert changes.changed_share == pytest.approx(len(moved_or_removed) / len(later))
    assert 0.0 < changes.forced_share <= changes.changed_share < 0.2
    lost = [item.parent_action for item in changes.items if item.cause == "lost"]
    assert contact in lost
    for item in changes.items:
        assert (item.cause == "displaced_by") == bool(item.because_of)
    # It may be published in place of its parent, and then be replanned itself.
    whole.plans.approve(draft.id)
    whole.plans.publish(draft.id, effective_from=noon(base))
    again = replanned(whole, draft)
    assert tasks(whole, again).keys() == after.keys()


def test_what_failed_is_open_again(whole: Client, base: Plan) -> None:
    flown = [a for a in whole.plans.actions(base.id) if a.start < noon(base)]
    failed = next(a for a in flown if a.mode == "collect")
    draft = replanned(whole, base, executions=[{"action_id": failed.id, "outcome": "failed"}])
    after = tasks(whole, draft)
    assert failed.id in {e.action_id for e in whole.plans.executions(base.id)}
    before_noon = {a.target_id for a in after.values() if a.start < noon(base)}
    assert failed.target_id not in before_noon
    whole.plans.report(base.id, [{"action_id": failed.id, "outcome": "executed"}])


def test_a_promise_that_cannot_be_kept_fails_with_its_reason(whole: Client, base: Plan) -> None:
    later = [a for a in whole.plans.actions(base.id) if a.start >= noon(base)]
    promised = next(a for a in later if a.mode == "collect")
    end = instant_text(base.horizon.end)
    job = whole.plans.replan(
        base.id, now=noon(base), promises=[{"target_id": promised.target_id}],
        outages=[{"satellite_id": promised.satellite_id, "start": instant_text(noon(base)),
                  "end": end, "modes": ["collect"]}],
    )  # fmt: skip
    with pytest.raises(JobFailed) as caught:
        job.wait(120)
    error = caught.value.job.error
    assert error is not None
    assert error.code == "promise_not_kept"
    with pytest.raises(ServiceError) as missing:
        whole.plans.draft_of(job)
    assert missing.value.code == "not_found"


def test_what_cannot_be_asked_is_refused_with_its_place(whole: Client, base: Plan) -> None:
    flown = [a for a in whole.plans.actions(base.id) if a.start < noon(base)]
    imaged = next(a for a in flown if a.mode == "collect")
    with pytest.raises(ServiceError) as caught:
        whole.plans.replan(
            base.id, now=noon(base), promises=[{"target_id": "nowhere"}],
            drop_targets=["nowhere", imaged.target_id],
            add_targets=[{"id": imaged.target_id, "lat_deg": 0.0, "lon_deg": 0.0}],
        )  # fmt: skip
    assert {fault.pointer for fault in caught.value.errors} == {
        "/promises/0/target_id", "/drop_targets/0", "/drop_targets/1", "/add_targets/0/id",
    }  # fmt: skip
    with pytest.raises(ServiceError):
        whole.plans.replan(base.id, now=base.horizon.end)
    none = whole.plans.changes(base.id)
    assert (none.parent_id, none.items) == (None, ())


def test_names_stand_beside_ids(whole: Client, base: Plan) -> None:
    content = scenario_of(whole, base)
    satellites = {each["id"]: each["name"] for each in content["satellites"]}
    stations = {each["id"]: each["name"] for each in content["ground_stations"]}
    modes = set()
    for action in whole.plans.actions(base.id):
        modes.add(action.mode)
        assert action.satellite_name == satellites[action.satellite_id]
        assert action.station_name == stations.get(action.station_id or "")
    assert modes == {"collect", "contact"}


def test_what_images_earn_may_change_from_now_on(whole: Client, base: Plan) -> None:
    asked = {"collected_share": 0.25, "half_life_s": 6 * 3600.0}
    draft = replanned(whole, base, objective=asked)
    objective = scenario_of(whole, draft)["objective"]
    assert {name: objective[name] for name in asked} == asked
    with pytest.raises(ServiceError) as caught:
        whole.plans.replan(base.id, now=noon(base), objective={"collected_share": 2.0})
    assert [fault.pointer for fault in caught.value.errors] == ["/objective/collected_share"]


def test_a_shell_replans_and_sees_what_changes(
    served: str, whole: Client, base: Plan, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    contact = next(
        a for a in whole.plans.actions(base.id) if a.mode == "contact" and a.start >= noon(base)
    )
    start, end = instant_text(contact.start), instant_text(contact.end)
    happened = tmp_path / "happened.json"
    happened.write_text(
        json.dumps({"outages": [{"station_id": contact.station_id, "start": start, "end": end}]})
    )
    out = tmp_path / "next.json"
    arguments = ["replan", base.id, str(happened), "--url", served, "--now"]
    now = instant_text(noon(base))
    said = [*arguments, now, "--name", "by hand", "--time-s", "20", "--out", str(out)]
    assert main(said) == OK
    printed = capsys.readouterr().out
    assert "removed" in printed
    assert "lost" in printed
    assert contact.station_name is not None
    assert contact.station_name in printed
    draft = next(plan for plan in whole.plans.list(parent_id=base.id) if plan.id in printed)
    assert draft.name == "by hand"
    assert json.loads(out.read_text())["plan_sha256"] == draft.plan_sha256

    assert main([*arguments, "noon"]) == WRONG_INPUT
    assert "--now" in capsys.readouterr().err
    happened.write_text(json.dumps({"outages": [{"station_id": contact.station_id}]}))
    assert main([*arguments, now]) == WRONG_INPUT
    assert f"{happened} /outages/0/" in capsys.readouterr().err


def test_a_shell_is_told_that_nothing_changes(
    served: str, base: Plan, capsys: pytest.CaptureFixture[str]
) -> None:
    now = instant_text(noon(base))
    assert main(["replan", base.id, "--url", served, "--now", now, "--time-s", "20"]) == OK
    assert "Nothing changes." in capsys.readouterr().out


def test_pins_and_rewards_hold_in_the_new_plan(whole: Client, base: Plan) -> None:
    later = [a for a in whole.plans.actions(base.id) if a.start > noon(base)]
    kept, skipped = [a for a in later if a.mode == "collect"][:2]
    contact = next(a for a in later if a.mode == "contact")
    draft = replanned(
        whole, base, keep=[pin(kept), pin(contact)], skip=[pin(skipped)],
        rewards={kept.target_id: 7.5},
    )  # fmt: skip
    held = {place(a) for a in whole.plans.actions(draft.id)}
    assert {place(kept), place(contact)} <= held
    assert place(skipped) not in held
    content = scenario_of(whole, draft)
    rewards = {each["id"]: each["reward"] for each in content["targets"]}
    assert rewards[kept.target_id] == 7.5
    assert len(content["pins"]["keep"]) == 2

    # An earlier pin is released if the next replan says so.
    again = replanned(whole, draft, skip=[pin(kept)], keep=[pin(skipped)])
    held = {place(a) for a in whole.plans.actions(again.id)}
    assert {place(skipped), place(contact)} <= held
    assert place(kept) not in held


def test_pins_and_rewards_that_cannot_be_are_refused_with_their_place(
    whole: Client, base: Plan
) -> None:
    with pytest.raises(ServiceError) as caught:
        whole.plans.replan(base.id, now=noon(base), rewards={"no/where": 2.0})
    assert [fault.pointer for fault in caught.value.errors] == ["/rewards/no~1where"]
    with pytest.raises(ServiceError) as unseen:
        whole.plans.replan(base.id, now=noon(base), keep=[{"station_id": "nowhere"}])
    assert [fault.pointer for fault in unseen.value.errors] == ["/keep/0/station_id"]


def pin(action: PlanAction) -> dict[str, Any]:
    where = {name: getattr(action, name) for name in ("satellite_id", "target_id", "station_id")}
    return where | {"start": instant_text(action.start), "end": instant_text(action.end)}


def place(action: PlanAction) -> tuple[Any, ...]:
    return (action.satellite_id, action.target_id, action.station_id, action.start)


def _told(client: Client, plan: Plan, at: datetime) -> dict[str, Any]:
    """Return the telemetry at an instant if everything went as planned."""
    timeline = client.jobs.timeline(plan.job_id)
    curve = timeline.satellites[0].resources
    assert curve is not None
    known = [one for one in curve.time if one <= at]
    return {
        "satellite_id": timeline.satellites[0].id,
        "at": at,
        "battery_fraction": curve.battery_fraction[len(known) - 1],
        "recorder_fraction": curve.recorder_fraction[len(known) - 1],
    }


@pytest.fixture
def flown(whole: Client) -> Plan:
    """A separate published plan, to which reports may be added."""
    job = whole.jobs.submit(paper_mission(drawn_targets(60)), "certified", time_s=20).wait()
    plan = whole.plans.create(job.id, name="Flown")
    whole.plans.approve(plan.id)
    return whole.plans.publish(plan.id, effective_from=plan.horizon.start)


def test_a_replan_goes_on_from_telemetry(whole: Client, flown: Plan) -> None:
    """Actions before the freeze stay identical; imaged targets are not imaged again."""
    actions = sorted(whole.plans.actions(flown.id), key=lambda a: a.start)
    now = noon(flown)
    freeze = now + timedelta(hours=1)
    last = max((a for a in actions if a.end < now), key=lambda a: a.end)
    state = _told(whole, flown, last.end)
    (sent,) = whole.plans.add_states(flown.id, [state])
    assert sent.battery_fraction == state["battery_fraction"]
    assert [one.id for one in whole.plans.states(flown.id)] == [sent.id]
    draft = replanned(whole, flown, freeze_until=freeze)
    assert draft.horizon.start == now
    file = scenario_of(whole, draft)
    assert [one["at"] for one in file["states"]] == [instant_text(last.end)]
    before = {a: key for key, a in tasks(whole, flown).items()}
    frozen = {
        (*key[:4], max(a.start, now)): a.end
        for a, key in before.items()
        if a.end > now and a.start < freeze
    }
    kept = {key: a.end for key, a in tasks(whole, draft).items() if a.start < freeze}
    assert kept == frozen
    imaged = {a.target_id for a in actions if a.start < now and a.target_id is not None}
    again = {a.target_id for a in whole.plans.actions(draft.id) if a.start >= freeze}
    assert not again & imaged
    timeline = whole.jobs.timeline(draft.job_id)
    on_board = {one.target_id for one in timeline.satellites[0].on_board}
    assert on_board == imaged
    assert timeline.totals.bound is not None
    assert timeline.totals.reward <= timeline.totals.bound + 1e-6
    # Another replan continues from that draft, with what was flown since the same telemetry.
    whole.plans.approve(draft.id)
    whole.plans.publish(draft.id, effective_from=now)
    later = freeze + timedelta(hours=2)
    job = whole.plans.replan(
        draft.id,
        now=later,
        states=[_told(whole, draft, later) | {"at": instant_text(later)}],
        limits={"time_s": 20},
    ).wait(120)
    third = whole.plans.draft_of(job)
    assert third.horizon.start == later
    known = {one.target_id for one in whole.jobs.timeline(third.job_id).satellites[0].on_board}
    done = {a.target_id for a in whole.plans.actions(draft.id) if a.end <= later and a.target_id}
    assert known == imaged | done


def test_a_failed_image_is_open_again_and_its_energy_gone(whole: Client, flown: Plan) -> None:
    now = noon(flown)
    images = [a for a in whole.plans.actions(flown.id) if a.mode == "collect" and a.end < now]
    table = f"action_id,outcome,detail\n{images[-1].id},failed,Wheel 3 saturated\n"
    (report,) = whole.plans.report_csv(flown.id, table.encode())
    assert (report.outcome, report.detail) == ("failed", "Wheel 3 saturated")
    draft = replanned(whole, flown)
    assert draft.horizon.start == now
    told = {one["start"]: one for one in scenario_of(whole, draft)["replan"]["flown"]}
    assert told[instant_text(images[-1].start)]["outcome"] == "failed"
    on_board = {one.target_id for one in whole.jobs.timeline(draft.job_id).satellites[0].on_board}
    assert on_board == {a.target_id for a in images[:-1]}


def test_telemetry_comes_as_a_table(whole: Client, flown: Plan) -> None:
    own_id = flown.satellites[0].satellite_id
    at = instant_text(noon(flown))
    table = (
        "satellite_id,at,battery_fraction,recorder_fraction,los_x,los_y,los_z,sun\n"
        f"{own_id},{at},0.8,0.25,0,0.6,0.8,\n{own_id},{at},0.7,,,,,true\n"
    )
    first, second = whole.plans.add_states_csv(flown.id, table.encode())
    assert first.attitude is not None
    assert first.attitude.line_of_sight == [0.0, 0.6, 0.8]
    assert second.attitude is not None
    assert (second.attitude.sun, second.recorder_fraction) == (True, None)
    for bad, row, word in (
        (f"satellite_id,at,battery_fraction\n{own_id},{at},1.5\n", 2, "battery_fraction"),
        (f"satellite_id,at\n{own_id},yesterday\n", 2, "at"),
    ):
        with pytest.raises(ServiceError) as caught:
            whole.plans.add_states_csv(flown.id, bad.encode())
        (fault,) = caught.value.errors
        assert fault.row == row
        assert word in fault.detail


def test_telemetry_that_cannot_be_is_refused_with_its_place(whole: Client, flown: Plan) -> None:
    own_id, at = flown.satellites[0].satellite_id, instant_text(noon(flown))
    fine = {"satellite_id": own_id, "at": at}
    image = {"target_id": "none", "collected_at": at, "recorder_fraction": 0.1}
    for state, code, pointer in (
        (fine | {"satellite_id": "none"}, "unknown_satellite", "/0/satellite_id"),
        (fine | {"on_board": [image]}, "unknown_target", "/0/on_board/0/target_id"),
        (fine | {"attitude": {"target_id": "none"}}, "unknown_target", "/0/attitude/target_id"),
        (fine | {"battery": 0.5}, "unknown_field", "/0/battery"),
    ):
        with pytest.raises(ServiceError) as caught:
            whole.plans.add_states(flown.id, [state])
        (fault,) = caught.value.errors
        assert (fault.code, fault.pointer) == (code, pointer)
    with pytest.raises(ServiceError) as caught:
        whole.plans.replan(
            flown.id,
            now=noon(flown),
            states=[fine | {"at": instant_text(noon(flown) + timedelta(seconds=1))}],
        )
    assert caught.value.errors[0].pointer == "/states/0/at"


def test_newest_elements_keep_what_is_frozen_at_its_instants(whole: Client, flown: Plan) -> None:
    """For satellites that are no longer stored nothing newer is known: they stay as they are."""
    draft = replanned(whole, flown, elements="newest", freeze_until=noon(flown))
    assert scenario_of(whole, draft)["replan"]["elements"] == "newest"
    assert tasks(whole, draft).keys() == tasks(whole, flown).keys()
