"""When entries of the schedule are due: dates, cron in a time zone, deadlines, misses."""

from datetime import datetime
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.errors import ScheduleError
from m2pem.scheduling.entry import (
    EntryState,
    EntryStatus,
    Missed,
    SchedulePlan,
    SettledTime,
    Settlement,
    When,
)
from m2pem.scheduling.times import (
    COUNTED_TIMES,
    described,
    due,
    instant_us,
    resolved,
    settle,
    withdrawn,
)

BERLIN = ZoneInfo("Europe/Berlin")


def us(text: str) -> int:
    return instant_us(text)


NOW = us("2026-01-01T00:00:00+00:00")
MINUTE_US = 60_000_000


def plan(**when: object) -> SchedulePlan:
    wanted = resolved(When(**when), NOW, "UTC")  # type: ignore[arg-type]
    return SchedulePlan("m.bpmn", b"", "P", "fleet", NOW, wanted)


def begun(of: SchedulePlan) -> EntryState:
    return EntryState(of.scheduled_us if of.when.cron else of.scheduled_us - 1)


# --- what an operator writes ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "zone", "meant"),
    [
        ("2026-05-01T08:00", "Europe/Berlin", "2026-05-01T08:00:00+02:00"),
        ("2026-05-01T08:00:00Z", "Europe/Berlin", "2026-05-01T08:00:00+00:00"),
        ("2026-05-01T08:00:00.5-03:00", "UTC", "2026-05-01T08:00:00.500000-03:00"),
        ("2026-10-25T02:30", "Europe/Berlin", "2026-10-25T02:30:00+02:00"),
        ("08:00", "Europe/Berlin", "2026-01-01T08:00:00+01:00"),
        ("0:30", "Europe/Berlin", "2026-01-02T00:30:00+01:00"),
    ],
)
def test_a_date_means_an_instant(written: str, zone: str, meant: str) -> None:
    assert resolved(When(at=written), NOW, zone).at == meant


@pytest.mark.parametrize(
    ("when", "why"),
    [
        (When(at="tomorrow"), "'tomorrow' is no date and time such as 2026-01-01T08:00"),
        (When(at="25:00"), "25:00 is no time of a day"),
        (When(at="2025-12-31"), "has passed: it is 2026-01-01T00:00:00"),
        (When(at="2026-03-29T02:30", time_zone="Europe/Berlin"), "clocks skip it"),
        (When(at="08:00", cron="0 8 * * *"), "not both"),
        (When(at="08:00", until="2026-01-01T07:00"), "too early"),
        (When(cron="0 8 * *"), "a cron text has 5, 6"),
        (When(cron="0 8 1 1 *", until="2026-01-01T07:00"), "no time from now on"),
        (
            When(cron="0 8 * * *", time_zone="Europe/Berlino"),
            "time zone: there is no 'Europe/Berlino'",
        ),
        (When(cron="0 8 * * *", after="r1"), "cannot start after one run"),
        (When(outcomes=("done",)), "outcomes of a run are completed"),
        (When(outcomes=()), "not none"),
        (When(condition="vehicle.batery > 0.9"), "did you mean 'vehicle.battery'"),
        (When(condition="vehicle.distance > 9"), "is no fact of a vehicle"),
        (When(condition="mission.lap > 9"), "is no fact of a vehicle"),
        (When(condition="vehicle.battery >"), "condition: "),
        (When(vehicles=("uav1",)), "go with a condition"),
        (When(condition="vehicle.armed", held_for_s=-1), "cannot be negative"),
    ],
)
def test_what_makes_no_sense_is_refused(when: When, why: str) -> None:
    with pytest.raises(ScheduleError) as refused:
        resolved(when, NOW, "UTC")
    assert why in str(refused.value)


def test_an_entry_says_in_words_when_it_starts() -> None:
    when = When(
        at="2026-05-01T08:00:00+02:00",
        after="r1",
        outcomes=("completed", "stopped"),
        condition="vehicle.battery > 0.9",
        vehicles=("uav1",),
        held_for_s=30,
    )
    assert described(when) == (
        "at 2026-05-01T08:00:00+02:00, after r1 has completed or been stopped, "
        "when vehicle.battery > 0.9 of uav1 for 30 s"
    )
    assert described(When()) == "when its vehicles are free"


# --- daylight saving ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("day", "times"),
    [
        ("2026-03-28", ["2026-03-28T02:30:00+01:00", "2026-03-29T03:00:00+02:00"]),
        ("2026-10-24", ["2026-10-24T02:30:00+02:00", "2026-10-25T02:30:00+02:00"]),
    ],
)
def test_where_clocks_change_a_daily_time_comes_once(day: str, times: list[str]) -> None:
    daily = plan(cron="30 2 * * *", time_zone="Europe/Berlin")
    state = EntryState(us(f"{day}T00:00:00+02:00"))
    found = []
    for _ in times:
        next_us = due(daily, state, state.settled_us).next_us
        assert next_us is not None
        found.append(datetime.fromtimestamp(next_us / 1e6, BERLIN).isoformat())
        state = EntryState(next_us)
    assert found == times


