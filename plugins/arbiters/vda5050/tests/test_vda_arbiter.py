"""What the arbiter makes of vehicles that refuse, delay, are taken over, or disappear."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import paho.mqtt.client as mqtt
import pytest
from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter
from m2pem_plugin_vda5050.checkpoint import order_id
from vda_world import Judge, Mosquitto, SimProcess, connection, until, write_fleet

from m2pem.api import (
    BehaviorState,
    Connection,
    LinkState,
    Point,
    ResourceId,
    Route,
    SystemClock,
    VehicleState,
)
from m2pem.errors import OperatorError
from m2pem.testing.contracts.arbiter_harness import JOURNAL, ArbiterHarness, context

SPEED = 6.0
AGV1 = ResourceId("agv1")
NEAR = Point((38.1076, -77.3192, None))
FAR = Point((38.1100, -77.3192, None))
LOAD = {"stationType": "floor", "loadType": "EPAL"}


@asynccontextmanager
async def commanding(
    settings: Mapping[str, Any], lost_after_s: float | None = None, **more: Any
) -> AsyncIterator[ArbiterHarness]:
    """An arbiter of agv1; `more`: of its connection to the arbiter."""
    connections = {
        AGV1: Connection(AGV1, "ground", settings, lost_after_s=lost_after_s, sitl=True, **more)
    }
    clock = SystemClock(SPEED)
    async with ArbiterHarness(Vda5050Arbiter(connections, context(clock)), clock) as harness:
        await harness.until(lambda: harness.latest(AGV1) is not None, 60)
        yield harness


class World:
    """A simulated vehicle at a broker."""

    def __init__(self, broker: Mosquitto, judge: Judge, folder: Path) -> None:
        self.broker, self.judge, self.folder = broker, judge, folder
        self.sims: list[SimProcess] = []

    def simulate(self, **settings: Any) -> Mapping[str, Any]:
        """Start the vehicle. Return its connection."""
        made = connection(self.broker.url, AGV1, **settings)
        self.sims.append(SimProcess(write_fleet(self.folder / "fleet.yaml", {AGV1: made}), SPEED))
        return made

    async def heard(self, topic: str, vehicle: str, true: Callable[[dict[str, Any]], bool]) -> Any:
        """Wait for a message, while the arbiter goes on."""
        return await asyncio.to_thread(self.judge.until, topic, vehicle, true)

    @property
    def sim(self) -> SimProcess:
        return self.sims[-1]


@pytest.fixture
def world(broker: Mosquitto, judge: Judge, tmp_path: Path) -> Any:
    made = World(broker, judge, tmp_path)
    yield made
    for sim in made.sims:
        sim.close()


def vehicle(harness: ArbiterHarness) -> VehicleState:
    state = harness.latest(AGV1)
    assert isinstance(state, VehicleState)
    return state


async def moving(harness: ArbiterHarness) -> None:
    def moves() -> bool:
        velocity = vehicle(harness).velocity_enu_m_s
        return velocity is not None and abs(velocity[0]) + abs(velocity[1]) > 0.5

    assert await harness.until(moves, 60)


async def test_a_vehicle_that_refuses_a_cancel_is_not_said_to_have_stopped(world: World) -> None:
    settings = world.simulate(cancel_timeout="20 s")
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=FAR)
        await moving(harness)
        world.sim.fault("agv1: refuse cancel")
        with pytest.raises(OperatorError, match="does NOT obey: has refused cancelOrder: cancel"):
            await harness.arbiter.cancel("r1.b1", 1)
        end = await harness.ended("r1.b1", 60)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TIMEOUT")
        assert "has refused the cancel" in end.reason
        paused = await world.heard("state", AGV1, lambda state: state["paused"])
        assert paused["nodeStates"], "it still has its order"


async def test_a_cancel_without_a_broker_is_soon_said_not_to_have_arrived(world: World) -> None:
    settings = world.simulate(cancel_timeout="600 s")
    async with commanding(settings, lost_after_s=600.0) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=FAR)
        await moving(harness)
        world.broker.stop()
        with pytest.raises(OperatorError, match=r"does NOT obey: .* the broker is not connected"):
            await harness.arbiter.cancel("r1.b1", 1)
        end = await harness.ended("r1.b1", 60)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TIMEOUT")
        assert "may still execute its order: the broker is not connected: " in end.reason
        world.broker.start()
        # It is paused and cancelled as soon as it is received again.
        await world.heard("state", AGV1, lambda state: state["paused"])
        await world.heard("state", AGV1, lambda state: state["orderId"] and not state["nodeStates"])


async def test_a_vehicle_that_is_let_go_of_is_not_paused_later(world: World) -> None:
    """Another executive drives it, which this one would stop when its broker is back."""
    settings = world.simulate()
    async with commanding(settings, lost_after_s=600.0) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR, speed=0.5)
        await moving(harness)
        world.broker.stop()
        with pytest.raises(OperatorError, match="no state shows startPause"):
            await harness.arbiter.hold(AGV1)
        await harness.arbiter.disown("r1")
        world.broker.start()
        end = await world.heard(
            "state", AGV1, lambda state: state["paused"] or state["lastNodeSequenceId"] == 2
        )
        assert not end["paused"]
    sent = [each["actions"][0]["actionType"] for each in world.judge.of("instantActions", AGV1)]
    assert "startPause" not in sent


async def test_a_vehicle_that_stops_at_the_next_node_is_cancelled_when_it_is_there(
    world: World,
) -> None:
    settings = world.simulate(sim={"stops_at_nodes": True})
    route = Route(((38.1077, -77.3192, None), (38.1090, -77.3192, None)))
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "single_vehicle_routing", AGV1, route=route)
        await moving(harness)
        await harness.arbiter.cancel("r1.b1", 1)
        end = await harness.ended("r1.b1", 60)
        assert end.state is BehaviorState.CANCELLED, end
        position = vehicle(harness).position
        assert position is not None
        assert position.latitude_deg == pytest.approx(38.1077, abs=3e-6)


async def test_a_refused_order_fails_with_what_the_vehicle_says(world: World) -> None:
    settings = world.simulate()
    world.sim.fault("agv1: refuse orders the lift is up")
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        end = await harness.ended("r1.b1", 60)
        assert (end.state, end.code) == (BehaviorState.FAILED, "REJECTED")
        assert "orderError: the lift is up" in end.reason
        world.sim.fault("agv1: accept orders")
        await harness.start("r1.b2", "goto", AGV1, target=NEAR)
        await harness.running("r1.b2")


@pytest.mark.tried_with(
    "paho-mqtt",
    "receives all messages of both sides",
    kind="Automated guided vehicles",
    result="each as the schemas say",
)
async def test_a_person_takes_the_vehicle_over(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=FAR)
        await moving(harness)
        world.sim.fault("agv1: mode manual")
        end = await harness.ended("r1.b1", 60)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TAKEN_OVER")
        assert await harness.until(lambda: vehicle(harness).mode == "MANUAL", 30)
        assert vehicle(harness).ready is False
        assert "its operating mode is MANUAL" in vehicle(harness).not_ready_reasons
        await harness.start("r1.b2", "goto", AGV1, target=NEAR)
        assert (await harness.ended("r1.b2", 30)).state is BehaviorState.REJECTED
        world.sim.fault("agv1: mode automatic")
        assert await harness.until(lambda: vehicle(harness).ready is True, 30)
        await harness.start("r1.b3", "goto", AGV1, target=NEAR)
        await harness.running("r1.b3")


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("estop", "emergency stop"),
        ("fatal laser scanner", "laser scanner"),
        ("lose gps", "position is not initialized"),
    ],
)
async def test_a_vehicle_that_is_not_ready_says_why_and_refuses(
    world: World, fault: str, reason: str
) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        assert await harness.until(lambda: vehicle(harness).ready is True, 30)
        world.sim.fault(f"agv1: {fault}")
        assert await harness.until(lambda: vehicle(harness).ready is False, 30)
        assert reason in "; ".join(vehicle(harness).not_ready_reasons)
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        end = await harness.ended("r1.b1", 30)
        assert end.state is BehaviorState.REJECTED
        assert reason in end.reason


async def test_an_order_of_another_master_control_is_left_alone(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=FAR)
        await moving(harness)
        connections = {AGV1: Connection(AGV1, "ground", settings, sitl=True)}
        other_context = context(harness.clock)
        other = Vda5050Arbiter(
            connections,
            type(other_context)(
                other_context.clock, other_context.bus, other_context.logger, other_context.origin
            ),
        )
        async with ArbiterHarness(other, harness.clock) as second:
            await second.until(lambda: second.latest(AGV1) is not None, 30)
            assert not vehicle(second).ready
            await second.start("r1.b1", "goto", AGV1, target=NEAR)
            end = await second.ended("r1.b1", 30)
            assert (end.state, end.code) == (BehaviorState.REJECTED, "REJECTED")
            assert f"{order_id(JOURNAL, 'r1.b1')!r} of another master control" in end.reason
        assert BehaviorState.RUNNING is harness.of("r1.b1")[-1].state


async def test_a_vehicle_that_dies_is_lost_by_its_last_will(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings, lost_after_s=600.0) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=FAR)
        await harness.running("r1.b1")
        world.sim.kill()
        end = await harness.ended("r1.b1", 120)
        assert end.state is BehaviorState.LOST
        assert "CONNECTIONBROKEN" in end.reason
        last = world.judge.of("connection", AGV1)[-1]
        assert last["connectionState"] == "CONNECTIONBROKEN"
        assert vehicle(harness).link is LinkState.LOST


async def test_a_vehicle_that_signs_off_is_lost_at_once(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings, lost_after_s=600.0) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=FAR)
        await harness.running("r1.b1")
        world.sim.fault("agv1: offline")
        end = await harness.ended("r1.b1", 30)
        assert (end.state, "OFFLINE" in end.reason) == (BehaviorState.LOST, True)


async def test_a_behavior_outlives_the_broker(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings, lost_after_s=600.0) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR, speed=0.5)
        await moving(harness)
        world.broker.stop()
        states = len(harness.states)
        world.broker.start()
        assert await harness.until(lambda: len(harness.states) > states, 60)
        end = await harness.ended("r1.b1", 120)
        assert end.state is BehaviorState.SUCCEEDED
        assert world.sim.count("accepts order") == 1


async def test_a_vehicle_that_is_first_received_when_the_broker_is_back_is_not_lost(
    world: World,
) -> None:
    """The executive stops a vehicle whose state says LOST: its first state must not."""
    settings = world.simulate()
    world.broker.stop()
    connections = {AGV1: Connection(AGV1, "ground", settings, sitl=True)}
    clock = SystemClock(SPEED)
    async with ArbiterHarness(Vda5050Arbiter(connections, context(clock)), clock) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        world.broker.start()
        end = await harness.ended("r1.b1", 120)
        assert end.state is BehaviorState.SUCCEEDED
        assert {state.link for state in harness.states if state.link} == {LinkState.CONNECTED}
    assert world.sim.count("cancel") == 0


async def test_a_state_that_comes_late_changes_nothing(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        old = {**await world.heard("state", AGV1, bool), "headerId": 0}
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        await moving(harness)
        for _ in range(5):
            world.judge.publish("uagv/v2/m2pem/agv1/state", json.dumps(old))
        assert (await harness.ended("r1.b1", 90)).state is BehaviorState.SUCCEEDED


async def test_a_visualization_that_comes_late_moves_nothing(world: World) -> None:
    settings = world.simulate()
    topic = "uagv/v2/m2pem/agv1/visualization"
    async with commanding(settings) as harness:
        old = await world.heard("state", AGV1, bool)
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        assert (await harness.ended("r1.b1", 90)).state is BehaviorState.SUCCEEDED
        there, count = vehicle(harness).position, len(harness.states)
        header = {key: old[key] for key in ("timestamp", "version", "manufacturer", "serialNumber")}
        late = {**header, "headerId": 1, "agvPosition": old["agvPosition"]}
        for _ in range(5):
            world.judge.publish(topic, json.dumps(late))
        assert await harness.until(lambda: len(harness.states) > count + 10, 60)
        assert {state.position for state in harness.states[count:]} == {there}
        newest = await world.heard("state", AGV1, lambda state: state["lastNodeSequenceId"])
        new = {**late, "timestamp": "2100-01-01T00:00:00.000Z", "headerId": newest["headerId"]}
        world.judge.publish(topic, json.dumps(new))
        assert await harness.until(lambda: vehicle(harness).position != there, 60)


async def test_a_vehicle_that_restarts_with_its_clock_set_back_is_received(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings, lost_after_s=600.0) as harness:
        newest = await world.heard("state", AGV1, bool)
        future = {**newest, "headerId": 999_999, "timestamp": "2100-01-01T00:00:00.000Z"}
        states = len(harness.states)
        world.judge.publish("uagv/v2/m2pem/agv1/state", json.dumps(future))
        assert await harness.until(lambda: len(harness.states) > states, 60)
        states = len(harness.states)
        # It counts from 0 again, and what it sends was made long before.
        assert await harness.until(lambda: len(harness.states) > states + 5, 60)


async def test_an_order_that_is_lost_on_the_way_is_sent_again(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        world.sim.fault("agv1: cut link")
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        await world.heard("order", AGV1, lambda _: len(world.judge.of("order", AGV1)) > 1)
        world.sim.fault("agv1: mend link")
        end = await harness.ended("r1.b1", 120)
        assert end.state is BehaviorState.SUCCEEDED
        orders = world.judge.of("order", AGV1)
        assert len({order["orderId"] for order in orders}) == 1
        assert world.sim.count("accepts order") == 1


async def test_actions_of_the_standard_are_done_where_they_are_asked_for(world: World) -> None:
    own = {
        "pick": None,
        "drop": None,
        "sweep": {
            "action": {"type": "startSweeping", "blocking": "SOFT"},
            "parameters": {"passes": {"kind": "count", "required": True}},
            "writes": ["sweep.said"],
        },
    }
    settings = world.simulate(own_behaviors=own)
    async with commanding(settings) as harness:
        loads = [{"loadType": "EPAL", "loadId": "pallet7"}]
        await harness.start("r1.b1", "pick", AGV1, target=NEAR, loadId="pallet7", **LOAD)
        assert (await harness.ended("r1.b1", 90)).state is BehaviorState.SUCCEEDED
        await world.heard("state", AGV1, lambda state: state["loads"] == loads)
        await harness.start("r1.b2", "sweep", AGV1, passes=2)
        end = await harness.ended("r1.b2", 60)
        assert (end.state, end.outputs) == (
            BehaviorState.SUCCEEDED,
            {"sweep.said": "startSweeping done"},
        )
        order = world.judge.of("order", AGV1)[-1]
        (action,) = order["nodes"][-1]["actions"]
        assert action["actionType"] == "startSweeping"
        assert action["blockingType"] == "SOFT"
        assert action["actionParameters"] == [{"key": "passes", "value": 2}]
        world.sim.fault("agv1: fail actions")
        await harness.start("r1.b3", "drop", AGV1, **LOAD)
        end = await harness.ended("r1.b3", 60)
        assert end.state is BehaviorState.FAILED
        assert "the station is not there" in end.reason


async def test_an_action_that_lacks_what_its_vehicle_requires_is_not_sent(world: World) -> None:
    """Its factsheet has changed since the fleet's copy was written."""
    actions = [{"actionType": "drop", "actionScopes": ["NODE"]}]
    file = world.folder / "before.json"
    file.write_text(json.dumps({"protocolFeatures": {"agvActions": actions}}), encoding="utf-8")
    settings = world.simulate(own_behaviors={"drop": None}, factsheet=str(file))
    async with commanding(settings) as harness:
        await world.heard("factsheet", AGV1, lambda _: True)
        await harness.start("r1.b1", "drop", AGV1, stationType="floor", loadType="")
        end = await harness.ended("r1.b1", 30)
        assert (end.state, end.code) == (BehaviorState.REJECTED, "REJECTED")
        assert end.reason == "the vehicle's factsheet requires loadType of drop"
        assert world.judge.of("order", AGV1) == []


