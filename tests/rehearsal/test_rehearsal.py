"""Rehearsals, and the samples of vehicles that they keep."""

import asyncio
import itertools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.clock import run_virtual
from m2pem.api.runs import RunStatus, StampedRecord
from m2pem.api.telemetry import VehicleState
from m2pem.engine.records import (
    BehaviorEnded,
    BehaviorRequested,
    DataWritten,
    EscalationThrown,
    FlowTaken,
    PromptOpened,
    Record,
    RunEnded,
    RunPaused,
    ServiceEnded,
    SignalThrown,
    TokenEntered,
    TokenLeft,
)
from m2pem.errors import AnswersError, MissionError, OperatorError
from m2pem.executive.executive import Executive
from m2pem.executive.loading import load_source
from m2pem.fleet.fleet import Domain, Fleet, Payload, Vehicle, simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal.memory import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.rehearsal import rehearsal
from m2pem.rehearsal.answers import load_answers
from m2pem.rehearsal.rehearsal import (
    START_US,
    RehearsalResult,
    Rehearser,
    Sampler,
    rehearse,
)
from m2pem.rehearsal.worker import rehearse_in_subprocess

SAMPLED_FROM_US = 1_000_000_000


def states_at(time_us: int) -> Iterator[VehicleState]:
    yield VehicleState(ResourceId("a"), time_us)


def test_samples_stand_at_even_times_whatever_time_jumps_over() -> None:
    sampler = Sampler(0.5, SAMPLED_FROM_US, states_at)
    for until_s in (0.2, 0.5, 0.6, 2.1):
        sampler.before(SAMPLED_FROM_US + round(until_s * 1_000_000))
    assert [each.t_s for each in sampler.samples] == [0, 0.5, 1, 1.5, 2]
    assert sampler.samples[1].vehicles[ResourceId("a")].time_us == SAMPLED_FROM_US + 500_000


def test_a_long_rehearsal_has_samples_farther_from_each_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rehearsal, "MOST_SAMPLES", 8)
    sampler = Sampler(1, SAMPLED_FROM_US, states_at)
    sampler.before(SAMPLED_FROM_US + 100_000_000)
    times = [each.t_s for each in sampler.samples]
    assert len(times) <= 8
    assert {after - before for before, after in pairwise(times)} == {16}


REPOSITORY = Path(__file__).parents[2]
VIGNETTE = REPOSITORY / "missions" / "vignette1.bpmn"
VIGNETTE_FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"
ANSWERS = REPOSITORY / "missions" / "answers"
STOP = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"

PLUGINS = PluginManager(block=("all",))

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
    ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">'
)


# --- writing missions ---------------------------------------------------------------------------


def flow(source: str, target: str, condition: str = "") -> str:
    inside = f"<conditionExpression>{condition}</conditionExpression>" if condition else ""
    ends = f'sourceRef="{source}" targetRef="{target}"'
    return f'<sequenceFlow id="{source}_{target}" {ends}>{inside}</sequenceFlow>'


def process(body: str) -> bytes:
    """A mission of one process, between whose start S and end E is `body`."""
    ends = '<startEvent id="S"/><endEvent id="E"/>'
    text = f'{HEAD}<signal id="stop"/><message id="go"/><process id="P">{ends}{body}</process>'
    return f"{text}</definitions>".encode()


def sequence(*tasks: tuple[str, str]) -> bytes:
    """Tasks (id, xml) one after the other."""
    path = ["S", *(name for name, _ in tasks), "E"]
    flows = (flow(a, b) for a, b in itertools.pairwise(path))
    return process("".join([*(xml for _, xml in tasks), *flows]))


