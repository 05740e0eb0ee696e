"""The plain unit against a control that notes what it is asked."""

import asyncio
import io
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any, cast

import pytest

from m2pem.api.control import MissionControl
from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.runs import OpenPrompt, PromptClosed, RunStatus, RunSummary, StampedRecord
from m2pem.cli import plain
from m2pem.cli.plain import PlainOcu
from m2pem.cli.standard_streams import writer_for
from m2pem.engine.records import (
    Record,
    RequirementDecided,
    RequirementMonitored,
    RequirementVerdict,
    RunEnded,
    RunOutcome,
    RunStarted,
)
from m2pem.errors import BusyError, OperatorError
from m2pem.geo.files import read_geometry
from m2pem.geo.geojson import parse_geojson
from m2pem.mission.behavior import Decision
from tests.command_line import REPOSITORY

ROUTE = (Decision("continue", "Continue"), Decision("abort", "Give up"))
RECOVERY = (Decision("resume", "Resume"), Decision("abort", "Abort the mission"))


def prompt(
    name: str = "p1", run: str = "r1", decisions: tuple[Decision, ...] = ROUTE
) -> OpenPrompt:
    return OpenPrompt(run, name, "UserSendRoute", "Send the route", decisions)


class Control:
    """Notes calls; `refuse` is raised by the next one."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.notices: asyncio.Queue[ControlEvent] = asyncio.Queue()
        self.refuse: OperatorError | None = None
        self.status = RunStatus.RUNNING

    async def subscribe(self, size: int) -> AsyncIterator[ControlEvent]:
        while True:
            yield await self.notices.get()
            self.notices.task_done()

    def __getattr__(self, name: str) -> Callable[..., Awaitable[None]]:
        async def call(*words: Any, run: str | None = None, by: str, **more: Any) -> None:
            if self.refuse is not None:
                refusal, self.refuse = self.refuse, None
                raise refusal
            assert by == "plain"
            said = [key for key, value in more.items() if value]
            self.calls.append((name, *words, *said) if run is None else (name, *words, run))

        return call

    async def runs(self) -> list[RunSummary]:
        return [
            RunSummary("r1", "a.bpmn", "A", self.status, 0),
            RunSummary("r2", "b.bpmn", "B", RunStatus.FAILED, 0, detail="stuck"),
        ]


class Operator:
    """Someone at a plain unit."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.control = Control()
        self._lines: asyncio.Queue[str | None] = asyncio.Queue()
        self._screen = io.StringIO()
        monkeypatch.setattr(plain, "Lines", self._typed)
        monkeypatch.setattr(sys, "stdout", self._screen)
        unit = PlainOcu(cast("MissionControl", self.control))
        self.serving = asyncio.create_task(unit.serve())

    async def _typed(self) -> AsyncIterator[str]:
        while (line := await self._lines.get()) is not None:
            yield line
            self._lines.task_done()
        self._lines.task_done()

    async def hear(self, *notices: ControlEvent | Record, run: str = "r1") -> None:
        for notice in notices:
            if not isinstance(notice, (OpenPrompt, PromptClosed, StampedRecord)):
                notice = StampedRecord(run, 1, 0.0, notice)  # noqa: PLW2901
            self.control.notices.put_nowait(notice)
        await self.control.notices.join()
        await asyncio.sleep(0)

    async def type(self, *lines: str | None) -> None:
        """None is the end of the input."""
        for line in lines:
            self._lines.put_nowait(line)
        await self._lines.join()

    def leave(self) -> None:
        self._lines.put_nowait("quit")

    @property
    def screen(self) -> str:
        writer_for(self._screen).drain()
        return self._screen.getvalue()


@pytest.fixture
async def operator(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Operator]:
    made = Operator(monkeypatch)
    yield made
    made.serving.cancel()
    await asyncio.gather(made.serving, return_exceptions=True)


async def test_a_prompt_is_shown_with_numbered_decisions(operator: Operator) -> None:
    await operator.hear(prompt())
    assert operator.screen == (
        "[p1] UserSendRoute: Send the route\n    1 Continue\n    2 Give up (abort)\n"
    )


@pytest.mark.parametrize(
    "line", ["2", "abort", "Give up", "give UP", "p1 2", "p1 abort", "r1 p1 Give up", "  2  "]
)
async def test_an_answer_is_a_number_a_decision_or_its_label(operator: Operator, line: str) -> None:
    await operator.hear(prompt())
    await operator.type(line)
    assert operator.control.calls == [("answer", "r1", "p1", "abort")]


