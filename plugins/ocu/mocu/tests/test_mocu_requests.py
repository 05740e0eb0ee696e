"""Signals, messages, answers, vehicles and geometries, as operators send them over DDS."""

import math
from typing import Any

import pytest
from mocu_world import Client, World

from m2pem.api import RunStatus
from m2pem.api import records as r
from m2pem.errors import JournalError
from m2pem.testing import scenarios

SIGNAL = "2f6d1c1e-7f55-4a0e-9d5c-6a1d7f3b9a10"
MESSAGE = "7c1e"
MORE = "http://www.omg.org/spec/BPMN/20100524/MODEL"

WAITS = f"""<definitions xmlns="{MORE}" targetNamespace="t">
<signal id="{SIGNAL}" name="Come home"/><message id="{MESSAGE}" name="Report"/>
<process id="P" isExecutable="true"><startEvent id="S"/>
<intermediateCatchEvent id="OnSignal"><signalEventDefinition signalRef="{SIGNAL}"/>
</intermediateCatchEvent><receiveTask id="OnMessage" messageRef="{MESSAGE}"/><endEvent id="E"/>
<sequenceFlow id="a" sourceRef="S" targetRef="OnSignal"/>
<sequenceFlow id="b" sourceRef="OnSignal" targetRef="OnMessage"/>
<sequenceFlow id="c" sourceRef="OnMessage" targetRef="E"/></process></definitions>""".encode()

HERE = {"latitude_deg": 38.1, "longitude_deg": -77.3, "altitude_m": 12.5}
NORTH = {"latitude_deg": 38.2, "longitude_deg": -77.3, "altitude_m": math.nan}
EAST = {"latitude_deg": 38.1, "longitude_deg": -77.2, "altitude_m": math.nan}


async def recorded(world: World, run: str, kind: type) -> list[Any]:
    return [
        each.record for each in await world.control.records(run) if isinstance(each.record, kind)
    ]


async def refused(client: Client, service: str, **fields: Any) -> str:
    response = await client.call(service, **fields)
    assert not response["success"], f"{service} took {fields}"
    return str(response["message"])


# --- signals and messages -------------------------------------------------------------------------


@pytest.mark.parametrize("signal", [SIGNAL, "Come home"])
async def test_a_signal_is_meant_by_its_uuid_or_its_name(
    world: World, client: Client, signal: str
) -> None:
    run = await world.control.start(WAITS, by="test")
    value = [{"key": "colour", "value": '"red"'}]
    assert (await client.call("send_signal", signal=signal, data=value, by="anna"))["success"]
    (thrown,) = await recorded(world, run, r.SignalThrown)
    assert (thrown.signal, thrown.by) == (SIGNAL, "anna")
    assert (await client.call("send_message", message_id=MESSAGE, run=run))["success"]
    assert (await world.control.wait(run)).status is RunStatus.COMPLETED


async def test_a_signal_is_for_all_runs_or_for_one(world: World, client: Client) -> None:
    first = await world.control.start(WAITS)
    second = await world.control.start(WAITS)
    assert (await client.call("send_signal", signal=SIGNAL, run=first))["success"]
    assert not await recorded(world, second, r.SignalThrown)
    assert (await client.call("send_signal", signal=SIGNAL))["success"]
    assert await recorded(world, second, r.SignalThrown)