@pytest.mark.parametrize("interface", ["vda5050", "uagv"])
async def test_a_vehicle_of_version_3_is_named_as_such(
    broker: Mosquitto, judge: Judge, caplog: pytest.LogCaptureFixture, interface: str
) -> None:
    """VDA 5050 3.0.0 has other topics, so that nothing arrives on those of version 2."""
    header = {"headerId": 0, "timestamp": "2026-11-26T16:00:00.00Z", "version": "3.0.0"}
    online = {**header, "manufacturer": "m2pem", "serialNumber": AGV1, "connectionState": "ONLINE"}
    topic = f"{interface}/v3/m2pem/{AGV1}/connection"
    judge.publish(topic, json.dumps(online), retain=True)
    clock = SystemClock(SPEED)
    connections = {AGV1: Connection(AGV1, "ground", connection(broker.url, AGV1), sitl=True)}
    async with ArbiterHarness(Vda5050Arbiter(connections, context(clock)), clock) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        end = await harness.ended("r1.b1", 30)
    assert end.state is BehaviorState.REJECTED
    said = "it speaks VDA 5050 3.0.0: m2pem speaks 1.1, 2.0 and 2.1 alone"
    assert said in end.reason
    assert f"agv1: {said}" in caplog.text
    assert judge.of("order", AGV1) == []


