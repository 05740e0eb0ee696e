"""The list of alerts: raised and cleared, grouped, acknowledged, owned, and kept."""

import asyncio
import sys

import pytest

from m2pem.api.alerts import LINK_LOST, AlertSeverity
from m2pem.api.runs import Alert
from m2pem.errors import JournalError, OperatorError
from m2pem.executive.alert_list import MOST_OVER, AlertList, Condition
from m2pem.journal import MemoryJournal, open_journal
from m2pem.units import US_PER_S

pytestmark = pytest.mark.asyncio


class Clock:
    """A clock that the test sets."""

    def __init__(self) -> None:
        self.s = 1000.0

    def now_us(self) -> int:
        return round(self.s * US_PER_S)


class FullJournal(MemoryJournal):
    """A journal whose disk is full."""

    async def write_alerts(self, fleet, alerts, *, last=None):
        raise JournalError("the disk is full")


def lost(*names):
    """Links that are lost now."""
    return Condition(LINK_LOST, AlertSeverity.ERROR, "{names}: the link is lost", resources=names)


def asks(prompt, run="r1", deadline_us=None):
    """A question that is open."""
    severity = AlertSeverity.WARNING
    return Condition("QUESTION", severity, "asks: Go?", run, prompt, deadline_us=deadline_us)


def update(alerts, *conditions, undecided=()):
    alerts.update(conditions, lambda alert: undecided)


def made(clock=None, journal=None):
    return AlertList("north", journal or MemoryJournal(), (clock or Clock()).now_us)


async def test_a_condition_is_raised_and_cleared_as_it_comes_and_goes():
    alerts = made()
    update(alerts, asks("p1"))
    update(alerts, asks("p1"))
    (alert,) = alerts.alerts()
    assert (alert.alert, alert.run, alert.subject, alert.count) == ("a1", "r1", "p1", 1)
    update(alerts)
    assert alerts.alerts() == []
    (over,) = alerts.alerts(over=True)
    assert (over.alert, over.open) == ("a1", False)


async def test_a_thousand_vehicles_that_lose_their_links_at_once_are_one_alert():
    clock = Clock()
    alerts = made(clock)
    names = [f"uav{number}" for number in range(1000)]
    for number in range(0, 1000, 100):
        update(alerts, lost(*names[: number + 100]))
        clock.s += 0.5
    (alert,) = alerts.alerts()
    assert (alert.count, len(alert.resources)) == (1, 1000)
    assert alert.text == "uav0, uav1, uav2, uav3, uav4 and 995 more: the link is lost"


async def test_a_vehicle_that_is_lost_later_or_after_an_acknowledgement_is_an_alert_of_its_own():
    clock = Clock()
    alerts = made(clock)
    update(alerts, lost("uav1"))
    await alerts.acknowledge("a1", "anna")
    update(alerts, lost("uav1", "uav2"))
    clock.s += 6
    update(alerts, lost("uav1", "uav2", "uav3"))
    assert {each.alert: each.resources for each in alerts.alerts()} == {
        "a1": ("uav1",),
        "a2": ("uav2",),
        "a3": ("uav3",),
    }


async def test_what_is_left_of_an_alert_is_said_until_all_of_it_is_over():
    alerts = made()
    update(alerts, lost("uav1", "uav2"))
    update(alerts, lost("uav2"))
    (alert,) = alerts.alerts()
    assert (alert.text, alert.resources) == ("uav2: the link is lost", ("uav1", "uav2"))
    update(alerts)
    assert alerts.alerts() == []


async def test_what_cannot_be_said_yet_stays():
    alerts = made()
    update(alerts, lost("uav1"), asks("p1"))
    update(alerts, undecided=("uav1", "p1"))
    assert len(alerts.alerts()) == 2


async def test_a_deadline_is_told_when_it_changes():
    alerts = made()
    update(alerts, asks("p1", deadline_us=5))
    changes = alerts.changes
    update(alerts, asks("p1", deadline_us=5))
    assert alerts.changes == changes
    update(alerts, asks("p1", deadline_us=None))
    assert alerts.alerts()[0].deadline_us is None


async def test_what_was_said_once_is_open_until_it_is_acknowledged():
    alerts = made()
    alerts.add(Alert("r1", "NOT_RECEIVED", "uav1 may not have stopped", AlertSeverity.CRITICAL))
    update(alerts)
    assert [each.code for each in alerts.alerts()] == ["NOT_RECEIVED"]
    await alerts.acknowledge("a1", "anna")
    assert alerts.alerts() == []
    assert alerts.alerts(over=True)[0].acknowledged_by == "anna"


async def test_alike_ones_that_come_together_are_one_and_keep_what_each_says():
    clock = Clock()
    alerts = made(clock)
    for number in range(3):
        said = f"uav{number} may not have stopped"
        alerts.add(Alert("r1", "NOT_RECEIVED", said, resources=(f"uav{number}",), group="STOP"))
    clock.s += 6
    alerts.add(Alert("r1", "NOT_RECEIVED", "uav9 may not have stopped", group="STOP"))
    last, first = alerts.alerts()
    assert (first.count, first.resources) == (3, ("uav0", "uav1", "uav2"))
    assert first.details == ("uav1 may not have stopped", "uav2 may not have stopped")
    assert last.text == "uav9 may not have stopped"


