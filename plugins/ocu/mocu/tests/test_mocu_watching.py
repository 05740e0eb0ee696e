"""What operators hear by topics, whenever they come, and however slow they are."""

import asyncio
import json
import os
import signal
from itertools import pairwise

import pytest
from m2pem_plugin_mocu.ocu import MocuOcu
from m2pem_plugin_mocu.publish_throttle import MIN_PERIOD_S
from m2pem_plugin_mocu.settings import NAMESPACE
from m2pem_plugin_mocu.topics import Topics
from mocu_world import OTHER, Client, Message, World, until, values

from m2pem.errors import JournalError

OPEN, ANSWERED, WITHDRAWN = 1, 2, 3
RUNNING, COMPLETED, STOPPED = 1, 4, 7
OK, WARN, ERROR, STALE = 0, 1, 2, 3

HELD_UP_S = 15.0
"""A run takes a fraction of a second; each of its hundreds of messages that waited for a reader
would be waited for a tenth of one."""

LOOPS = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">
<process id="P" isExecutable="true"><startEvent id="S"/>
<exclusiveGateway id="Again" default="out"/><scriptTask id="Count"><script>n = n + 1</script>
</scriptTask><endEvent id="E"/><exclusiveGateway id="In"/>
<sequenceFlow id="a" sourceRef="S" targetRef="In"/>
<sequenceFlow id="b" sourceRef="In" targetRef="Count"/>
<sequenceFlow id="c" sourceRef="Count" targetRef="Again"/>
<sequenceFlow id="again" sourceRef="Again" targetRef="In">
<conditionExpression>n &lt; 30</conditionExpression></sequenceFlow>
<sequenceFlow id="out" sourceRef="Again" targetRef="E"/></process></definitions>"""


NEVER_COUNTS = LOOPS.replace(
    b'<startEvent id="S"/>',
    b"""<extensionElements><m2pem:requirement id="still" xmlns:m2pem="https://m2pem.org/schema/1"
    ltl="[] !active(Count)"/></extensionElements><startEvent id="S"/>""",
)


def stands(prompts: Message, text: str) -> bool:
    return any(each["text"] == text for each in prompts["prompts"])


def statuses(status: Message) -> list[int]:
    return [each["status"] for each in status["runs"]]


async def test_operators_read_at_once_that_a_requirement_is_violated(
    world: World, client: Client
) -> None:
    await world.has_listeners(client)
    run = await world.control.start(NEVER_COUNTS)
    alert = await client.hears("rosout", lambda each: "requirement still" in each["msg"])
    assert alert["msg"].startswith(f"{run}: ")
    assert "violated" in alert["msg"]
    decided = await client.hears("events", lambda each: each["type"] == "RequirementDecided")
    assert json.loads(decided["data"])["verdict"] == "violated"


async def test_prompts_are_told_as_they_open_and_close(world: World, client: Client) -> None:
    await world.has_listeners(client)
    run, prompt = await world.asks("Road?", decisions=("yes", "no"))
    opened = await client.hears("prompt_events", lambda p: p["state"] == OPEN)
    assert (opened["run"], opened["prompt"], opened["element"]) == (run, prompt, "Question")
    assert opened["decisions"] == [
        {"value": "yes", "label": "yes"},
        {"value": "no", "label": "no"},
    ]
    await client.hears("prompts", lambda each: stands(each, "Road?"))
    since = len(client.said)
    await world.control.answer(run, prompt, "no", by="bob")
    answered = await client.hears("prompt_events", lambda p: p["state"] == ANSWERED)
    assert (answered["decision"], answered["answered_by"]) == ("no", "bob")
    await client.hears("prompts", lambda each: not each["prompts"], since=since)
    run, _ = await world.asks("Bridge?")
    await client.hears("prompt_events", lambda p: p["text"] == "Bridge?")
    await world.control.stop(run)
    withdrawn = await client.hears("prompt_events", lambda p: p["state"] == WITHDRAWN)
    assert (withdrawn["text"], withdrawn["answered_by"]) == ("Bridge?", "")


async def test_who_comes_late_hears_what_stands(client: Client, world: World) -> None:
    asking, _ = await world.asks("Road?")
    driving = await world.drives()
    late = Client(client.domain)
    try:
        await late.hears("prompts", lambda each: stands(each, "Road?"))
        status = await late.hears("status", lambda each: len(each["runs"]) == 2)
        assert [each["run"] for each in status["runs"]] == [asking, driving]
        elements = await late.hears("active_elements", lambda each: len(each["elements"]) == 2)
        assert [each["element"] for each in elements["elements"]] == ["Question", "Task"]
    finally:
        late.close()


async def test_an_operator_whose_client_dies_goes_on_with_another(
    world: World, client: Client
) -> None:
    run, prompt = await world.asks("Road?")
    doomed = Client(client.domain)
    await doomed.hears("prompts", lambda each: stands(each, "Road?"))
    await client.hears("prompts", lambda each: stands(each, "Road?"))
    world.faults.hang("answer")
    doomed.send("answer_prompt", run=run, prompt=prompt, decision="continue")
    await world.faults.called("answer")
    doomed.close()
    since = len(client.said)
    world.faults.mend()
    await client.hears("prompts", lambda each: not stands(each, "Road?"), since=since)
    await world.asks("Bridge?")
    fresh = Client(client.domain)
    try:
        prompts = await fresh.hears("prompts", lambda each: stands(each, "Bridge?"))
        (one,) = prompts["prompts"]
        answer = {"run": one["run"], "prompt": one["prompt"], "decision": "continue"}
        assert (await fresh.call("answer_prompt", **answer))["success"]
    finally:
        fresh.close()


async def test_active_elements_say_what_is_done_and_by_whom(world: World, client: Client) -> None:
    first, second = await world.drives("ugv1"), await world.drives("ugv2")

    def both_work(each: Message) -> bool:
        return [len(e["behaviors"]) for e in each["elements"]] == [1, 1]

    heard = await client.hears("active_elements", both_work)
    one, other = heard["elements"]
    assert (one["run"], one["element"], one["type"]) == (first, "Task", "scriptTask")
    assert (one["tokens"], one["behaviors"], one["resources"]) == (1, ["goto"], ["ugv1"])
    assert (other["run"], other["resources"]) == (second, ["ugv2"])
    assert one["since"]["sec"] > 1_700_000_000
    since = len(client.said)
    await world.control.stop(first)
    await client.hears(
        "active_elements",
        lambda each: [e["run"] for e in each["elements"]] == [second],
        since=since,
    )


async def test_every_record_is_told_in_order_and_in_words(world: World, client: Client) -> None:
    await world.has_listeners(client)
    run, prompt = await world.asks("Road?")
    await world.control.answer(run, prompt, "continue", by="anna")
    await world.control.wait(run)
    journal = await world.control.records(run)
    await until(lambda: len(client.heard("events")) >= len(journal))
    events = client.heard("events")
    assert [each["seq"] for each in events] == [each.seq for each in journal]
    assert [each["type"] for each in events] == [type(each.record).__name__ for each in journal]
    assert all(each["text"] and each["run"] == run for each in events)
    (answered,) = [each for each in events if each["type"] == "PromptAnswered"]
    assert answered["text"] == "Question: continue, answered by anna"
    assert json.loads(answered["data"])["decision"] == "continue"
    assert (answered["element"], answered["stamp"]["sec"] > 1_700_000_000) == ("Question", True)
    ended = await client.hears("status", lambda each: statuses(each) == [COMPLETED])
    assert ended["runs"][0]["ended"]["sec"] >= ended["runs"][0]["started"]["sec"]


async def test_many_changes_are_few_messages(world: World, client: Client) -> None:
    await world.has_listeners(client)
    since = len(client.said)
    begun = asyncio.get_running_loop().time()
    runs = [await world.control.start(LOOPS, data={"n": 0}) for _ in range(3)]
    for run in runs:
        await world.control.wait(run)
    await client.hears("status", lambda each: statuses(each) == [COMPLETED] * 3)
    count = sum([len(await world.control.records(run, limit=100_000)) for run in runs])
    await until(lambda: len(client.heard("events")) >= count)
    most = 2 + (asyncio.get_running_loop().time() - begun) / MIN_PERIOD_S
    for topic in ("active_elements", "status"):
        assert len(client.heard(topic, since=since)) <= most
    assert 500 < count < 1000  # the topic keeps so many, however slow its reader is
    for run in runs:
        seqs = [each["seq"] for each in client.heard("events") if each["run"] == run]
        assert all(after == before + 1 for before, after in pairwise(seqs))


async def test_a_reader_that_is_frozen_holds_nobody_up(world: World, client: Client) -> None:
    frozen = Client(client.domain)
    await until(lambda: bool(frozen.heard("status")))
    os.kill(frozen.process.pid, signal.SIGSTOP)
    try:
        for _ in range(5):
            run = await world.control.start(LOOPS, data={"n": 0})
            async with asyncio.timeout(HELD_UP_S):
                await world.control.wait(run)
        _, prompt = await world.asks("Still there?")
        await client.hears("prompts", lambda each: stands(each, "Still there?"))
        answer = {"run": "r6", "prompt": prompt, "decision": "continue"}
        assert (await client.call("answer_prompt", **answer))["success"]
    finally:
        os.kill(frozen.process.pid, signal.SIGCONT)
        frozen.close()


async def test_a_flood_of_calls_starves_no_prompt(
    world: World, client: Client, clients: list[Client]
) -> None:
    await client.hears("prompts", lambda each: True)
    flood = clients[1].send("list_runs", times=2000)
    await clients[1].responses(flood, 1)
    _, prompt = await world.asks("Meanwhile?")
    await client.hears("prompts", lambda each: stands(each, "Meanwhile?"))
    answer = {"run": "r1", "prompt": prompt, "decision": "continue"}
    assert (await client.call("answer_prompt", **answer))["success"]


@pytest.mark.long
async def test_each_of_many_calls_at_once_is_answered(world: World, client: Client) -> None:
    answers = await client.responses(client.send("list_runs", times=1500), 1500)
    refused = [each["message"] for each in answers if not each["success"]]
    assert len(answers) == 1500
    assert all("at once" in message for message in refused)


async def test_what_happens_last_is_still_told(world: World, client: Client) -> None:
    await world.has_listeners(client)
    run, prompt = await world.asks()
    await client.hears("prompts", lambda each: bool(each["prompts"]))
    await world.control.answer(run, prompt, "continue")
    await world.control.wait(run)
    await world.leave()  # at once: the command line does so when its run has ended
    await client.hears("events", lambda each: each["type"] == "RunEnded")
    await client.hears("status", lambda each: statuses(each) == [COMPLETED])


async def test_diagnostics_tell_of_executive_journal_and_vehicles(
    world: World, client: Client
) -> None:
    def by_name(message: Message) -> dict[str, Message]:
        return {each["name"]: each for each in message["status"]}

    wanted = {"m2pem: executive", "m2pem: journal", "m2pem: link ugv1", "m2pem: link ugv2"}

    def all_are_well(each: Message) -> bool:
        statuses = by_name(each)
        return all(name in statuses and statuses[name]["level"] == OK for name in wanted)

    heard = await client.hears("diagnostics", all_are_well)
    statuses = by_name(heard)
    vehicle = statuses["m2pem: link ugv1"]
    said = values(heard, "m2pem: link ugv1")
    assert (vehicle["hardware_id"], said["link"]) == ("ugv1", "connected")
    assert 0 < float(said["battery"]) <= 1
    await world.drives()
    world.faults.refuse("records", JournalError("the disk is gone"))
    failed = await client.hears(
        "diagnostics", lambda each: by_name(each)["m2pem: journal"]["level"] == ERROR
    )
    assert "disk" in by_name(failed)["m2pem: journal"]["message"]


async def test_units_in_two_namespaces_have_different_names_in_diagnostics(
    world: World, client: Client
) -> None:
    def ids(message: Message) -> set[tuple[str, str]]:
        return {(each["name"], each["hardware_id"]) for each in message["status"]}

    other = MocuOcu(world.control, environment={NAMESPACE: OTHER}, domain_id=world.domain)
    serving = asyncio.create_task(other.serve())
    one = await client.hears("diagnostics", lambda each: ("m2pem: link ugv1", "ugv1") in ids(each))
    two = await client.hears(
        "diagnostics",
        lambda each: ("m2pem: link team_b/m2pem/ugv1", "team_b/m2pem/ugv1") in ids(each),
    )
    serving.cancel()
    await asyncio.wait([serving])
    assert "m2pem: team_b/m2pem/journal" in {name for name, _ in ids(two)}
    assert not {name for name, _ in ids(one)} & {name for name, _ in ids(two)}


async def test_who_cancels_a_unit_twice_leaves_nothing_that_still_publishes(
    world: World, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    await world.has_listeners(client)
    begun, ended = asyncio.Event(), asyncio.Event()

    async def flush(_: Topics) -> None:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    monkeypatch.setattr(Topics, "flush", flush)
    world.serving.cancel()
    await begun.wait()
    world.serving.cancel()
    await asyncio.wait([world.serving])
    assert world.serving.cancelled()
    assert ended.is_set()
