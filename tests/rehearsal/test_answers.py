"""Answers files: what can be wrong with one, and which entry a visit gets."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.runs import (
    OpenIncident,
    OpenPrompt,
    PromptClosed,
    RunStatus,
    RunSummary,
    StampedRecord,
)
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import MessageReceived, SignalReceived
from m2pem.engine.records import (
    BehaviorRequested,
    DataWritten,
    InputDeferred,
    MessageThrown,
    PromptAnswered,
    PromptOpened,
    Record,
    RunResumed,
    ServiceRequested,
    SignalThrown,
)
from m2pem.errors import AnswersError, OperatorError
from m2pem.executive.executive import Executive
from m2pem.findings import Finding
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Entry, RunHeader
from m2pem.journal.memory import MemoryJournal
from m2pem.mission.behavior import Decision
from m2pem.mission.mission import Mission
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import BY_DEFAULT, BY_SCRIPT, Answers, check_answers, load_answers
from m2pem.rehearsal.answers_file import BehaviorEntry, ServiceEntry
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.rehearsal.scripted import ScriptedPlugins
from m2pem.testing import scenarios

START_US = 1_767_225_600_000_000
MISSIONS = Path(__file__).parents[2] / "missions"
STOP = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"

Write = Callable[[str], Path]


def load_mission(name: str) -> Mission:
    path = MISSIONS / name
    return parse_mission(path.read_bytes(), str(path))


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes an answers file."""

    def write(text: str) -> Path:
        path = tmp_path / "answers.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def answers(write: Write) -> Callable[[str], Answers]:
    """Loads answers from their text."""
    return lambda text: load_answers(write(text))


# --- what a file may say ------------------------------------------------------------------------


def refused(path: Path) -> Sequence[Finding]:
    with pytest.raises(AnswersError) as caught:
        load_answers(path)
    return caught.value.findings


@pytest.mark.parametrize("text", ["", "# nothing\n", "answers: {}\n", "answers: {A: []}"])
def test_a_file_may_say_nothing(answers: Callable[[str], Answers], text: str) -> None:
    assert answers(text).answer("r1", "A", "p1") is None


def test_every_missing_or_wrong_thing_is_found_with_its_line(write: Write) -> None:
    path = write(
        "answers:\n"
        "  Ask: continue\n"
        "  Other: [true]\n"
        "signals:\n"
        "  - {id: s}\n"
        "  - {at: 3 m, id: s}\n"
        "services:\n"
        "  Detector:\n"
        "    - {after: 5 s, writes: {a: 1}}\n"
        "    - {after: -1 s}\n"
        "    - {write: {a: 1}, error: E}\n"
        "behaviors:\n"
        "  Drive:\n"
        "    - {after: 30 s, end: fails}\n"
        "    - {end: failed}\n"
        "    - {after: 0 s, end: succeeded, error: E}\n"
        "anwsers: {}\n"
    )
    findings = {(each.line, each.element, each.rule): each for each in refused(path)}
    assert set(findings) == {
        (2, "answers.Ask", "bad-value"),
        (3, "answers.Other[0]", "bad-value"),
        (5, "signals[0].at", "missing-key"),
        (6, "signals[1].at", "bad-value"),
        (9, "services.Detector[0].writes", "unknown-key"),
        (10, "services.Detector[1].after", "bad-value"),
        (11, "services.Detector[2]", "bad-value"),
        (14, "behaviors.Drive[0].end", "bad-value"),
        (15, "behaviors.Drive[1]", "bad-value"),
        (16, "behaviors.Drive[2]", "bad-value"),
        (17, "anwsers", "unknown-key"),
    }
    near = findings[9, "services.Detector[0].writes", "unknown-key"]
    assert near.remedy == "did you mean 'write'?"
    assert all(str(each).startswith(f"{path}:{each.line}: ") for each in findings.values())


def test_a_file_that_is_no_yaml_is_refused_with_the_line(write: Write) -> None:
    (finding,) = refused(write("answers:\n  Ask: [continue\n"))
    assert (finding.rule, finding.line) == ("yaml-syntax", 3)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    (finding,) = refused(tmp_path / "none.yaml")
    assert "No such file" in finding.message


# --- does it fit the mission --------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted((MISSIONS / "answers").glob("*.yaml")), ids=str)
def test_the_answers_of_the_missions_here_fit_them(path: Path) -> None:
    (name,) = (each.name for each in MISSIONS.glob("*.bpmn") if path.stem.startswith(each.stem))
    mission = load_mission(name)
    assert check_answers(load_answers(path), mission) == []