async def test_signals_and_messages_that_nobody_knows_are_refused(
    world: World, client: Client
) -> None:
    run = await world.control.start(WAITS)
    unknown = await refused(client, "send_signal", signal="Go home")
    assert "'Go home'" in unknown
    assert f"Come home ({SIGNAL})" in unknown
    assert "signal is empty" in await refused(client, "send_signal", signal=" ")
    assert "r9 is not driven" in await refused(client, "send_signal", signal=SIGNAL, run="r9")
    unknown = await refused(client, "send_message", message_id="x", run=run)
    assert "receives message x" in unknown
    assert "run is empty" in await refused(client, "send_message", message_id=MESSAGE)
    assert "message_id is empty" in await refused(client, "send_message", run=run)
    assert not await recorded(world, run, r.SignalThrown)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ([{"key": "a", "value": "{red"}], "data['a'] is not JSON"),
        ([{"key": "a", "value": "NaN"}], "data['a'] is not JSON"),
        ([{"key": "a", "value": "1e999"}], "data['a']"),
        ([{"key": "a", "value": '"\\ud800"'}], "data['a'] is not JSON"),
        ([{"key": "a", "value": "9" * 30}], "data['a'] has an integer of more than 64 bits"),
        ([{"key": "a", "value": "[" * 40 + "]" * 40}], "nested more than 32 deep"),
        ([{"key": "a", "value": "[" * 50_000}], "data['a'] is not JSON"),
        ([{"key": "a", "value": ""}], "data['a'] is not JSON"),
        ([{"key": "", "value": "1"}], "a value without a key"),
        ([{"key": "a", "value": "1"}, {"key": "a", "value": "2"}], "data['a'] is there twice"),
        ([{"key": f"k{n}", "value": "1"} for n in range(1001)], "data has 1,001 values"),
        ([{"key": "a", "value": '"' + "x" * 1_000_000 + '"'}], "1,000,002 characters"),
        ([{"key": "k" * 201, "value": "1"}], "a key of more than 200"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_data_that_no_journal_could_keep_is_refused(data: list[dict[str, str]], says: str) -> None:
    from types import SimpleNamespace

    from m2pem_plugin_ros import decode_data

    from m2pem.errors import OperatorError

    with pytest.raises(OperatorError) as refusal:
        decode_data([SimpleNamespace(**pair) for pair in data])
    assert says in str(refusal.value)


async def test_bad_data_changes_nothing(world: World, client: Client) -> None:
    run = await world.control.start(WAITS)
    for value in ("NaN", '"\\ud800"', "9" * 30, "red"):
        data = [{"key": "a", "value": value}]
        assert "data['a']" in await refused(client, "send_signal", signal=SIGNAL, data=data)
    assert not await recorded(world, run, r.SignalThrown)
    assert (await client.call("send_signal", signal=SIGNAL))["success"]


# --- prompts --------------------------------------------------------------------------------------


async def test_of_two_operators_the_second_is_told_who_was_first(
    world: World, client: Client, clients: list[Client]
) -> None:
    await world.has_listeners(client)
    run, prompt = await world.asks()
    answer = {"run": run, "prompt": prompt, "decision": "continue"}
    assert (await clients[1].call("answer_prompt", by="bob@mocu2", **answer))["success"]
    assert "answered by bob@mocu2" in await refused(client, "answer_prompt", by="anna", **answer)
    closed = await client.hears("prompt_events", lambda p: p["state"] == 2)
    assert (closed["decision"], closed["answered_by"]) == ("continue", "bob@mocu2")


async def test_answers_to_nothing_are_refused(world: World, client: Client) -> None:
    run, prompt = await world.asks(decisions=("yes", "no"))
    assert "r9" in await refused(client, "answer_prompt", run="r9", prompt=prompt, decision="yes")
    assert "p9" in await refused(client, "answer_prompt", run=run, prompt="p9", decision="yes")
    assert "prompt is empty" in await refused(client, "answer_prompt", run=run, decision="yes")
    wrong = await refused(client, "answer_prompt", run=run, prompt=prompt, decision="maybe")
    assert "maybe" in wrong
    assert len(world.control.prompts()) == 1


async def test_a_journal_that_fails_is_a_refusal(world: World, client: Client) -> None:
    run, prompt = await world.asks()
    world.faults.refuse("answer", JournalError("the disk is full"))
    answer = {"run": run, "prompt": prompt, "decision": "continue"}
    assert await refused(client, "answer_prompt", **answer) == "the disk is full"
    world.faults.refuse("answer", ValueError("a bug"))
    assert "internal error" in await refused(client, "answer_prompt", **answer)
    world.faults.mend()
    assert (await client.call("answer_prompt", **answer))["success"]


# --- vehicles -------------------------------------------------------------------------------------


async def test_a_vehicle_is_taken_and_given_back(world: World, client: Client) -> None:
    run = await world.drives("ugv1")
    for resource in ("ugv1", "ugv2/camera"):
        assert (await client.call("take_vehicle", vehicle=resource, by="anna"))["success"]
        assert (await world.control.holders())[resource] == "anna"
    taken = await refused(client, "take_vehicle", vehicle="ugv1", by="bob")
    assert "ugv1 is with anna" in taken
    assert (await client.call("give_back_vehicle", vehicle="ugv1", by="anna"))["success"]
    assert "not with an operator" in await refused(client, "give_back_vehicle", vehicle="ugv1")
    assert (await world.control.wait(run)).status is RunStatus.FAILED  # TAKEN_OVER, not caught


async def test_vehicles_that_there_are_not_are_refused(world: World, client: Client) -> None:
    for service in ("take_vehicle", "give_back_vehicle"):
        assert "ugv1" in await refused(client, service, vehicle="ugv11")
        assert "vehicle is empty" in await refused(client, service, vehicle="")


# --- geometries -----------------------------------------------------------------------------------


async def test_a_mission_drives_a_route_that_was_handed_over(world: World, client: Client) -> None:
    route = {"name": "alpha", "waypoints": [HERE, NORTH], "altitude_frame": "amsl"}
    assert (await client.call("set_route", by="anna", **route))["success"]
    mission = scenarios.one_behavior("single_vehicle_routing", "ugv1", route="alpha")
    run = await world.control.start(mission)
    (received,) = await recorded(world, run, r.GeometryReceived)
    geometry = {"type": "LineString", "coordinates": [[-77.3, 38.1, 12.5], [-77.3, 38.2]]}
    assert received.name == "alpha"
    assert received.geometry["geometry"] == geometry
    assert received.geometry["properties"] == {"altitude_frame": "amsl"}
    (requested,) = await recorded(world, run, r.BehaviorRequested)
    assert requested.resources == ("ugv1",)


async def test_areas_and_waypoints_are_handed_over(world: World, client: Client) -> None:
    run, _ = await world.asks()
    hole = [
        {"latitude_deg": 38.12, "longitude_deg": -77.28},
        {"latitude_deg": 38.13, "longitude_deg": -77.28},
        {"latitude_deg": 38.12, "longitude_deg": -77.27},
    ]
    area = {"outline": {"points": [HERE, NORTH, EAST]}, "holes": [{"points": hole}]}
    assert (await client.call("set_area", name="field", run=run, **area))["success"]
    assert (await client.call("set_waypoints", name="gate", run=run, waypoints=[HERE]))["success"]
    assert (await client.call("set_waypoints", name="two", run=run, waypoints=[HERE, EAST]))[
        "success"
    ]
    received = await recorded(world, run, r.GeometryReceived)
    field, gate, two = (each.geometry["geometry"] for each in received)
    assert [each.by for each in received] == ["mocu"] * 3
    assert field["type"] == "Polygon"
    assert [len(ring) for ring in field["coordinates"]] == [4, 4]
    assert field["coordinates"][0][0] == field["coordinates"][0][-1] == [-77.3, 38.1, 12.5]
    assert gate == {"type": "Point", "coordinates": [-77.3, 38.1, 12.5]}
    assert two["type"] == "MultiPoint"


async def test_geometries_that_are_nowhere_are_refused(world: World, client: Client) -> None:
    run, prompt = await world.asks()
    beyond = "waypoints[1].latitude_deg is 95, which is not within -90 to 90"
    nan, inf = math.nan, math.inf
    route: dict[str, Any] = {"name": "a", "run": run}
    for point, says in (
        ({**HERE, "latitude_deg": 95.0}, beyond),
        ({**HERE, "longitude_deg": -180.5}, "waypoints[1].longitude_deg is -180.5"),
        ({**HERE, "latitude_deg": nan}, "waypoints[1].latitude_deg is nan"),
        ({**HERE, "longitude_deg": inf}, "waypoints[1].longitude_deg is inf"),
        ({**HERE, "altitude_m": -inf}, "waypoints[1].altitude_m is -inf"),
        # rclpy 7.1.6 (Jazzy) reads the memory of an int as that of a float, without an error.
        ({**HERE, "altitude_m": 20}, "waypoints[1].altitude_m is 4.94066e-324, as rclpy sends an"),
        ({**HERE, "latitude_deg": 38}, "waypoints[1].latitude_deg is 4.94066e-324, as rclpy sends"),
    ):
        assert says in await refused(client, "set_route", waypoints=[HERE, point], **route)
    many = [HERE] * 10_001
    assert "needs 2 or more" in await refused(client, "set_route", waypoints=[HERE], **route)
    assert "10,001 points" in await refused(client, "set_route", waypoints=many, **route)
    assert "needs 1 or more" in await refused(client, "set_waypoints", waypoints=[], **route)
    two = {"outline": {"points": [HERE, NORTH]}}
    line = {"outline": {"points": [HERE, NORTH, HERE, NORTH]}}
    assert "needs 3 or more" in await refused(client, "set_area", **route, **two)
    assert "three different corners" in await refused(client, "set_area", **route, **line)
    both = {"waypoints": [HERE, NORTH]}
    wrong = {**route, "altitude_frame": "agl"}
    assert "relative, amsl, terrain" in await refused(client, "set_route", **wrong, **both)
    assert "name is empty" in await refused(client, "set_route", name="", **both)
    assert "r9 is not driven" in await refused(client, "set_route", name="a", run="r9", **both)
    assert not await recorded(world, run, r.GeometryReceived)
    await world.control.answer(run, prompt, "continue")
    await world.control.wait(run)
    assert "r1 has ended" in await refused(client, "set_route", **route, **both)