async def test_a_notice_is_over_at_once_and_what_the_list_has_as_a_condition_is_not_added():
    alerts = made()
    alerts.add(Alert("", "SCHEDULE", "s1 was held by anna", AlertSeverity.NOTICE))
    alerts.add(Alert("", "LOGGED", "uav1: LINK_LOST", listed=False))
    assert alerts.alerts() == []
    assert [each.code for each in alerts.alerts(over=True)] == ["SCHEDULE"]


async def test_it_is_said_that_something_is_over():
    alerts = made()
    alerts.add(Alert("", "JOURNAL_SPACE", "the disk is full", AlertSeverity.ERROR))
    alerts.add(Alert("", "JOURNAL_SPACE", "there is room again", clears=True))
    assert alerts.alerts() == []


async def test_the_most_severe_come_first_then_the_newest():
    clock = Clock()
    alerts = made(clock)
    for severity in ("warning", "critical", "error", "warning"):
        clock.s += 10
        alerts.add(Alert("", "X", f"{severity} at {clock.s}", AlertSeverity(severity)))
    assert [each.text for each in alerts.alerts()] == [
        "critical at 1020.0",
        "error at 1030.0",
        "warning at 1040.0",
        "warning at 1010.0",
    ]


async def test_the_first_acknowledgement_counts_and_what_is_over_or_unknown_is_refused():
    alerts = made()
    update(alerts, asks("p1"))
    await alerts.acknowledge("a1", "anna")
    with pytest.raises(OperatorError, match="anna has acknowledged a1 already"):
        await alerts.acknowledge("a1", "otto")
    with pytest.raises(OperatorError, match="no alert 'a7'; open ones: a1"):
        await alerts.acknowledge("a7", "otto")
    update(alerts)
    with pytest.raises(OperatorError, match="a1 is over"):
        await alerts.own("a1", "otto")


async def test_who_takes_care_can_be_changed_and_taken_back():
    alerts = made()
    update(alerts, asks("p1"))
    await alerts.own("a1", "anna")
    assert alerts.alerts()[0].owner == "anna"
    await alerts.own("a1", "")
    assert (alerts.alerts()[0].owner, alerts.alerts()[0].owned_us) == ("", None)


async def test_the_next_executive_knows_who_acknowledged_and_owns_what():
    journal = MemoryJournal()
    before = made(journal=journal)
    update(before, asks("p1"), lost("uav1"))
    await before.acknowledge("a1", "anna")
    await before.own("a2", "otto")
    after = made(journal=journal)
    await after.load()
    update(after, asks("p1"), undecided=("uav1",))
    assert {each.alert: (each.acknowledged_by, each.owner) for each in after.alerts()} == {
        "a1": ("anna", ""),
        "a2": ("", "otto"),
    }
    update(after, asks("p1"), asks("p2"), lost("uav1"))
    assert sorted(each.alert for each in after.alerts()) == ["a1", "a2", "a3"]


async def test_a_journal_that_does_not_write_is_told_and_written_later():
    alerts = AlertList("north", FullJournal(), Clock().now_us)
    update(alerts, asks("p1"))
    with pytest.raises(OperatorError, match=r"a1 is acknowledged here, but .*the disk is full"):
        await alerts.acknowledge("a1", "anna")
    assert alerts.alerts()[0].acknowledged_by == "anna"
    with pytest.raises(JournalError):
        await alerts.write()


async def test_the_oldest_that_are_over_are_removed_from_list_and_journal():
    journal, clock = MemoryJournal(), Clock()
    alerts = made(clock, journal)
    for number in range(MOST_OVER + 10):
        alerts.add(Alert("", "SCHEDULE", f"{number}", AlertSeverity.NOTICE))
    await alerts.write()
    assert len(alerts.alerts(over=True)) == MOST_OVER
    assert min(await journal.alerts("north")) == 11


class Unreadable(MemoryJournal):
    """A journal that cannot be read at first."""

    broken = True

    async def alerts(self, fleet):
        if self.broken:
            raise JournalError("it cannot be read")
        return await super().alerts(fleet)


async def test_what_could_not_be_read_at_first_is_not_written_over():
    journal = Unreadable()
    before = made(journal=journal)
    journal.broken = False
    before.add(Alert("", "SCHEDULE", "kept", AlertSeverity.WARNING))
    await before.write()
    journal.broken = True
    after = made(journal=journal)
    with pytest.raises(JournalError):
        await after.load()
    after.add(Alert("", "SCHEDULE", "new", AlertSeverity.WARNING))
    with pytest.raises(JournalError):
        await after.write()
    journal.broken = False
    await after.write()
    assert {each.alert: each.text for each in after.alerts()} == {"a1": "kept", "a2": "new"}
    again = made(journal=journal)
    await again.load()
    assert again.alerts() == after.alerts()


def warning(text):
    """Something that is said once, and open until an operator acknowledges it."""
    return Alert("", "SCHEDULE", text, AlertSeverity.WARNING)


