"""Rules between messages of other protocols and events of missions."""

import asyncio
from typing import Any

import pytest

from m2pem.api.event_rules import (
    UNKNOWN,
    AnswerRule,
    EventThrower,
    ReceiveRule,
    SendRule,
    ThrownEvents,
    read_rules,
)
from m2pem.api.face import FaceSettings
from m2pem.api.runs import RunId
from m2pem.errors import ExpressionError, PluginError
from m2pem.testing import run_executive, scenarios

BPMN = b"""<?xml version="1.0"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">
<signal id="Sig_1" name="alarm"/><signal id="Sig_2" name="cleared"/><message id="Msg_1" name="go"/>
<process id="P" isExecutable="true"><startEvent id="S"/>
<intermediateCatchEvent id="Alarm"><signalEventDefinition signalRef="Sig_1"/>
</intermediateCatchEvent>
<intermediateCatchEvent id="Go"><messageEventDefinition messageRef="Msg_1"/>
</intermediateCatchEvent>
<intermediateThrowEvent id="Cleared">
  <dataInput id="In" name="level"/><dataInputAssociation><targetRef>In</targetRef>
  <assignment><from>alarm.level + 1</from><to>In</to></assignment></dataInputAssociation>
  <inputSet><dataInputRefs>In</dataInputRefs></inputSet>
  <signalEventDefinition signalRef="Sig_2"/></intermediateThrowEvent>
<endEvent id="E"/>
<sequenceFlow id="a" sourceRef="S" targetRef="Alarm"/>
<sequenceFlow id="b" sourceRef="Alarm" targetRef="Go"/>
<sequenceFlow id="c" sourceRef="Go" targetRef="Cleared"/>
<sequenceFlow id="d" sourceRef="Cleared" targetRef="E"/>
</process></definitions>"""


def receive(**settings: Any) -> ReceiveRule:
    settings = {"topic": "/alarm", "signal": "alarm", **settings}
    return ReceiveRule.read(FaceSettings("ros", settings, "faces.ros.receive[0]"), ["topic"])


def events(rule: ReceiveRule, *values: Any, every_s: float = 10.0) -> list[bool]:
    return [
        rule.occurs({"data": value}, number * every_s) is not None
        for number, value in enumerate(values)
    ]


def test_a_message_is_an_event_when_its_condition_becomes_true() -> None:
    rule = receive(when="data == true")
    assert events(rule, False, True, True, False, True) == [False, True, False, False, True]


def test_every_message_that_fits_is_an_event_on_request() -> None:
    assert events(receive(when="data > 2", every=True), 1, 3, 4, 2) == [False, True, True, False]


def test_no_more_events_than_its_rate_and_a_lasting_change_is_not_lost() -> None:
    rule = receive(when="data == true", rate="0.5 Hz")
    assert events(rule, True, False, True, True, True, every_s=0.9) == [
        True,
        False,
        False,
        True,
        False,
    ]


def test_fields_within_fields_are_read_and_become_data() -> None:
    rule = receive(
        when="status.level >= 2",
        data={"alarm.level": "${status.level}", "alarm.text": "${status.values[0]} of 7", "n": 3},
    )
    found = rule.occurs({"status": {"level": 2, "values": ["smoke"]}}, 0.0)
    assert found == {"alarm.level": 2, "alarm.text": "smoke of 7", "n": 3}


