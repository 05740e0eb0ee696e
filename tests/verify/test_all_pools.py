"""All pools of a collaboration are begun together where that is asked for, and else named."""

import pytest

from m2pem.bpmn import parse_mission
from m2pem.mission.mission import Mission
from m2pem.scripting.verification import VerificationResult, verify

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
    ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">'
)
SENT = '<messageEventDefinition messageRef="M"/>'
ENGINES = ("builtin", "spin")


def flow(source: str, target: str) -> str:
    return f'<sequenceFlow id="{source}-{target}" sourceRef="{source}" targetRef="{target}"/>'


def mission(other: str, *, own: str = "", pools: str = "A B", collaboration: str = "") -> Mission:
    """Process A waits for message M; process B is `other`."""
    waits = (
        f'<startEvent id="sa"/><intermediateCatchEvent id="wait">{SENT}</intermediateCatchEvent>'
        f'<endEvent id="ea">{own}</endEvent>{flow("sa", "wait")}{flow("wait", "ea")}'
    )
    named = "".join(
        f'<participant id="pool{each}" name="Pool {each}" processRef="{each}"/>'
        for each in pools.split()
    )
    drawn = f'<collaboration id="C"{collaboration}>{named}</collaboration>' if pools else ""
    text = (
        f'{HEAD}<message id="M"/><message id="N"/>{drawn}'
        f'<process id="A" isExecutable="true">{waits}</process>'
        f'<process id="B" isExecutable="true">{other}</process></definitions>'
    )
    return parse_mission(text.encode(), "pools.bpmn")


SENDS = (
    f'<startEvent id="sb"/><intermediateThrowEvent id="send">{SENT}</intermediateThrowEvent>'
    f'<endEvent id="eb"/>{flow("sb", "send")}{flow("send", "eb")}'
)
TERMINATES = SENDS.replace(
    '<endEvent id="eb"/>', '<endEvent id="eb"><terminateEventDefinition/></endEvent>'
)
STUCK = (
    f'<startEvent id="sb"/><intermediateThrowEvent id="send">{SENT}</intermediateThrowEvent>'
    '<intermediateCatchEvent id="reply"><messageEventDefinition messageRef="N"/>'
    f'</intermediateCatchEvent><endEvent id="eb"/>{flow("sb", "send")}{flow("send", "reply")}'
    f"{flow('reply', 'eb')}"
)
"""It waits for an answer that nothing sends."""


def violated(found: VerificationResult) -> set[str]:
    return {
        each["property"]
        for each in found.properties
        if each["verdict"] == "violated" and not each["warning"]
    }


def notes(found: VerificationResult) -> list[str]:
    return [each for each in found.findings.coverage.notes if "egin" in each]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_pool_that_nothing_begins_is_named(engine: str) -> None:
    found = verify(mission(SENDS), engine=engine)  # type: ignore[arg-type]
    assert {"no-deadlock", "can-complete", "no-dead-element"} <= violated(found)
    (note,) = notes(found)
    assert note == (
        "pool Pool B (process B) is not begun: a run begins with A, nothing calls B, and it has no "
        "trigger; --all-pools begins it, too"
    )
    assert found.to_dict()["together"] == []


@pytest.mark.parametrize("engine", ENGINES)
def test_all_pools_begin_with_the_run_where_that_is_asked_for(engine: str) -> None:
    found = verify(mission(SENDS), all_pools=True, engine=engine)  # type: ignore[arg-type]
    assert found.holds, str(found)
    (note,) = notes(found)
    assert note == (
        "pool Pool B (process B) begins with the run here; a run of the executive does not begin it"
    )
    assert found.to_dict()["together"] == ["B"]


def test_a_file_can_ask_for_that() -> None:
    assert verify(mission(SENDS, collaboration=' m2pem:allPools="true"')).holds
    assert not verify(mission(SENDS, collaboration=' m2pem:allPools="false"')).holds


def test_a_process_that_is_no_pool_is_named_and_not_begun() -> None:
    found = verify(mission(SENDS, pools="A"), all_pools=True)
    assert "no-deadlock" in violated(found)
    (note,) = notes(found)
    assert note.startswith("process B is not begun:")
    assert "--all-pools" not in note


@pytest.mark.parametrize("engine", ENGINES)
def test_the_run_is_over_when_all_pools_are(engine: str) -> None:
    found = verify(mission(STUCK), all_pools=True, engine=engine)  # type: ignore[arg-type]
    assert "no-deadlock" in violated(found)
    assert "reply" in str(found)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_terminate_end_event_ends_its_own_pool_alone(engine: str) -> None:
    found = verify(mission(TERMINATES), all_pools=True, engine=engine)  # type: ignore[arg-type]
    assert found.holds, str(found)


def test_a_triggered_start_begins_more_instances_beside_the_one_of_the_run() -> None:
    both = (
        SENDS.replace(flow("sb", "send"), "")
        + f'<startEvent id="again">{SENT}</startEvent><exclusiveGateway id="x"/>'
        + flow("sb", "x")
        + flow("again", "x")
        + flow("x", "send")
    )
    found = verify(mission(both), all_pools=True)
    reached = {each for each in ("sb", "again", "send") if each not in found.findings.unreached}
    assert reached == {"sb", "again", "send"}
    assert "again" in verify(mission(both)).findings.unreached or not verify(mission(both)).holds


def test_a_requirement_may_be_about_another_pool() -> None:
    spec = b"requirements: [{id: r, ltl: '<> completed(send)'}]"
    assert verify(mission(SENDS), requirements=spec, all_pools=True).holds
    found = verify(mission(SENDS), requirements=spec)
    assert "r" in violated(found)