async def test_a_state_of_version_3_on_the_topic_of_version_2_is_named_as_such(
    broker: Mosquitto, caplog: pytest.LogCaptureFixture
) -> None:
    clock = SystemClock(SPEED)
    connections = {AGV1: Connection(AGV1, "ground", connection(broker.url, AGV1), sitl=True)}
    async with ArbiterHarness(Vda5050Arbiter(connections, context(clock)), clock) as harness:
        state = {"version": "3.0.0", "powerSupply": {"stateOfCharge": 80, "charging": False}}
        sender = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        sender.connect("127.0.0.1", broker.port)
        sender.loop_start()
        topic = f"uagv/v2/m2pem/{AGV1}/state"
        await asyncio.to_thread(sender.publish(topic, json.dumps(state), 1).wait_for_publish, 30)
        assert await harness.until(lambda: "it speaks VDA 5050 3.0.0" in caplog.text, 30)
        sender.disconnect()
        sender.loop_stop()


async def test_a_route_is_released_piece_by_piece(world: World) -> None:
    settings = world.simulate(released_nodes=1)
    route = Route(tuple((38.1075 + 0.00005 * number, -77.3192, None) for number in range(1, 6)))
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "single_vehicle_routing", AGV1, route=route, speed=1.5)
        assert (await harness.ended("r1.b1", 120)).state is BehaviorState.SUCCEEDED
    orders = world.judge.of("order", AGV1)
    assert [order["orderUpdateId"] for order in orders] == [0, 1, 2, 3, 4]
    first, second = orders[0], orders[1]
    assert [node["released"] for node in first["nodes"]] == [True, True, *[False] * 4]
    assert [node["sequenceId"] for node in second["nodes"]] == [2, 4, 6, 8, 10]
    assert {edge["maxSpeed"] for order in orders for edge in order["edges"]} == {1.5}