def behavior(element: str, name: str, resource: str = "ugv1", **parameters: str) -> tuple[str, str]:
    kind = "payload" if "/" in resource else "vehicle"
    values = "".join(f'<property name="{k}" value="{v}"/>' for k, v in parameters.items())
    role = f'<role name="doer" {kind}="{resource}"/>' if resource else ""
    return element, (
        f'<scriptTask id="{element}"><extensionElements><m2pem:behavior type="{kind}"'
        f' name="{name}"><properties>{values}</properties><resources>{role}</resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def service(element: str, name: str) -> tuple[str, str]:
    call = f'<extensionElements><m2pem:service class="{name}"/></extensionElements>'
    return element, f'<serviceTask id="{element}">{call}</serviceTask>'


def question(element: str) -> tuple[str, str]:
    decisions = "".join(f'<m2pem:decision value="{each}"/>' for each in ("one", "two", "three"))
    inside = f"<extensionElements><m2pem:prompt>?</m2pem:prompt>{decisions}</extensionElements>"
    return element, f'<userTask id="{element}">{inside}</userTask>'


def catch(element: str, definition: str) -> tuple[str, str]:
    return element, f'<intermediateCatchEvent id="{element}">{definition}</intermediateCatchEvent>'


def fleet(detector: Mapping[str, Any] | None = None) -> Fleet:
    """One ground vehicle with a camera, and a detector with these settings."""
    vehicle, camera, gpr = ResourceId("ugv1"), ResourceId("ugv1/camera"), ResourceId("ugv1/gpr")
    return Fleet(
        "test",
        "test.yaml",
        {vehicle: Vehicle(vehicle, Domain.GROUND, "ros", {}, payloads=(camera, gpr))},
        {
            camera: Payload(camera, vehicle, "ptz", {}),
            gpr: Payload(gpr, vehicle, "ros", detector or {}, detector=True),
        },
        origin=(38.1, -77.3, 0.0),
    )


Rehearse = Callable[..., RehearsalResult]


@pytest.fixture
def play(tmp_path: Path) -> Rehearse:
    """Rehearses a mission with answers given as text."""

    def play(
        mission: bytes | Path, answers: str = "", on: Fleet | None = None, **options: Any
    ) -> RehearsalResult:
        path = tmp_path / "answers.yaml"
        path.write_text(answers, encoding="utf-8")
        return rehearse(mission, on, plugins=PLUGINS, answers=path, **options)

    return play


def of(result: RehearsalResult, kind: type[Record]) -> Iterator[tuple[float, Any]]:
    return ((s.t_s, s.record) for s in result.records if isinstance(s.record, kind))


# --- the paper's execution example (section 4.4) --------------------------------------------------


def trace(result: RehearsalResult) -> list[tuple[Any, ...]]:
    """The token game alone: who came where, left how, took which flow, and what was thrown."""
    lines: list[tuple[Any, ...]] = []
    for stamped in result.records:
        match stamped.record:
            case TokenEntered() as record:
                lines.append(("enter", record.element, record.token))
            case TokenLeft() as record:
                lines.append(("leave", record.element, record.token, record.outcome.value))
            case FlowTaken() as record:
                lines.append(("take", record.flow, record.token))
            case SignalThrown() as record:
                lines.append(("signal", record.element, record.token))
            case EscalationThrown() as record:
                lines.append(("escalation", record.element, record.token))
            case _:
                pass
    return lines


def through(token: int, element: str, flow: str) -> list[tuple[Any, ...]]:
    """A token comes to an element, completes it, and takes a flow."""
    return [
        ("enter", element, token),
        ("leave", element, token, "completed"),
        ("take", flow, token),
    ]


# "The child token immediately uses the sequence flow to move onto ... USER SEND ROUTE"; the
# operator's decision leads it over the exclusive gateway.
BEGINNING = through(1, "StartVignette1", "FlowToSendRoute")
CONTINUED = [
    *through(1, "UserSendRoute", "FlowToDecision"),
    *through(1, "GatewayDecision", "FlowContinue"),
]
# "... would follow the sequence flow that bypasses the next block and arrive at the terminating
# end event"
ABORTED = [
    *through(1, "UserSendRoute", "FlowToDecision"),
    *through(1, "GatewayDecision", "FlowAbort"),
    ("enter", "EndMission", 1),
    ("leave", "EndMission", 1, "completed"),
]
# "This call activity spawns a new token for the process labeled DETECTION ... A new token is
# generated to follow the path that leads to ... DETECTOR, while the token processing the parallel
# gateway moves onto ... DRIVE ROUTE."
CALLED = [
    ("enter", "CallDetection", 1),
    *through(2, "StartDetection", "FlowToFork"),
    *through(2, "ForkDetection", "FlowToDriveRoute"),
    ("enter", "DriveRoute", 2),
    ("take", "FlowToDetector", 3),
]
DETECTED = [
    # "If not, the token proceeds along a path that returns it to the service task."
    *through(3, "Detector", "FlowToType"),
    *through(3, "GatewayDetection", "FlowOtherType"),
    # "Otherwise, the token proceeds to an intermediate signal throw event."
    *through(3, "Detector", "FlowToType"),
    *through(3, "GatewayDetection", "FlowGpr"),
    ("enter", "ThrowStop", 3),
    ("signal", "ThrowStop", 3),
    # "If the signal event is triggered, the token proceeds along the alternate path to another
    # script task labeled DRIVE STOP", while the other "proceeds to the parallel gateway".
    ("leave", "DriveRoute", 2, "interrupted"),
    ("enter", "SignalStop", 2),
    ("leave", "ThrowStop", 3, "completed"),
    ("take", "FlowSignalled", 3),
    ("enter", "JoinDetection", 3),
    ("leave", "SignalStop", 2, "completed"),
    ("take", "FlowToDriveStop", 2),
    *through(2, "DriveStop", "FlowStopped"),
    # There, it "is consumed", and "since all pathways to the parallel gateway have been activated,
    # this token proceeds to the end event, which emits an escalation".
    ("enter", "JoinDetection", 2),
    ("leave", "JoinDetection", 3, "completed"),
    ("leave", "JoinDetection", 2, "completed"),
    ("take", "FlowToEndDetected", 2),
    ("enter", "EndDetected", 2),
    ("escalation", "EndDetected", 2),
    ("leave", "EndDetected", 2, "completed"),
    # "Consequently, the token on the call activity follows the path along the boundary event to
    # the script task labeled REVERSE and eventually back to ... USER SEND ROUTE."
    ("leave", "CallDetection", 1, "interrupted"),
    *through(1, "EscalationDetected", "FlowToReverse"),
    *through(1, "Reverse", "FlowTryAgain"),
]
# "When the DRIVE ROUTE script task concludes, the token will arrive at a terminating end event for
# this subprocess, which would then allow the token in the main process on the call activity to
# proceed to the terminating end event of the main process and conclude the mission."
DRIVEN = [
    ("enter", "Detector", 3),
    ("leave", "DriveRoute", 2, "completed"),
    ("take", "FlowToEndRoute", 2),
    ("enter", "EndRoute", 2),
    ("leave", "EndRoute", 2, "completed"),
    ("leave", "Detector", 3, "terminated"),
    ("leave", "CallDetection", 1, "completed"),
    ("take", "FlowRouteDriven", 1),
    ("enter", "EndMission", 1),
    ("leave", "EndMission", 1, "completed"),
]


@pytest.mark.parametrize(
    ("answers", "expected"),
    [
        ("detection", [*BEGINNING, *CONTINUED, *CALLED, *DETECTED, *ABORTED]),
        ("abort", [*BEGINNING, *ABORTED]),
        ("route", [*BEGINNING, *CONTINUED, *CALLED, *DRIVEN]),
    ],
)
def test_the_papers_example_moves_its_tokens_as_the_paper_says(
    answers: str, expected: list[tuple[Any, ...]]
) -> None:
    result = rehearse(
        VIGNETTE,
        load_fleet(VIGNETTE_FLEET),
        plugins=PLUGINS,
        answers=ANSWERS / f"vignette1_{answers}.yaml",
    )
    assert trace(result) == expected
    assert (result.summary.status, result.exit_status) == (RunStatus.TERMINATED, 0)


def test_the_papers_example_commands_the_vehicle_and_writes_the_data() -> None:
    result = rehearse(
        VIGNETTE,
        load_fleet(VIGNETTE_FLEET),
        plugins=PLUGINS,
        answers=ANSWERS / "vignette1_detection.yaml",
    )
    assert [(r.name, r.resources) for _, r in of(result, BehaviorRequested)] == [
        ("single_vehicle_routing", ("evsg1",)),
        ("drive_stop", ("evsg1",)),
        ("reverse", ("evsg1",)),
    ]
    assert [r.state for _, r in of(result, BehaviorEnded)] == [
        "CANCELLED",
        "SUCCEEDED",
        "SUCCEEDED",
    ]
    assert [(t_s, r.key, r.value) for t_s, r in of(result, DataWritten)][:3] == [
        (0.0, "user.decision", "continue"),
        (5.0, "detection.type", "camera"),
        (9.0, "detection.type", "gpr"),
    ]


def test_many_rehearsals_of_a_mission_checked_once_are_as_each_by_itself() -> None:
    fleet = load_fleet(VIGNETTE_FLEET)
    rehearser = Rehearser(load_source(VIGNETTE), fleet, PLUGINS)
    for name in ("detection", "abort", "route", "detection"):
        answers = ANSWERS / f"vignette1_{name}.yaml"
        alone = rehearse(VIGNETTE, fleet, plugins=PLUGINS, answers=answers)
        assert rehearser.rehearse(answers=answers).records == alone.records


def test_each_rehearsal_of_a_rehearser_has_its_own_data() -> None:
    choose = '<exclusiveGateway id="G" default="G_E"/>'
    flows = flow("S", "G") + flow("G", "Ask", "speed &gt; 1") + flow("G", "E") + flow("Ask", "E")
    mission = load_source(process(choose + question("Ask")[1] + flows))
    rehearser = Rehearser(mission, None, PLUGINS)
    for speed, asked in ((2, 1), (0, 0)):
        result = rehearser.rehearse(data={"speed": speed})
        assert len(list(of(result, PromptOpened))) == asked


# --- the world outside ----------------------------------------------------------------------------


def test_a_rehearsal_begins_at_its_date_and_takes_no_time(play: Rehearse) -> None:
    timer = "<timerEventDefinition><timeDuration>P400D</timeDuration></timerEventDefinition>"
    result = play(sequence(catch("Wait", timer)))
    assert result.summary.started_us == START_US == 1_767_225_600 * 1_000_000
    assert result.records[-1].t_s == 400 * 86_400
    later = play(sequence(catch("Wait", timer)), start_us=START_US + 5)
    assert later.summary.ended_us == (result.summary.ended_us or 0) + 5


def test_a_prompt_without_a_script_takes_its_first_decision(play: Rehearse) -> None:
    result = play(sequence(question("Ask"), question("Other")), "answers: {Ask: [two]}")
    assert [r.value for _, r in of(result, DataWritten)] == ["two", "one"]


def test_two_instances_at_once_take_their_entries_first_come_first_served(play: Rehearse) -> None:
    again = flow("G", "Ask").replace('id="G_Ask"', 'id="again"')
    flows = flow("S", "G") + flow("G", "Ask") + again + flow("Ask", "E")
    mission = process(f'<parallelGateway id="G"/>{question("Ask")[1]}{flows}')
    result = play(mission, "answers: {Ask: [two, three]}")
    assert [r.value for _, r in of(result, DataWritten)] == ["two", "three"]
    assert result.summary.status is RunStatus.COMPLETED


def test_a_service_without_a_script_completes_and_is_not_run(play: Rehearse) -> None:
    result = play(
        sequence(service("Look", "Unheard"), service("Again", "Unheard")),
        "services: {Unheard: [{after: 3 s, write: {found.type: gpr, found.at: [1, 2]}}]}",
    )
    assert [t_s for t_s, _ in of(result, ServiceEnded)] == [3.0, 3.0]
    assert {r.key: r.value for _, r in of(result, DataWritten)} == {
        "found.type": "gpr",
        "found.at": [1, 2],
    }


def test_a_service_and_a_behavior_fail_as_scripted(play: Rehearse) -> None:
    failed = play(sequence(service("Look", "Camera")), "services: {Look: [{error: BROKEN}]}")
    assert failed.exit_status == 1
    assert "error BROKEN from Look" in failed.summary.detail
    drive = sequence(behavior("Drive", "goto", target="[38.101, -77.3, 0]"))
    script = "behaviors: {Drive: [{after: 7 s, end: failed, error: ROUTE_BLOCKED}]}"
    blocked = play(drive, script, fleet())
    assert [(t_s, r.code) for t_s, r in of(blocked, BehaviorEnded)] == [(7.0, "ROUTE_BLOCKED")]
    assert play(drive, "", fleet()).summary.status is RunStatus.COMPLETED


@pytest.mark.parametrize(
    ("kind", "definition"),
    [
        ("signals", '<signalEventDefinition signalRef="stop"/>'),
        ("messages", '<messageEventDefinition messageRef="go"/>'),
    ],
)
def test_signals_and_messages_come_when_they_are_scripted(
    play: Rehearse, kind: str, definition: str
) -> None:
    name = "stop" if kind == "signals" else "go"
    script = f"{kind}: [{{at: 12 s, id: {name}, data: {{a.b: 1}}}}]"
    result = play(sequence(catch("Catch", definition)), script)
    assert [(t_s, r.key, r.value) for t_s, r in of(result, DataWritten)] == [(12.0, "a.b", 1)]
    assert result.exit_status == 0


@pytest.mark.parametrize(
    ("settings", "found_after_s"),
    [
        ({"detections": [{"at": "40 s", "type": "gpr"}]}, 40.0),
        # North of the vehicle, on the way of a drive that never ends.
        ({"targets": [{"type": "gpr", "position": [38.101, -77.3]}]}, 25.0),
    ],
)
def test_a_detector_without_a_script_waits_for_its_simulated_payload(
    play: Rehearse, settings: Mapping[str, Any], found_after_s: float
) -> None:
    fork = '<parallelGateway id="G"/><endEvent id="Done"><terminateEventDefinition/></endEvent>'
    drive = behavior("Drive", "area_observe", target="[38.102, -77.3, 0]")[1]
    flows = [("S", "G"), ("G", "Drive"), ("G", "Detector"), ("Drive", "E"), ("Detector", "Done")]
    body = fork + drive + service("Detector", "Detector")[1]
    mission = process(body + "".join(itertools.starmap(flow, flows)))
    result = play(mission, "", fleet(settings))
    assert result.summary.status is RunStatus.TERMINATED
    ((t_s, _),) = of(result, ServiceEnded)
    assert t_s == pytest.approx(found_after_s, rel=0.2)
    assert {r.key: r.value for _, r in of(result, DataWritten)}["detection.type"] == "gpr"


def test_a_link_that_is_lost_is_told_without_telemetry(play: Rehearse) -> None:
    on = fleet()
    vehicle = on.vehicles[ResourceId("ugv1")]
    faults = {"faults": [{"kind": "lose_link", "after": "5 s"}]}
    broken = Vehicle(vehicle.id, vehicle.domain, "ros", faults, lost_after_s=4.0)
    lost = Fleet("test", "test.yaml", {vehicle.id: broken}, origin=on.origin)
    result = play(sequence(behavior("Drive", "goto", target="[38.12, -77.3, 0]")), "", lost)
    assert [(t_s, r.code) for t_s, r in of(result, BehaviorEnded)] == [(9.0, "LINK_LOST")]


# --- how it ends ----------------------------------------------------------------------------------


WAITING = {
    "a message": (sequence(catch("Catch", '<messageEventDefinition messageRef="go"/>')), ""),
    "a behavior without an end": (sequence(behavior("Catch", "follow", target="lead")), ""),
    "a gaze without an end": (
        sequence(behavior("Catch", "ptz_track", "ugv1/camera", target="lead")),
        "",
    ),
    "a behavior that stalls": (
        sequence(behavior("Catch", "goto", target="[38.2, -77.3, 0]")),
        "behaviors: {Catch: [{after: 9 s, end: stalled}]}",
    ),
    "a detection": (sequence(service("Catch", "Detector")), ""),
}


@pytest.mark.parametrize(("mission", "script"), WAITING.values(), ids=WAITING)
def test_what_waits_for_something_that_never_comes_fails_and_is_named(
    play: Rehearse, mission: bytes, script: str
) -> None:
    on = fleet()
    lead = ResourceId("lead")
    on = Fleet(
        "test",
        "test.yaml",
        {**on.vehicles, lead: Vehicle(lead, Domain.GROUND, "ros", {}, manned=True)},
        on.payloads,
        origin=on.origin,
    )
    result = play(mission, script, on)
    assert (result.summary.status, result.exit_status) == (RunStatus.FAILED, 1)
    assert result.summary.detail.startswith("nothing that is scheduled can happen any more")
    assert "Catch (" in result.summary.detail
    assert result.records[-1].t_s < 60


def test_a_search_that_finds_nothing_is_given_up_within_an_hour(play: Rehearse) -> None:
    mission = sequence(behavior("Patrol", "area_observe", target="[38.102, -77.3, 0]"))
    away = {"targets": [{"type": "gpr", "position": [39.0, -77.3]}]}
    result = play(mission, "", fleet(away))
    assert result.summary.status is RunStatus.FAILED
    ((ended_s, _),) = of(result, RunEnded)
    assert ended_s <= 3700


@pytest.mark.parametrize("max_steps", [50, 25_000])
def test_a_loop_that_takes_no_time_is_bounded_by_its_steps(play: Rehearse, max_steps: int) -> None:
    body = '<exclusiveGateway id="G"/><task id="T"/>'
    flows = flow("S", "G") + flow("G", "E", "over") + flow("G", "T") + flow("T", "G")
    result = play(process(body + flows), max_steps=max_steps)
    assert result.summary.status is RunStatus.FAILED
    assert f"the {max_steps} steps that are allowed" in result.summary.detail
    # Three records a step; steps are bounded in batches.
    assert 3 * max_steps <= result.summary.records <= 3 * (max_steps + 10_000)


def test_a_run_that_is_paused_as_it_never_waits_fails_and_says_so(play: Rehearse) -> None:
    body = '<exclusiveGateway id="G"/><task id="T"/>'
    flows = flow("S", "G") + flow("G", "E", "over") + flow("G", "T") + flow("T", "G")
    bounded = replace(fleet(), steps_between_waits=200)
    result = play(process(body + flows), "", bounded)
    ((_, paused),) = of(result, RunPaused)
    assert "steps and did not wait once" in paused.by
    assert result.summary.status is RunStatus.FAILED
    assert result.summary.detail == "the run is paused, and nothing resumes it"


def test_a_loop_that_takes_time_is_bounded_too(play: Rehearse) -> None:
    timer = "<timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>"
    body = '<exclusiveGateway id="G"/>' + catch("T", timer)[1]
    flows = flow("S", "G") + flow("G", "T") + flow("T", "G") + flow("G", "E", "false")
    result = play(process(body + flows), max_steps=300)
    assert result.summary.status is RunStatus.FAILED
    assert 100 <= result.records[-1].t_s <= 200


def test_tokens_that_are_stuck_fail_the_run_at_once(play: Rehearse) -> None:
    body = '<exclusiveGateway id="X"/><parallelGateway id="J"/><task id="T"/>'
    flows = [("S", "X"), ("X", "J"), ("X", "T"), ("T", "J"), ("J", "E")]
    result = play(process(body + "".join(itertools.starmap(flow, flows))))
    assert result.summary.status is RunStatus.FAILED
    assert "J" in result.summary.detail


# --- what is refused ------------------------------------------------------------------------------


def test_a_mission_that_commands_nothing_needs_no_fleet(play: Rehearse) -> None:
    wait = behavior("Wait", "hold", "", duration="30 s")
    result = play(sequence(wait, question("Ask"), service("Look", "Camera")))
    assert result.summary.status is RunStatus.COMPLETED
    assert result.records[-1].t_s == 30.0


def test_a_mission_that_commands_something_says_where_it_needs_a_fleet(play: Rehearse) -> None:
    look = service("Look", "Camera")[1].replace(
        'class="Camera"/>',
        'class="Camera"><m2pem:role name="r" payload="ugv1/camera"/></m2pem:service>',
    )
    mission = sequence(behavior("Drive", "goto", target="x"), ("Look", look))
    with pytest.raises(MissionError) as caught:
        play(mission)
    assert [(f.element, f.rule) for f in caught.value.findings] == [
        ("Drive", "needs-fleet"),
        ("Look", "needs-fleet"),
    ]


def test_a_mission_that_does_not_fit_the_fleet_is_refused(play: Rehearse) -> None:
    with pytest.raises(MissionError, match="ugv9"):
        play(sequence(behavior("Drive", "hold", "ugv9")), "", fleet())


def test_an_unknown_process_is_refused(play: Rehearse) -> None:
    with pytest.raises(MissionError, match="there is no process 'Q'"):
        play(sequence(question("Ask")), process="Q")


def test_answers_that_do_not_fit_the_mission_are_refused(play: Rehearse) -> None:
    with pytest.raises(AnswersError, match="did you mean 'Ask'"):
        play(sequence(question("Ask")), "answers: {Aks: [one]}")


# --- who is told ----------------------------------------------------------------------------------


def test_records_are_told_as_they_are_committed_and_not_kept(play: Rehearse) -> None:
    told: list[StampedRecord] = []
    result = play(sequence(question("Ask")), on_record=told.append, data={"a": {"b": 1}})
    assert result.records == ()
    assert [stamped.seq for stamped in told] == list(range(1, result.summary.records + 1))
    assert {stamped.run for stamped in told} == {"r1"}
    written = [s.record for s in told if isinstance(s.record, DataWritten)]
    assert (written[0].key, written[0].value) == ("a.b", 1)


def test_what_a_listener_raises_ends_the_rehearsal(play: Rehearse) -> None:
    told: list[StampedRecord] = []

    def listen(stamped: StampedRecord) -> None:
        told.append(stamped)
        if len(told) == 5:
            raise BrokenPipeError

    timer = "<timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>"
    body = '<exclusiveGateway id="G"/>' + catch("T", timer)[1]
    flows = flow("S", "G") + flow("G", "T") + flow("T", "G") + flow("G", "E", "false")
    with pytest.raises(BrokenPipeError):
        play(process(body + flows), on_record=listen)
    assert len(told) == 5


class Observing(PluginManager):
    """Counts what observers are told."""

    def __init__(self) -> None:
        super().__init__(block=("all",))
        self.told = 0

    def records_committed(self, run_id: str, records: Any) -> None:
        self.told += len(records)


@pytest.mark.parametrize("observed", [True, False])
def test_observers_are_told_when_asked_to(observed: bool) -> None:
    plugins = Observing()
    result = rehearse(sequence(question("Ask")), None, plugins=plugins, observed=observed)
    assert plugins.told == (result.summary.records if observed else 0)


# --- the same every time --------------------------------------------------------------------------


SCRIPT = """
import sys
from pathlib import Path
from m2pem.journal.codec import record_line
from m2pem.plugins import PluginManager
from m2pem.fleet.fleet_file import load_fleet
from m2pem.rehearsal.worker import rehearse_in_subprocess
from m2pem.rehearsal.rehearsal import rehearse

def show(stamped):
    t_us = round(stamped.t_s * 1_000_000)
    sys.stdout.buffer.write(record_line(stamped.run, stamped.seq, t_us, stamped.record) + b"\\n")

mission, fleet, answers = map(Path, sys.argv[1:])
rehearse(mission, load_fleet(fleet), plugins=PluginManager(block=("all",)), answers=answers,
         on_record=show)
"""


@pytest.mark.long  # the command `simulate` shows it of the same mission
def test_two_processes_print_the_same_bytes() -> None:
    outputs = {
        subprocess.run(
            [
                sys.executable,
                "-c",
                SCRIPT,
                VIGNETTE,
                VIGNETTE_FLEET,
                ANSWERS / "vignette1_detection.yaml",
            ],
            cwd=REPOSITORY,
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(REPOSITORY)},
            stdout=subprocess.PIPE,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    (output,) = outputs
    assert b"terminated by mission ended" in output


# --- beside live missions -------------------------------------------------------------------------


def test_an_executive_rehearses_a_mission_with_its_fleet(tmp_path: Path) -> None:
    answers = tmp_path / "answers.yaml"
    answers.write_text("answers: {Ask: [two]}", encoding="utf-8")
    mission = sequence(question("Ask"), behavior("Drive", "goto", target="[38.101, -77.3, 0]"))
    plugins = Observing()

    async def main(clock: Any) -> tuple[RehearsalResult, list[Any]]:
        executive = Executive(
            simulated_fleet(fleet()),
            MemoryJournal(),
            plugins,
            clock,
            rehearse=rehearse_in_subprocess,
        )
        async with executive:
            result: Any = await executive.control.simulate(mission, answers=answers)
            return result, list(await executive.control.runs())

    async def real() -> tuple[RehearsalResult, list[Any]]:
        from m2pem.api.clock import SystemClock

        return await main(SystemClock())

    result, runs = asyncio.run(real())
    assert result.summary.status is RunStatus.COMPLETED
    assert [r.value for _, r in of(result, DataWritten)] == ["two"]
    assert runs == []
    assert plugins.told == 0


def test_an_executive_without_rehearsals_says_so() -> None:
    async def main(clock: Any) -> None:
        executive = Executive(Fleet("", "no fleet", {}), MemoryJournal(), PLUGINS, clock)
        async with executive:
            with pytest.raises(OperatorError, match="cannot rehearse"):
                await executive.control.simulate(b"")

    run_virtual(main, START_US)


def test_answers_that_were_loaded_can_be_handed_in() -> None:
    answers = load_answers(ANSWERS / "vignette1_abort.yaml")
    result = rehearse(VIGNETTE, load_fleet(VIGNETTE_FLEET), plugins=PLUGINS, answers=answers)
    assert result.summary.status is RunStatus.TERMINATED


# --- other vehicles than the fleet's --------------------------------------------------------------


NEAR = "{&quot;type&quot;: &quot;Point&quot;, &quot;coordinates&quot;: [-77.3, 38.101]}"
FAR = NEAR.replace("38.101", "38.11")


def test_answers_change_the_settings_of_simulated_vehicles(play: Rehearse) -> None:
    drive = sequence(behavior("Drive", "goto", target=NEAR))
    as_it_is = play(drive, on=fleet())
    slow = play(drive, "vehicles: {ugv1: {cruise_speed: 1 m/s}}", on=fleet())
    assert slow.records[-1].t_s > 3 * as_it_is.records[-1].t_s
    empty = play(drive, "vehicles: {ugv1: {battery: 0 %}}", on=fleet())
    assert [record.code for _, record in of(empty, BehaviorEnded)] == ["BATTERY_LOW"]


def test_a_link_is_lost_and_restored_by_the_answers(play: Rehearse) -> None:
    drive = sequence(behavior("Drive", "goto", target=NEAR))
    lost = play(drive, "vehicles: {ugv1: {link_lost: [{at: 5 s}]}}", on=fleet())
    assert [(t_s, record.code) for t_s, record in of(lost, BehaviorEnded)] == [(8.0, "LINK_LOST")]
    restored = play(drive, "vehicles: {ugv1: {link_lost: [{at: 5 s, for: 2 s}]}}", on=fleet())
    assert restored.summary.status is RunStatus.COMPLETED


def test_a_wind_against_an_aircraft_lengthens_its_way_and_one_too_strong_stops_it(
    play: Rehearse,
) -> None:
    fly = sequence(behavior("Fly", "goto", resource="uav1", target=FAR))
    uav = ResourceId("uav1")
    aircraft = Fleet(
        "test",
        "test.yaml",
        {uav: Vehicle(uav, Domain.AIR, "sim", {"cruise_speed": "20 m/s", "altitude": "30 m"})},
        {},
        origin=(38.1, -77.3, 0.0),
    )
    took_s = {
        direction: play(fly, f"wind: {{speed: 10 m/s, from: {direction} deg}}", on=aircraft)
        .records[-1]
        .t_s
        for direction in (0, 90, 180)
    }
    calm_s = play(fly, on=aircraft).records[-1].t_s
    # 1110 m north at 20 m/s; against 10 m/s at 10 m/s; across it at 17.3 m/s.
    assert took_s[0] - calm_s == pytest.approx(1110 / 10 - 1110 / 20, rel=0.1)
    assert took_s[90] - calm_s == pytest.approx(1110 / 17.32 - 1110 / 20, rel=0.2)
    assert took_s[180] == calm_s
    storm = play(fly, "wind: {speed: 25 m/s}", on=aircraft)
    assert [record.code for _, record in of(storm, BehaviorEnded)] == ["WIND"]


def test_a_mission_without_a_take_off_ends_as_over_mavlink(play: Rehearse) -> None:
    fly = sequence(behavior("Fly", "goto", resource="uav1", target=FAR))
    uav = Vehicle(ResourceId("uav1"), Domain.AIR, "sim", {})
    fleet = Fleet("test", "test.yaml", {uav.id: uav}, {}, origin=(38.1, -77.3, 0.0))
    played = play(fly, on=fleet)
    assert played.summary.status is RunStatus.FAILED
    assert [record.code for _, record in of(played, BehaviorEnded)] == ["REJECTED"]
    assert "take off first" in played.summary.detail


@pytest.mark.parametrize(
    ("answers", "message"),
    [
        ("vehicles: {ugv2: {battery: 10 %}}", "no vehicle or payload 'ugv2'"),
        ("vehicles:\n  ugv1: {batery: 10 %}", "answers.yaml:2: .*did you mean 'battery'"),
        ("vehicles:\n  ugv1: {battery: 10 deg}", "answers.yaml:2: vehicles.ugv1.battery"),
        ("wind: {speed: 5 kg}", "wind.speed"),
        ("vehicles: {ugv1: {link_lost: [{for: 3 s}]}}", "'at' is missing"),
    ],
)
def test_settings_that_no_simulated_vehicle_has_are_refused(
    play: Rehearse, answers: str, message: str
) -> None:
    with pytest.raises(AnswersError, match=message):
        play(sequence(behavior("Stop", "drive_stop")), answers, on=fleet())


def test_a_behavior_of_which_an_entry_says_nothing_takes_its_own_time(play: Rehearse) -> None:
    drive = sequence(behavior("Drive", "goto", target=NEAR))
    as_it_is = play(drive, on=fleet())
    assert play(drive, "behaviors: {Drive: [{end: simulated}]}", on=fleet()).records == (
        as_it_is.records
    )


def test_a_behavior_takes_so_many_times_as_long_for_the_same_way(play: Rehearse) -> None:
    drive = sequence(behavior("Drive", "goto", target=NEAR))
    as_it_is = play(drive, on=fleet())
    slower = play(drive, "behaviors: {Drive: [{end: simulated, factor: 1.5}]}", on=fleet())
    assert as_it_is.summary.took_s is not None
    assert slower.summary.took_s == pytest.approx(1.5 * as_it_is.summary.took_s)
    with pytest.raises(AnswersError, match="'factor' goes with 'end: simulated', not failed"):
        play(drive, "behaviors: {Drive: [{after: 1 s, end: failed, factor: 2}]}", on=fleet())
    with pytest.raises(AnswersError, match="Drive"):
        play(drive, "behaviors: {Drive: [{end: simulated, factor: 0}]}", on=fleet())
