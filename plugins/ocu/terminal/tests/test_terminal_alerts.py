"""Alerts in the terminal: the executive's list, the bell, and how long a question is open yet."""

import socket
from pathlib import Path

import pytest
from m2pem_plugin_terminal import display
from m2pem_plugin_terminal.alerts import Bell, age, hint, time_left
from m2pem_plugin_terminal.app import TerminalApp
from terminal_world import MISSION, World

from m2pem.api import Alert, AlertSeverity, OperatorAlert
from m2pem.journal.standbys import standby_of


def alert(number: int, severity: AlertSeverity, code: str = "X", **more: object) -> OperatorAlert:
    return OperatorAlert(f"a{number}", severity, code, "text", 0, 0, **more)  # type: ignore[arg-type]


async def test_an_alert_is_listed_acknowledged_and_owned(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.press("a")
        await terminal.until_shown("There are no alerts.")
        await terminal.press("escape")
        world.executive.events.publish(
            Alert("", "JOURNAL_STALLED", "the journal does not write", AlertSeverity.CRITICAL)
        )
        world.look()
        await terminal.until_shown("the journal does not write")
        for _ in range(9):  # each takes a second: the notice gets old
            await terminal.press("escape")
        await terminal.until_shown("1 alert, critical (a)")
        await terminal.press("a")
        await terminal.until_shown("! critical", "the journal does not write")
        await terminal.press("1")
        await terminal.until_shown("JOURNAL_STALLED", "1 Acknowledge it", "2 Take care")
        await terminal.press("2")
        await terminal.until_gone("JOURNAL_STALLED")
        world.look()
        await terminal.press("a")
        await terminal.until_shown("anna@gcs1 takes care")
        await terminal.press("1")
        await terminal.until_shown("1 Acknowledge it", "2 Give it up: it has no")
        await terminal.press("1")
        world.look()
        await terminal.until_gone("1 alert, critical (a)")
        (known,) = await world.control.alerts(over=True)
        assert (known.acknowledged_by, known.owner) == ("anna@gcs1", "anna@gcs1")


async def test_the_bell_rings_for_a_question_and_b_switches_it_off(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    rung: list[str] = []
    monkeypatch.setattr(TerminalApp, "bell", lambda app: rung.append(app.run_shown))
    async with world.terminal() as terminal:
        await terminal.until(lambda: terminal.app.alerts == [])
        await world.start()
        world.look()
        await terminal.until(lambda: rung)
        await terminal.press("b")
        await terminal.until_shown("The bell is off")
        rung.clear()
        world.executive.events.publish(Alert("", "BLOCKED", "a plugin blocks", AlertSeverity.ERROR))
        world.look()
        await terminal.until(lambda: any(each.code == "BLOCKED" for each in terminal.app.alerts))
        await terminal.press("b")
        await terminal.until_shown("The bell rings")
        assert rung == []


async def test_a_question_with_a_deadline_counts_down(world: World, tmp_path: Path) -> None:
    timed = MISSION.read_text("utf-8").replace(
        '<boundaryEvent id="Home"',
        '<boundaryEvent id="Late" attachedToRef="Gate"><timerEventDefinition>'
        '<timeDuration xsi:type="tFormalExpression">PT2M</timeDuration></timerEventDefinition>'
        '</boundaryEvent><sequenceFlow id="late" sourceRef="Late" targetRef="End"/>'
        '<boundaryEvent id="Home"',
    )
    mission = tmp_path / "timed.bpmn"
    mission.write_text(timed, "utf-8")
    async with world.terminal() as terminal:
        await world.control.start(mission)
        world.look()
        await terminal.until_shown("GATE (p", "2:00 left")
        await world.clock.advance(45)
        terminal.pass_time(45)
        await terminal.until_shown("1:15 left")
        await terminal.press("tab")
        await terminal.until_shown("BRIDGE (p")
        assert not terminal.shows(" left")


async def test_the_header_says_who_stands_by_and_the_line_when_nobody_does_any_more(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(display, "STANDBYS_EVERY_S", 0.01)
    journal, served = world.executive.journal, standby_of(world.executive.fleet.name)
    async with world.terminal() as terminal:
        await terminal.until_shown("no mission is running")
        assert not terminal.shows("standby")
        await journal.serve_fleet(served, ["1"])
        await terminal.until_shown(f"standby: {socket.gethostname()}")
        await world.start()
        await terminal.until_shown("RUNNING", f"standby: {socket.gethostname()}")
        await journal.leave_fleet(served)
        await terminal.until_shown("No executive stands by any more")
        await terminal.until_gone("standby:")


def test_the_bell_rings_once_for_what_is_new_and_again_for_what_is_critical() -> None:
    bell, error = Bell(on=True), alert(1, AlertSeverity.ERROR)
    assert not bell.rings([error], 0.0)  # it was there before this unit
    assert bell.rings([error, alert(2, AlertSeverity.WARNING)], 1.0)
    assert not bell.rings([error, alert(2, AlertSeverity.WARNING)], 100.0)
    assert not bell.rings([alert(3, AlertSeverity.NOTICE)], 101.0)
    critical = alert(4, AlertSeverity.CRITICAL)
    assert [bell.rings([critical], at) for at in (102.0, 105.0, 112.0)] == [True, False, True]
    assert not bell.rings([alert(4, AlertSeverity.CRITICAL, acknowledged_by="bob")], 130.0)
    bell.on = False
    assert not bell.rings([alert(5, AlertSeverity.CRITICAL)], 200.0)


def test_the_line_counts_what_nobody_has_acknowledged() -> None:
    question = alert(1, AlertSeverity.WARNING, "QUESTION")
    assert hint([question, alert(2, AlertSeverity.ERROR, acknowledged_by="bob")]) == ""
    assert hint([question, alert(2, AlertSeverity.WARNING)]) == "1 alert (a)"
    two = [alert(2, AlertSeverity.WARNING), alert(3, AlertSeverity.ERROR)]
    assert hint(two) == "2 alerts, error (a)"


def test_ages_and_deadlines() -> None:
    assert [age(each) for each in (7, 200, 7300, 200_000)] == ["7 s", "3 min", "2 h", "2 d"]
    # By what the executive says is left, whatever the clock of this computer says.
    asked = alert(
        1,
        AlertSeverity.WARNING,
        "QUESTION",
        run="r1",
        subject="p1",
        deadline_us=90_000_000,
        left_s=45.0,
    )
    assert time_left([asked], "r1", "p1", 3.0) == ", 0:42 left"
    assert time_left([asked], "r1", "p2", 3.0) == ""
    assert time_left([asked], "r1", "p1", 99.0) == ", 0:00 left"