def misfits(answers: Answers) -> list[tuple[int, str, str, str]]:
    mission = load_mission("vignette1.bpmn")
    return [
        (each.line, each.rule, each.message.partition(" (")[0], each.remedy)
        for each in check_answers(answers, mission)
    ]


def test_names_that_the_mission_lacks_are_found_with_near_ones(
    answers: Callable[[str], Answers],
) -> None:
    found = misfits(
        answers(
            "answers:\n"
            "  UserSendRout: [continue]\n"
            "  UserSendRoute: [continue, abor]\n"
            "  GatewayDecision: [continue]\n"
            "signals:\n"
            f"  - {{at: 1 s, id: {STOP[:-1]}}}\n"
            "messages:\n"
            "  - {at: 1 s, id: hello}\n"
            "services:\n"
            "  Detecter: [{after: 1 s}]\n"
            "behaviors:\n"
            "  DriveRout: [{after: 1 s, end: failed}]\n"
        )
    )
    assert [(line, rule) for line, rule, _, _ in found] == [
        (2, "unknown-element"),
        (3, "unknown-decision"),
        (4, "unknown-element"),
        (10, "unknown-element"),
        (12, "unknown-element"),
        (6, "unknown-signal"),
        (8, "unknown-message"),
    ]
    remedies = [remedy for *_, remedy in found]
    assert remedies[0] == "did you mean 'UserSendRoute'?"
    assert remedies[1] == "did you mean 'abort'?"
    assert found[2][2] == "'GatewayDecision'"
    assert remedies[3] == "did you mean 'Detector'?"
    assert remedies[4] == "did you mean 'DriveRoute' or 'DriveStop'?"
    assert remedies[5] == f"did you mean '{STOP}'?"
    assert remedies[6] == "there are no messages"


def test_what_to_do_with_a_behavior_after_a_restart_can_be_answered(
    answers: Callable[[str], Answers],
) -> None:
    assert misfits(answers("answers: {DriveRoute: [resume, skip, abort]}")) == []
    ((_, rule, _, remedy),) = misfits(answers("answers: {DriveRoute: [continue]}"))
    assert (rule, remedy) == ("unknown-decision", "known decisions: resume, skip, abort")


# --- visits -------------------------------------------------------------------------------------


def requested(element: str, behavior: str) -> BehaviorRequested:
    return BehaviorRequested(1, "P", element, 1, behavior, "goto", "vehicle", ("a",), {}, {})


def decision(script: Answers, run: str, prompt: str) -> str | None:
    entry = script.answer(run, "Ask", prompt)
    return None if entry is None else entry.decision


def test_a_list_is_used_visit_by_visit_and_then_used_up(
    answers: Callable[[str], Answers],
) -> None:
    script = answers(
        "answers: {Ask: [one, two]}\n"
        "services: {Look: [{after: 2 min, write: {a.b: 1}}, {error: BROKEN}]}\n"
        "behaviors: {Drive: [{after: 1.5 s, end: lost}, {after: 0 s, end: failed, error: E}]}\n"
    )
    assert [decision(script, "r1", f"p{n}") for n in range(3)] == ["one", "two", None]
    assert [script.service("r1", "Look", "Camera", f"s{n}") for n in range(3)] == [
        ServiceEntry(after=120.0, write={"a.b": 1}),
        ServiceEntry(error="BROKEN"),
        None,
    ]
    script.seen("r1", [requested("Drive", f"r1.b{n}") for n in range(3)])
    assert [script.behavior("r1", f"r1.b{n}") for n in range(3)] == [
        ("Drive", BehaviorEntry(after=1.5, end="lost")),
        ("Drive", BehaviorEntry(after=0.0, end="failed", error="E")),
        None,
    ]
    script.seen("r1", [requested("Other", "r1.b9")])
    assert script.behavior("r1", "r1.b9") is None


def test_the_same_visit_gets_the_same_entry_again(answers: Callable[[str], Answers]) -> None:
    script = answers("behaviors: {Drive: [{after: 1 s, end: lost}, {after: 2 s, end: lost}]}")
    script.seen("r1", [requested("Drive", "r1.b1"), requested("Drive", "r1.b2")])
    first = script.behavior("r1", "r1.b1")
    assert script.behavior("r1", "r1.b2") == ("Drive", BehaviorEntry(after=2.0, end="lost"))
    script.seen("r1", [requested("Drive", "r1.b1")])
    assert script.behavior("r1", "r1.b1") == first
    assert first == ("Drive", BehaviorEntry(after=1.0, end="lost"))