async def test_it_drives_backwards_and_turns_to_a_heading(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        assert await harness.until(lambda: vehicle(harness).position is not None, 30)
        await harness.start("r1.b1", "reverse", AGV1, distance=3.0)
        assert (await harness.ended("r1.b1", 90)).state is BehaviorState.SUCCEEDED
        position = vehicle(harness).position
        assert position is not None
        # It faces north at first, so that it is 3 m south now.
        assert position.latitude_deg == pytest.approx(38.1075 - 3 / 111_000, abs=3e-6)
        await harness.start("r1.b2", "goto", AGV1, target=NEAR, heading=1.5707963)
        assert (await harness.ended("r1.b2", 90)).state is BehaviorState.SUCCEEDED
        assert vehicle(harness).yaw_rad == pytest.approx(0.0, abs=0.05)


async def test_hold_and_drive_stop_pause_the_vehicle(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "hold", AGV1, duration=5.0)
        assert (await harness.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED
        await world.heard("state", AGV1, lambda state: state["paused"])
        await harness.start("r1.b2", "drive_stop", AGV1)
        assert (await harness.ended("r1.b2", 60)).state is BehaviorState.SUCCEEDED
        await harness.start("r1.b3", "goto", AGV1, target=NEAR)
        assert (await harness.ended("r1.b3", 90)).state is BehaviorState.SUCCEEDED


async def test_messages_that_are_no_vda5050_change_nothing(world: World, caplog: Any) -> None:
    settings = world.simulate()
    prefix = "uagv/v2/m2pem/agv1"
    async with commanding(settings) as harness:
        before = vehicle(harness).position
        for text in ("{", "[]", '{"headerId": 1}', "\xff", "9" * 5000, "[" * 100_000):
            world.judge.publish(f"{prefix}/state", text)
        states = len(harness.states)
        assert await harness.until(lambda: len(harness.states) > states + 5, 60)
        assert vehicle(harness).position == before
        assert caplog.text.count("invalid message: state: ") == 1  # of a flood of them
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        assert (await harness.ended("r1.b1", 90)).state is BehaviorState.SUCCEEDED
    assert world.judge.problems
    world.judge.problems.clear()  # the test itself has sent them


async def test_a_state_that_the_broker_retains_is_no_sign_of_life(world: World) -> None:
    """The standard retains none, but a vehicle may have sent it so, and be gone since."""
    settings = world.simulate()
    state = (await world.heard("state", AGV1, lambda state: "agvPosition" in state)).copy()
    world.sim.kill()
    prefix = "uagv/v2/m2pem/agv1"
    state["headerId"] = 999_999
    world.judge.publish(f"{prefix}/connection", b"", retain=True)
    world.judge.publish(f"{prefix}/state", json.dumps(state), retain=True)
    # Else the arbiter might receive them as they are sent, not as what was retained.
    await world.heard("state", AGV1, lambda state: state["headerId"] == 999_999)
    connections = {AGV1: Connection(AGV1, "ground", settings, sitl=True)}
    clock = SystemClock(SPEED)
    async with ArbiterHarness(Vda5050Arbiter(connections, context(clock)), clock) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        end = await harness.ended("r1.b1", 60)
        assert (end.state, harness.states) == (BehaviorState.LOST, [])
        found = await harness.arbiter.query("r1.b2", end.native_ref)
        assert "no state was received" in found.reason


async def test_qos_and_retained_messages_are_those_of_the_standard(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        await harness.ended("r1.b1", 90)
    assert world.judge.qos == {
        "connection": {1},
        **{topic: {0} for topic in ("order", "instantActions", "state", "visualization")},
        "factsheet": {0},
    }
    late = Judge(world.broker.port)
    late.until("connection", AGV1, lambda message: message["connectionState"] == "ONLINE")
    late.until("factsheet", AGV1, lambda message: "protocolFeatures" in message)
    late.close()
    for topic in ("order", "instantActions"):
        ids = [message["headerId"] for message in world.judge.of(topic, AGV1)]
        assert ids == list(range(len(ids)))


async def test_an_order_that_no_report_is_stored_of_goes_on_when_it_is_started_again(
    world: World,
) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR, speed=0.5)
        await moving(harness)
    async with commanding(settings) as harness:
        found = await harness.arbiter.query("r1.b1", None)
        assert (found.state, found.number) == (BehaviorState.UNKNOWN, 0)
        await harness.start("r1.b1", "goto", AGV1, target=NEAR, speed=0.5)
        assert (await harness.ended("r1.b1", 120)).state is BehaviorState.SUCCEEDED
    assert world.sim.count("accepts order") == 1


@pytest.mark.parametrize("released", [2, 0])
async def test_a_route_too_long_to_be_stored_does_not_end_early_after_a_restart(
    world: World, released: int
) -> None:
    """The vehicle would stop at the last node that was released, and its behavior go on for ever:
    an operator is asked, unless the vehicle has the whole route."""
    settings = world.simulate(released_nodes=released)
    waypoints = tuple((38.1080 + 2e-6 * number, -77.3192, None) for number in range(301))
    route = Route(waypoints)
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "single_vehicle_routing", AGV1, route=route)
        await moving(harness)
        reference = harness.of("r1.b1")[-1].native_ref
    sent = len(world.judge.of("order", AGV1))
    async with commanding(settings) as harness:
        found = await harness.arbiter.query("r1.b1", reference)
        if not released:
            assert found.state is BehaviorState.RUNNING
            return
        assert (found.state, found.not_begun) == (BehaviorState.UNKNOWN, False)
        assert "its route of 301 waypoints is too long to be stored" in found.reason
        assert "the vehicle stops at waypoint " in found.reason
        await harness.start("r1.b1", "single_vehicle_routing", AGV1, route=route)
        await asyncio.to_thread(until, lambda: len(world.judge.of("order", AGV1)) > sent + 1)
        await harness.running("r1.b1")
    assert world.sim.count("accepts order") == 1


async def test_what_a_vehicle_has_not_begun_is_said_not_to_have_begun(world: World) -> None:
    settings = world.simulate()
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        await harness.ended("r1.b1", 120)
        world.sim.fault("agv1: cut link")
        await harness.start("r1.b2", "goto", AGV1, target=FAR)
        sent = order_id(JOURNAL, "r1.b2")
        await world.heard("order", AGV1, lambda order: order["orderId"] == sent)
        reference = harness.of("r1.b2")[-1].native_ref
    world.sim.fault("agv1: mend link")
    async with commanding(settings) as harness:
        found = await harness.arbiter.query("r1.b2", reference)
        assert (found.state, found.not_begun) == (BehaviorState.UNKNOWN, True)
        found = await harness.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.SUCCEEDED


async def test_a_vehicle_of_version_2_0_gets_what_both_its_schema_and_its_text_say(
    world: World,
) -> None:
    settings = world.simulate(version="2.0.0", deviation="30 cm")
    async with commanding(settings) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=NEAR)
        assert (await harness.ended("r1.b1", 120)).state is BehaviorState.SUCCEEDED
    (order,) = world.judge.of("order", AGV1)
    assert order["version"] == "2.0.0"
    position = order["nodes"][-1]["nodePosition"]
    assert position["allowedDeviationXY"] == position["allowedDeviationXy"] == 0.3
    for message in world.judge.of("instantActions", AGV1):
        (action,) = message["actions"]
        assert action["actionName"] == action["actionType"]