def test_a_condition_that_does_not_fit_the_message_says_so() -> None:
    with pytest.raises(ExpressionError, match="data - 1"):
        receive(when="data - 1 > 2").occurs({"data": "x"}, 0.0)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"message": "m"}, "faces.ros.receive[0].signal: name either"),
        ({"signal": ""}, "faces.ros.receive[0].signal: '' is not a text"),
        ({"when": "data =="}, "faces.ros.receive[0].when"),
        ({"data": {"x": "${"}}, "faces.ros.receive[0].data.x"),
        ({"data": {"x": [1]}}, "faces.ros.receive[0].data.x: [1] is no text"),
        ({"rate": "100 Hz"}, "faces.ros.receive[0].rate"),
        ({"wen": "true"}, "did you mean 'when'"),
    ],
)
def test_a_wrong_rule_is_named(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(PluginError) as raised:
        receive(**settings)
    assert says in str(raised.value)


def test_without_a_condition_each_message_is_an_event() -> None:
    assert events(receive(), 1, 1, 2) == [True, True, True]


def test_fields_that_depend_on_what_is_thrown_are_unknown_before() -> None:
    fields = {"data": "${level}", "list": [{"key": "a"}, "${level}"], "n": 3}
    rule = SendRule.read(FaceSettings("ros", {"signal": "s", "fields": fields}), [])
    assert rule.constants() == {"data": UNKNOWN, "list": [{"key": "a"}, UNKNOWN], "n": 3}


def test_fields_may_not_be_too_deep() -> None:
    fields: Any = {"x": 1}
    for _ in range(12):
        fields = {"x": [fields]}
    with pytest.raises(PluginError, match="nested deeper than 10 levels"):
        SendRule.read(FaceSettings("ros", {"signal": "s", "fields": fields}), [])


@pytest.mark.parametrize(
    ("rules", "says"),
    [
        ({"signal": "a"}, r"faces\.ros\.receive: it is not a list of rules"),
        (["a"], r"faces\.ros\.receive: it is not a list of rules"),
        ([{}] * 201, r"it has 201 rules; 200 are the most"),
    ],
)
def test_rules_are_a_list(rules: Any, says: str) -> None:
    with pytest.raises(PluginError, match=says):
        read_rules(FaceSettings("ros", {"receive": rules}), "receive")


def test_each_rule_is_named_by_its_number() -> None:
    first, second = read_rules(FaceSettings("ros", {"receive": [{"a": 1}, {"b": 2}]}), "receive")
    assert (first.values, second.path) == ({"a": 1}, "faces.ros.receive[1]")


@pytest.mark.parametrize(
    ("answer", "signal"),
    [({"success": True}, "done"), ({"success": False}, "failed"), (None, "failed"), ({}, "done")],
)
async def test_an_answer_is_a_signal_for_the_run_that_asked(answer: Any, signal: str) -> None:
    rule = AnswerRule.read(
        FaceSettings("ros", {"done": "done", "failed": "failed", "data": {"ok": "${success}"}}),
        "success != false",
    )
    control = SignalLog()
    await rule.throw(control, RunId("r7"), answer, "ros /gate", "no answer")  # type: ignore[arg-type]
    success = (answer or {}).get("success")
    assert control.signals == [(signal, "r7", {"ok": success}, "ros /gate")]


class SignalLog:
    """Keeps the signals that it is asked to emit."""

    def __init__(self) -> None:
        self.signals: list[tuple[str, str, Any, str]] = []

    async def signal(self, signal: str, *, run: str, data: Any, by: str) -> None:
        self.signals.append((signal, run, data, by))


async def test_missions_get_events_and_what_they_throw_is_sent() -> None:
    fields = {"data": "${level}", "header": {"frame_id": "map"}, "list": [1, "${level}"]}
    sends = SendRule.read(
        FaceSettings("ros", {"topic": "/c", "signal": "cleared", "fields": fields}), ["topic"]
    )
    other = SendRule.read(FaceSettings("ros", {"topic": "/c", "signal": "alarm"}), ["topic"])
    alarm = receive(data={"alarm.level": "${level}"})
    go = ReceiveRule.read(FaceSettings("ros", {"message": "go"}), [])
    async with run_executive(scenarios.fleet("sim", {"rover1": {}})) as control:
        thrown = ThrownEvents(control, [sends, other])

        async def follow() -> tuple[Any, Any]:
            async for rule, run, data in thrown:
                return run, rule.filled(data)
            raise AssertionError

        await alarm.throw(control, {"alarm.level": 1}, "ros /alarm")  # no run has it: nothing
        run = await control.start(BPMN)
        thrower = EventThrower(control)
        throwing = asyncio.create_task(thrower.run())
        thrower.put(alarm, {"alarm.level": 4}, "ros /alarm")
        thrower.put(go, {}, "ros /go")
        assert str((await control.wait(run)).status) == "completed"
        records = await control.records(run)
        sent = await follow()
        throwing.cancel()
    assert sent == (run, {"data": 5, "header": {"frame_id": "map"}, "list": [1, 5]})
    assert {"ros /alarm", "ros /go"} <= {getattr(each.record, "by", "") for each in records}


ASKS = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="test">
  <signal id="a" name="alarm"/> <signal id="c" name="{name}"/>
  <process id="P" isExecutable="true"><startEvent id="S"/>
    <intermediateThrowEvent id="First"><signalEventDefinition signalRef="a"/>
    </intermediateThrowEvent>
    <userTask id="Ask"/>
    <intermediateThrowEvent id="Last"><signalEventDefinition signalRef="c"/>
    </intermediateThrowEvent><endEvent id="E"/>
    <sequenceFlow id="f1" sourceRef="S" targetRef="First"/>
    <sequenceFlow id="f2" sourceRef="First" targetRef="Ask"/>
    <sequenceFlow id="f3" sourceRef="Ask" targetRef="Last"/>
    <sequenceFlow id="f4" sourceRef="Last" targetRef="E"/>
  </process></definitions>"""


async def test_what_a_revised_mission_throws_is_sent_by_its_new_names() -> None:
    rules = [
        SendRule.read(FaceSettings("ros", {"topic": "/c", "signal": name}), ["topic"])
        for name in ("alarm", "cleared")
    ]
    async with run_executive(scenarios.fleet("sim", {"rover1": {}})) as control:
        thrown = aiter(ThrownEvents(control, rules))
        run = await control.start(ASKS.format(name="other").encode())
        assert (await anext(thrown))[0] is rules[0]
        new = ASKS.format(name="cleared").encode()
        plan = await control.plan_revision(run, new)
        await control.revise(run, new, plan.plan)
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, prompt.decisions[0].value)
        assert (await anext(thrown))[0] is rules[1]