def test_each_run_counts_its_own_visits(answers: Callable[[str], Answers]) -> None:
    script = answers("answers: {Ask: [one, two]}")
    assert [decision(script, run, "p1") for run in ("r1", "r2")] == ["one", "one"]
    assert [decision(script, run, "p2") for run in ("r1", "r2")] == ["two", "two"]


def test_a_service_is_scripted_by_its_element_else_by_its_class(
    answers: Callable[[str], Answers],
) -> None:
    script = answers("services: {Near: [{after: 1}], Detector: [{after: 2}, {after: 3}]}")
    assert script.service("r1", "Near", "Detector", "s1") == ServiceEntry(after=1.0)
    assert script.service("r1", "Far", "Detector", "s2") == ServiceEntry(after=2.0)
    assert script.service("r1", "Near", "Detector", "s3") is None
    assert script.service("r1", "Wide", "Detector", "s4") == ServiceEntry(after=3.0)


PLACE = (1, "P", "Ask", 1)


def opened(prompt: str) -> PromptOpened:
    return PromptOpened(*PLACE, prompt, "?", ())


def test_visits_are_counted_in_the_order_of_the_journal(answers: Callable[[str], Answers]) -> None:
    script = answers("answers: {Ask: [one, two]}")
    script.seen("r1", [opened("p1"), opened("p2")])
    assert (decision(script, "r1", "p2"), decision(script, "r1", "p1")) == ("two", "one")


def test_after_a_restart_the_count_goes_on_and_open_visits_keep_their_entry(
    answers: Callable[[str], Answers],
) -> None:
    script = answers(
        "answers: {Ask: [one, two, three]}\n"
        "services: {Detector: [{after: 1}, {after: 2}]}\n"
        "behaviors: {Ask: [{after: 1, end: lost}, {after: 2, end: lost}]}\n"
    )
    script.seen(
        "r1",
        [
            opened("p1"),
            PromptAnswered(*PLACE, "p1", "one", "somebody else"),
            opened("p2"),
            ServiceRequested(*PLACE, "s1", "Detector", {}, {}),
            requested("Ask", "r1.b1"),
        ],
    )
    assert decision(script, "r1", "p3") == "three"
    assert decision(script, "r1", "p2") == "two"
    assert script.service("r1", "Ask", "Detector", "s2") == ServiceEntry(after=2.0)
    script.seen("r1", [requested("Ask", "r1.b2")])
    assert script.behavior("r1", "r1.b2") == ("Ask", BehaviorEntry(after=2.0, end="lost"))
    assert script.behavior("r1", "r1.b1") == ("Ask", BehaviorEntry(after=1.0, end="lost"))


# --- the operator and the world outside ---------------------------------------------------------


class FakeControl:
    """MissionControl as far as answers need it; writes down what was asked and when."""

    def __init__(self, clock: VirtualClock, *notices: OpenPrompt | PromptClosed) -> None:
        self.said: list[tuple[float, Any]] = []
        self.cut_off = False
        self.refuse = False
        self._clock = clock
        self._notices = list(notices)

    def _say(self, *what: Any) -> None:
        self.said.append(((self._clock.now_us() - START_US) / 1_000_000, what))
        if self.refuse:
            raise OperatorError("no")

    async def answer(self, run: str, prompt: str, decision: str, *, by: str = "") -> None:
        self._say("answer", prompt, decision, by)

    async def signal(self, signal: str, *, run: str, data: Mapping[str, Any], by: str = "") -> None:
        self._say("signal", signal, data, by)

    async def message(
        self, message: str, *, run: str, data: Mapping[str, Any], by: str = ""
    ) -> None:
        self._say("message", message, data, by)

    async def runs(self) -> list[RunSummary]:
        return [RunSummary("r1", "m", "P", RunStatus.RUNNING, START_US)]

    async def incidents(self) -> list[OpenIncident]:
        return []

    async def subscribe(self, run: str) -> AsyncIterator[OpenPrompt | PromptClosed | StampedRecord]:
        for notice in self._notices:
            yield notice
        if self.cut_off:
            self.cut_off = False
            raise OperatorError("too slow")