# --- due and missed -------------------------------------------------------------------------------


def test_a_date_is_due_from_its_instant_to_its_deadline() -> None:
    once = plan(at="2026-01-01T01:00", starting_deadline_s=60)
    state = begun(once)
    at = us("2026-01-01T01:00:00+00:00")
    assert due(once, state, at - 1).next_us == at
    found = due(once, state, at)
    assert (found.due_us, found.deadline_us, found.next_us) == (at, at + MINUTE_US, None)


def test_what_passed_is_counted_and_the_last_one_is_due() -> None:
    each = plan(cron="* * * * *")
    found = due(each, begun(each), NOW + 5 * MINUTE_US)
    assert (found.due_us, found.passed, found.passed_us, found.next_us) == (
        NOW + 5 * MINUTE_US,
        4,
        NOW + 4 * MINUTE_US,
        NOW + 6 * MINUTE_US,
    )


def test_very_many_that_passed_are_counted_up_to_a_bound() -> None:
    each = plan(cron="* * * * *")
    year_us = 365 * 24 * 60 * MINUTE_US
    found = due(each, begun(each), NOW + year_us)
    assert (found.due_us, found.next_us) == (NOW + year_us, NOW + year_us + MINUTE_US)
    assert found.passed == COUNTED_TIMES


def test_a_clock_that_goes_back_brings_no_time_again() -> None:
    each = plan(cron="* * * * *")
    settled = EntryState(NOW + 10 * MINUTE_US)
    assert due(each, settled, NOW + 5 * MINUTE_US).due_us is None
    assert due(each, settled, NOW + 5 * MINUTE_US).next_us == NOW + 11 * MINUTE_US


PERIODS = st.sampled_from(["* * * * *", "*/7 * * * *", "0,1,30 */2 * * *"])


@given(
    cron=PERIODS,
    missed=st.sampled_from(Missed),
    deadline_s=st.integers(0, 600),
    steps=st.lists(st.tuples(st.integers(0, 30 * 60), st.booleans()), min_size=1, max_size=20),
)
def test_each_time_is_settled_once_whenever_it_is_looked_at(
    cron: str, missed: Missed, deadline_s: int, steps: list[tuple[int, bool]]
) -> None:
    """A start where one is due and can be, else a miss when its deadline has passed."""
    of = plan(cron=cron, missed=missed, starting_deadline_s=float(deadline_s))
    state, now_us, started = begun(of), NOW, []
    for step_s, can_start in steps:
        now_us += step_s * 1_000_000
        found = due(of, state, now_us)
        if found.passed:
            passed = SettledTime(found.passed_us, now_us, Settlement.MISSED, times=found.passed)
            state = settle(of, state, passed)
            found = due(of, state, now_us)
            assert not found.passed
        if found.due_us is None:
            continue
        if found.deadline_us is not None and now_us > found.deadline_us:
            state = settle(of, state, SettledTime(found.due_us, now_us, Settlement.MISSED))
        elif can_start:
            assert found.due_us not in started or found.owed
            assert found.due_us <= now_us
            run = SettledTime(
                found.due_us, now_us, Settlement.STARTED, f"r{len(started)}", owed=found.owed
            )
            before, state = state, settle(of, state, run)
            assert due(of, withdrawn(state), now_us) == found
            assert withdrawn(state).times == before.times
            started.append(found.due_us)
    assert len(started) == len(set(started))
    counted = sum(each.times for each in state.times if not each.owed)
    cursor, expected = EntryState(NOW), 0
    while (next_us := due(of, cursor, cursor.settled_us).next_us) and next_us <= state.settled_us:
        cursor, expected = EntryState(next_us), expected + 1
    assert counted == expected


def test_the_state_ends_with_the_last_time() -> None:
    each = plan(cron="* * * * *", until="2026-01-01T00:02")
    state = begun(each)
    for minute in (1, 2):
        assert state.status is EntryStatus.ACTIVE
        time = SettledTime(NOW + minute * MINUTE_US, NOW, Settlement.STARTED, "r1")
        state = settle(each, state, time)
    assert state.status is EntryStatus.ENDED


def test_a_plan_is_called_as_the_file_of_its_mission_without_folder_and_suffix():
    plan = SchedulePlan("/srv/missions/night watch.bpmn", b"", "P", "north", NOW)
    assert plan.title == "night watch"