@pytest.mark.parametrize("line", ["0", "3", "-1", "ab", "p1", "p2 1", "²"])
async def test_what_answers_nothing_is_told_with_the_decisions(
    operator: Operator, line: str
) -> None:
    await operator.hear(prompt())
    await operator.type(line)
    assert operator.control.calls == []
    assert "does not answer p1; its decisions: 1 continue, 2 abort" in operator.screen


async def test_of_several_prompts_one_is_named(operator: Operator) -> None:
    await operator.hear(prompt("p1"), prompt("p2"), prompt("p1", "r2"))
    await operator.type("1", "p2 1", "r2 p1 2", "p1 1")
    assert operator.control.calls == [
        ("answer", "r1", "p2", "continue"),
        ("answer", "r2", "p1", "abort"),
    ]
    assert "several prompts are open: r1 p1, r1 p2, r2 p1" in operator.screen


async def test_who_answered_elsewhere_is_told(operator: Operator) -> None:
    await operator.hear(prompt(), PromptClosed("r1", "p1", "abort", "web"))
    assert operator.screen.endswith("[p1] answered by web: abort\n")
    await operator.type("1")
    assert "no prompt is open" in operator.screen


async def test_its_own_answer_is_not_told_again(operator: Operator) -> None:
    await operator.hear(prompt(), PromptClosed("r1", "p1", "abort", "plain"))
    assert "answered" not in operator.screen


async def test_a_withdrawn_prompt_is_told(operator: Operator) -> None:
    await operator.hear(prompt(), PromptClosed("r1", "p1"))
    assert operator.screen.endswith("[p1] is not asked any more\n")


async def test_a_refusal_is_told(operator: Operator) -> None:
    await operator.hear(prompt())
    operator.control.refuse = OperatorError("r1: prompt p1 was answered by web")
    await operator.type("1", "2")
    assert "r1: prompt p1 was answered by web\n" in operator.screen
    assert operator.control.calls == [("answer", "r1", "p1", "abort")]


async def test_commands_are_for_the_only_run(operator: Operator) -> None:
    await operator.hear(RunStarted("P", 0))
    await operator.type("pause", "resume", "stop", "signal Stop driving", "start a b.bpmn")
    assert operator.control.calls == [
        ("pause", "r1"),
        ("resume", "r1"),
        ("stop", "r1"),
        ("signal", "Stop driving"),
        ("start", "a b.bpmn"),
    ]


async def test_a_start_with_busy_vehicles_is_confirmed_by_another_command(
    operator: Operator,
) -> None:
    operator.control.refuse = BusyError("run r1 uses ugv1", {"ugv1": "r1"})
    await operator.type("start a b.bpmn", "start! a b.bpmn")
    assert "run r1 uses ugv1. start! a b.bpmn starts it all the same" in operator.screen
    assert operator.control.calls == [("start", "a b.bpmn", "even_if_busy")]


async def test_missions_are_scheduled_held_released_and_cancelled(operator: Operator) -> None:
    await operator.type(
        "schedule free a b.bpmn",
        "schedule 08:00 c.bpmn",
        "schedule hold",
        "schedule hold s1",
        "schedule release",
        "schedule cancel s1",
        "schedule start s1",
        "schedule cancel",
        "schedule 08:00",
    )
    assert operator.control.calls == [
        ("schedule", "a b.bpmn", "when"),
        ("schedule", "c.bpmn", "when"),
        ("hold_schedule", None),
        ("hold_schedule", "s1"),
        ("release_schedule", None),
        ("unschedule", "s1"),
        ("start_scheduled", "s1"),
    ]
    assert operator.screen.count("say what: schedule 08:00 FILE") == 2


async def test_of_several_runs_one_is_named(operator: Operator) -> None:
    await operator.hear(RunStarted("P", 0))
    await operator.hear(RunStarted("P", 0), run="r2")
    await operator.type("stop", "stop r2", "signal r2 Stop driving")
    assert "which run: r1, r2?" in operator.screen
    assert operator.control.calls == [("stop", "r2"), ("signal", "Stop driving", "r2")]