def at(s):
    clock = Clock()
    clock.s = s
    return clock


async def kept(journal):
    """The alerts that the next executive reads, by their ids."""
    again = made(journal=journal)
    await again.load()
    return {each.alert: each for each in again.alerts(over=True)}


async def test_two_executives_of_a_fleet_write_over_no_alert_of_each_other():
    journal = MemoryJournal()
    one, two = made(at(1), journal), made(at(2), journal)
    await one.load()
    await two.load()
    one.add(warning("rain"))
    update(two, lost("uav1"))
    two.add(warning("wind"))
    await one.write()
    await two.write()
    assert {key: each.text for key, each in (await kept(journal)).items()} == {
        "a1": "rain",
        "a2": "uav1: the link is lost",
        "a3": "wind",
    }
    assert {each.alert for each in two.alerts()} == {"a1", "a2", "a3"}
    await two.acknowledge("a3", "otto")
    one.add(warning("snow"))
    await one.acknowledge("a1", "anna")
    assert {key: each.acknowledged_by for key, each in (await kept(journal)).items()} == {
        "a1": "anna",
        "a2": "",
        "a3": "otto",
        "a4": "",
    }


async def test_what_changed_here_is_newer_than_what_another_executive_left():
    journal = MemoryJournal()
    one, two = made(at(1), journal), made(at(2), journal)
    one.add(warning("rain"))
    update(one, asks("p1"))
    await one.write()
    await two.load()
    two.add(warning("wind"))
    await two.write()
    update(one)  # the question was answered
    one.add(warning("snow"))
    await one.write()
    found = await kept(journal)
    assert {key: each.text for key, each in found.items() if each.open} == {
        "a1": "rain",
        "a3": "wind",
        "a4": "snow",
    }
    assert {each.alert for each in one.alerts()} == {"a1", "a3", "a4"}


async def test_what_another_executive_removed_stays_removed():
    journal = MemoryJournal()
    one, two = made(at(1), journal), made(at(2), journal)
    one.add(Alert("", "SCHEDULE", "old", AlertSeverity.NOTICE))
    await one.write()
    await two.load()
    for number in range(MOST_OVER):
        two.add(Alert("", "SCHEDULE", f"{number}", AlertSeverity.NOTICE))
    await two.write()
    one.add(warning("rain"))
    await one.write()
    numbers = sorted(await journal.alerts("north"))
    assert (numbers[0], numbers[-1]) == (2, MOST_OVER + 2)


class Slow(MemoryJournal):
    """A journal that may be waited for in vain; `written`: what was asked for is done anyway."""

    stuck = written = False

    async def write_alerts(self, fleet, alerts, *, last=None):
        if not self.stuck or self.written:
            await super().write_alerts(fleet, alerts, last=last)
        if self.stuck:
            await asyncio.Event().wait()


@pytest.mark.parametrize("written", [False, True])
async def test_an_alert_whose_writing_was_given_up_is_written_once(written):
    journal = Slow()
    alerts = made(journal=journal)
    await alerts.load()
    journal.stuck, journal.written = True, written
    alerts.add(warning("rain"))
    writing = asyncio.create_task(alerts.write())
    await asyncio.sleep(0)
    alerts.add(warning("rain"))  # again
    writing.cancel()
    await asyncio.wait([writing])
    journal.stuck = False
    await alerts.acknowledge("a1", "anna")
    (alert,) = (await kept(journal)).values()
    assert (alert.alert, alert.count, alert.acknowledged_by) == ("a1", 2, "anna")


_WRITER = """
import asyncio, sys
from m2pem.api.runs import Alert
from m2pem.executive.alert_list import AlertList
from m2pem.journal import open_journal

async def write(url, who, times):
    journal = open_journal(url)
    alerts = AlertList("north", journal, lambda: 1)
    await alerts.load()
    print("ready", flush=True)
    sys.stdin.readline()
    for number in range(int(times)):
        alerts.add(Alert("", "SCHEDULE", f"{who} {number}"))
        await alerts.write()
    await journal.close()

asyncio.run(write(*sys.argv[1:]))
"""


async def test_two_processes_that_write_alerts_at_the_same_time_lose_none(tmp_path):
    times, people = 40, ("anna", "ben")
    url = str(tmp_path / "journal.db")
    pipe = asyncio.subprocess.PIPE
    writers = [
        await asyncio.create_subprocess_exec(
            sys.executable, "-c", _WRITER, url, who, str(times), stdin=pipe, stdout=pipe
        )
        for who in people
    ]
    for writer in writers:
        assert await writer.stdout.readline() == b"ready\n"
    ended = await asyncio.gather(*(writer.communicate(b"go\n") for writer in writers))
    assert [writer.returncode for writer in writers] == [0, 0], ended
    journal = open_journal(url)
    found = await kept(journal)
    await journal.close()
    assert set(found) == {f"a{number}" for number in range(1, 2 * times + 1)}
    assert sorted(each.text for each in found.values()) == sorted(
        f"{who} {number}" for who in people for number in range(times)
    )