def prompt(number: int, element: str = "Ask") -> OpenPrompt:
    decisions = (Decision("one", "One"), Decision("two", "Two"))
    return OpenPrompt("r1", f"p{number}", element, "?", decisions)


def act(
    script: Answers,
    *notices: OpenPrompt | PromptClosed,
    default_first_decision: bool = True,
    start_us: int = START_US,
    **control_is: bool,
) -> list[tuple[float, Any]]:
    """What answers do until the executive ends and everything is sent."""

    async def main(clock: VirtualClock) -> list[tuple[float, Any]]:
        control = FakeControl(clock, *notices)
        for name, value in control_is.items():
            setattr(control, name, value)
        face: Any = control
        await script.act(face, "r1", clock, default_first_decision=default_first_decision)
        assert script.to_send == 0
        return control.said

    return run_virtual(main, start_us)


def test_prompts_are_answered_as_scripted_then_with_their_first_decision(
    answers: Callable[[str], Answers],
) -> None:
    said = act(answers("answers: {Ask: [two]}"), prompt(1), prompt(2), prompt(3, "Other"))
    assert said == [
        (0.0, ("answer", "p1", "two", BY_SCRIPT)),
        (0.0, ("answer", "p2", "one", BY_DEFAULT)),
        (0.0, ("answer", "p3", "one", BY_DEFAULT)),
    ]


def test_a_prompt_without_a_script_may_be_left_to_operators(
    answers: Callable[[str], Answers],
) -> None:
    script = answers("answers: {Ask: [two]}")
    said = act(script, prompt(1), prompt(2), default_first_decision=False)
    assert said == [(0.0, ("answer", "p1", "two", BY_SCRIPT))]


def test_an_operator_may_take_a_while(answers: Callable[[str], Answers]) -> None:
    script = answers("answers: {Ask: [{decision: two, after: 30 s}, one]}")
    assert act(script, prompt(1), prompt(2)) == [
        (0.0, ("answer", "p2", "one", BY_SCRIPT)),
        (30.0, ("answer", "p1", "two", BY_SCRIPT)),
    ]
    assert script.resolving == 0


def test_a_prompt_that_is_closed_before_its_answer_gets_none(
    answers: Callable[[str], Answers],
) -> None:
    script = answers("answers: {Ask: [{decision: two, after: 30 s}]}")
    closed = PromptClosed("r1", "p1")
    assert act(script, prompt(1), closed) == []
    assert script.resolving == 0


def test_a_rehearsal_waits_for_an_answer_that_takes_a_while(
    answers: Callable[[str], Answers],
) -> None:
    script = answers("answers: {Question: [{decision: abort, after: 90 s}]}")
    result = rehearse(scenarios.question(), None, plugins=PluginManager(), answers=script)
    answered = [
        (s.t_s, s.record.decision) for s in result.records if isinstance(s.record, PromptAnswered)
    ]
    assert answered == [(90.0, "abort")]
    assert result.summary.status is RunStatus.COMPLETED


def test_a_prompt_that_is_seen_twice_is_answered_once(answers: Callable[[str], Answers]) -> None:
    said = act(answers("answers: {Ask: [two]}"), prompt(1), cut_off=True)
    assert said == [(0.0, ("answer", "p1", "two", BY_SCRIPT))]


def test_signals_and_messages_are_sent_in_their_time(answers: Callable[[str], Answers]) -> None:
    script = answers(
        "signals: [{at: 1 min, id: s, data: {a: 1}}, {at: 0, id: s}]\n"
        "messages: [{at: 12 s, id: m, data: {b: [2]}}, {at: 60 s, id: m}]\n"
    )
    assert script.to_send == 4
    assert act(script) == [
        (0.0, ("signal", "s", {}, BY_SCRIPT)),
        (12.0, ("message", "m", {"b": [2]}, BY_SCRIPT)),
        (60.0, ("signal", "s", {"a": 1}, BY_SCRIPT)),
        (60.0, ("message", "m", {}, BY_SCRIPT)),
    ]


def test_what_is_refused_is_logged_and_the_rest_goes_on(
    answers: Callable[[str], Answers], caplog: pytest.LogCaptureFixture
) -> None:
    script = answers("answers: {Ask: [two]}\nsignals: [{at: 1, id: s}, {at: 2, id: s}]")
    assert len(act(script, prompt(1), refuse=True)) == 3
    assert [record.levelname for record in caplog.records] == ["WARNING"] * 3