async def test_a_run_that_has_ended_is_not_meant(operator: Operator) -> None:
    await operator.hear(RunStarted("P", 0), RunEnded(RunOutcome.COMPLETED, ""))
    await operator.type("stop")
    assert "no mission runs" in operator.screen
    assert operator.control.calls == []


async def test_stop_always_stops_whatever_is_asked(operator: Operator) -> None:
    await operator.hear(RunStarted("P", 0), prompt(decisions=(Decision("stop", "Stop"),)))
    await operator.type("stop", "1")
    assert operator.control.calls == [("stop", "r1"), ("answer", "r1", "p1", "stop")]


async def until(condition: Callable[[], bool]) -> None:
    """Files are read in a thread; the next turns of the loop see what came of it."""
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110 - the unit says it on its screen alone
            await asyncio.sleep(0)


async def test_a_route_is_handed_over_from_a_file(operator: Operator) -> None:
    file = REPOSITORY / "fleet_configs" / "routes" / "alpha.geojson"
    await operator.type(f"route route_alpha {file}")
    await until(lambda: "handed over" in operator.screen)
    ((called, name, geometry),) = operator.control.calls
    assert (called, name) == ("set_geometry", "route_alpha")
    assert parse_geojson(geometry) == read_geometry(file, "route")


async def test_a_file_that_is_no_route_is_refused(operator: Operator) -> None:
    await operator.type("route route_alpha none.geojson")
    await until(lambda: "none.geojson: cannot be read" in operator.screen)
    assert operator.control.calls == []


async def test_resume_answers_what_is_asked_after_a_restart(operator: Operator) -> None:
    await operator.hear(RunStarted("P", 0), prompt(decisions=RECOVERY))
    await operator.type("resume")
    operator.control.status = RunStatus.PAUSED
    await operator.type("resume")
    assert operator.control.calls == [("answer", "r1", "p1", "resume"), ("resume", "r1")]


async def test_runs_are_listed(operator: Operator) -> None:
    await operator.type("runs")
    assert operator.screen == "r1 running a.bpmn (A)\nr2 failed b.bpmn (B): stuck\n"


async def test_help_lists_every_command(operator: Operator) -> None:
    await operator.type("help")
    for command in ("signal", "pause", "resume", "stop", "start", "runs", "quit"):
        assert command in operator.screen


async def test_quit_ends_it(operator: Operator) -> None:
    await operator.hear(prompt())
    operator.leave()
    await operator.serving
    await asyncio.sleep(0)
    assert operator.control.calls == []


async def test_the_end_of_the_input_is_noted_once_when_somebody_is_asked(
    operator: Operator,
) -> None:
    await operator.type(None)
    assert operator.screen == ""
    await operator.hear(prompt("p1"), prompt("p2"))
    assert operator.screen.count("the input has ended: no operator answers here any more") == 1
    assert not operator.serving.done()


async def test_empty_lines_mean_nothing(operator: Operator) -> None:
    await operator.hear(prompt())
    before = operator.screen
    await operator.type("", "   ")
    assert operator.screen == before
    assert operator.control.calls == []


async def test_the_requirements_of_a_run_are_listed_with_their_verdicts(operator: Operator) -> None:
    stamped = [
        StampedRecord("r1", seq, 0.0, record)
        for seq, record in enumerate(
            (
                RequirementMonitored("home", "<>ended", "At some point the mission is over."),
                RequirementMonitored("safe", "[]!active(B)", "Never 'B' is active."),
                RequirementDecided(
                    "safe", RequirementVerdict.VIOLATED, "", 2_500_000, "'B' is active"
                ),
            ),
            1,
        )
    ]

    async def records(run: str, after: int) -> list[StampedRecord]:
        return [each for each in stamped if (each.run, each.seq > after) == (run, True)][:2]

    operator.control.records = records  # type: ignore[attr-defined]  # two records a page
    await operator.hear(RunStarted("A", 0))
    await operator.type("requirements", "requirements r2")
    assert operator.screen == (
        "safe is violated since 2.5 s: Never 'B' is active ('B' is active)\n"
        "home is open: At some point the mission is over\n"
        "r2 is monitored for no requirement\n"
    )


async def test_the_only_run_is_meant_also_if_it_had_begun_before(operator: Operator) -> None:
    await operator.type("stop")
    assert operator.control.calls == [("stop", "r1")]
    await operator.hear(RunStarted("P", 0), run="r3")
    await operator.type("stop")
    assert operator.control.calls[1:] == [("stop", "r3")]
