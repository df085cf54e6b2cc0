"""The calendar, read by another library."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta

import pytest
from ical.calendar_stream import IcsCalendarStream
from ical.event import Event

from service.answers.answered import Answered
from service.exports import calendar
from tests.missions import Document
from tests.service.answers import answered_of
from tests.service.exports.conftest import FINISHED_AT, Mission


def text_of(answered: Answered) -> str:
    return "".join(calendar.write(answered))


def events_of(answered: Answered) -> list[Event]:
    return IcsCalendarStream.calendar_from_ics(text_of(answered)).events


def span_of(event: Event) -> tuple[datetime, datetime]:
    assert isinstance(event.dtstart, datetime)
    assert isinstance(event.dtend, datetime)
    return event.dtstart, event.dtend


def contacts_of(answered: Answered) -> list[Document]:
    return [action for _, action in answered.each_action() if action["mode"] == "contact"]


def shifted(mission: Mission, shift_s: float, later_s: float = 60.0) -> Answered:
    """Return a later plan whose passes have moved."""
    timeline = mission.document
    for satellite in timeline["satellites"]:
        for action in satellite["actions"]:
            for name in ("start", "end"):
                at = datetime.fromisoformat(action[name]) + timedelta(seconds=shift_s)
                action[name] = at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
    finished_at = FINISHED_AT + timedelta(seconds=later_s)
    return answered_of(json.dumps(timeline), mission.targets, mission.content, finished_at)


def test_each_contact_is_an_event_that_covers_it(answered: Answered) -> None:
    events, contacts = events_of(answered), contacts_of(answered)
    assert len(events) == len(contacts) > 4
    for event, contact in zip(events, contacts, strict=True):
        start, end = (datetime.fromisoformat(contact[name]) for name in ("start", "end"))
        second = timedelta(seconds=1)
        shown_start, shown_end = span_of(event)
        assert start - second < shown_start <= start
        assert end <= shown_end < end + second
        assert (shown_start.tzinfo, shown_end.tzinfo) == (UTC, UTC)
        assert event.location == contact["station_id"]
        assert event.dtstamp == FINISHED_AT
        assert event.description is not None
        assert contact["id"] in event.description
    names = {event.summary for event in events}
    assert names & {"=EYE, 1 over Svalbard", 'EYE "2" over Suva'}


def test_each_event_has_an_alarm_before_it(answered: Answered) -> None:
    for event in events_of(answered):
        (alarm,) = event.alarm
        assert (alarm.action, alarm.trigger) == ("DISPLAY", -calendar.ALARM)


def test_lines_are_as_long_as_the_standard_allows(answered: Answered) -> None:
    text = text_of(answered)
    lines = text.encode().split(b"\r\n")
    assert lines[-1] == b""
    assert max(map(len, lines)) <= 75
    assert b"\n" not in b"".join(lines)


@pytest.mark.parametrize("shift_s", [0.0, 3.0, -3.0])
def test_a_replanned_contact_keeps_its_uid_and_counts_as_newer(
    mission: Mission, answered: Answered, shift_s: float
) -> None:
    before, after = events_of(answered), events_of(shifted(mission, shift_s))
    assert [e.uid for e in before] == [e.uid for e in after]
    assert len({e.uid for e in before}) == len(before)
    for old, new in zip(before, after, strict=True):
        assert old.sequence is not None
        assert new.sequence is not None
        assert new.sequence > old.sequence
        assert span_of(new)[0] - span_of(old)[0] == timedelta(seconds=shift_s)


def test_the_next_pass_is_another_contact(mission: Mission, answered: Answered) -> None:
    orbit_s = 5668.0
    before, after = events_of(answered), events_of(shifted(mission, orbit_s))
    for this, following in zip(before, after, strict=True):
        assert this.uid != following.uid


def test_parts_of_one_pass_are_events_of_their_own(mission: Mission) -> None:
    timeline = mission.document
    (first, *_) = [a for a in timeline["satellites"][0]["actions"] if a["mode"] == "contact"]
    timeline["satellites"][0]["actions"].append(first | {"id": "a9999"})
    answered = answered_of(json.dumps(timeline), mission.targets, mission.content, FINISHED_AT)
    uids = [event.uid for event in events_of(answered)]
    assert len(set(uids)) == len(uids)


def test_a_plan_without_contacts_is_an_empty_calendar(mission: Mission) -> None:
    assert events_of(mission.with_timeline(satellites=[])) == []