@pytest.mark.parametrize(
    ("journal", "left"),
    [
        ((), ["s", "m", "s"]),
        ((SignalThrown("s", by=BY_SCRIPT),), ["m", "s"]),
        ((SignalThrown("s", by="an operator"),), ["s", "m", "s"]),
        ((InputDeferred(SignalReceived("s", by=BY_SCRIPT)),), ["m", "s"]),
        (
            (
                InputDeferred(SignalReceived("s", by=BY_SCRIPT)),
                InputDeferred(MessageReceived("m", by=BY_SCRIPT)),
                RunResumed(0),
                SignalThrown("s", by=BY_SCRIPT),
                MessageThrown("m", by=BY_SCRIPT),
            ),
            ["s"],
        ),
    ],
)
def test_after_a_restart_nothing_is_sent_twice_and_what_is_late_at_once(
    answers: Callable[[str], Answers], journal: tuple[Record, ...], left: list[str]
) -> None:
    script = answers("signals: [{at: 1, id: s}, {at: 3, id: s}]\nmessages: [{at: 2, id: m}]")
    script.seen("r1", journal)
    said = act(script, start_us=START_US + 60_000_000)
    assert [(at_s, what[1]) for at_s, what in said] == [(60.0, name) for name in left]


# --- with an executive, over a crash --------------------------------------------------------------


ROUNDS = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
  <process id="P">
    <startEvent id="S"/>
    <userTask id="Ask"><extensionElements><m2pem:prompt>Which?</m2pem:prompt>
      <m2pem:decision value="again"/><m2pem:decision value="once more"/>
      <m2pem:decision value="end"/></extensionElements></userTask>
    <serviceTask id="Look">
      <extensionElements><m2pem:service class="Detector"/></extensionElements>
    </serviceTask>
    <exclusiveGateway id="G"/>
    <endEvent id="E"/>
    <sequenceFlow id="f1" sourceRef="S" targetRef="Ask"/>
    <sequenceFlow id="f2" sourceRef="Ask" targetRef="Look"/>
    <sequenceFlow id="f3" sourceRef="Look" targetRef="G"/>
    <sequenceFlow id="f4" sourceRef="G" targetRef="Ask">
      <conditionExpression>user.decision != 'end'</conditionExpression>
    </sequenceFlow>
    <sequenceFlow id="f5" sourceRef="G" targetRef="E">
      <conditionExpression>user.decision == 'end'</conditionExpression>
    </sequenceFlow>
  </process>
</definitions>"""

THREE_ROUNDS = """
answers: {Ask: [again, once more, end]}
services: {Look: [{after: 1, write: {n: 1}}, {after: 1, write: {n: 2}}, {after: 1, write: {n: 3}}]}
"""


async def journaled(
    script: Answers, clock: VirtualClock, begun: Sequence[Entry] | None = None
) -> list[Entry]:
    """What is in the journal at the end of a run, which had `begun` when its executive died."""
    journal = MemoryJournal()
    if begun is not None:
        await journal.create(RunHeader("m.bpmn", ROUNDS, "P", created_us=START_US))
        await journal.append(begun)
        await journal.release("r1")
    nobody = Fleet("none", "none", {})
    plugins = PluginManager(block=("all",))
    scripted = ScriptedPlugins(plugins, script)
    async with Executive(nobody, journal, scripted, clock, on_records=script.seen) as executive:
        if begun is None:
            await executive.control.start(ROUNDS)
        else:
            await executive.resume("r1")
        acting = asyncio.ensure_future(
            script.act(executive.control, "r1", clock, default_first_decision=False)
        )
        await executive.control.wait("r1")
        acting.cancel()
        return [entry async for entry in journal.read("r1")]


def written(entries: Sequence[Entry]) -> list[Any]:
    records = [record for entry in entries for record in entry.records]
    return [record.value for record in records if isinstance(record, DataWritten)]


def test_wherever_a_run_breaks_off_it_goes_on_with_the_next_entries(
    answers: Callable[[str], Answers],
) -> None:
    whole = run_virtual(lambda clock: journaled(answers(THREE_ROUNDS), clock), START_US)
    assert written(whole) == ["again", 1, "once more", 2, "end", 3]
    assert len(whole) == 7
    for cut in range(1, len(whole)):
        script, begun = answers(THREE_ROUNDS), whole[:cut]
        resumed = run_virtual(lambda clock: journaled(script, clock, begun), START_US)  # noqa: B023
        assert written(resumed) == written(whole), f"after {cut} inputs"
