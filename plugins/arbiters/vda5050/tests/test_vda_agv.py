"""The simulated vehicle obeys the standard: what it refuses, with which error; its messages are
valid by the schemas of the protocol, and so are its refusals."""

import json
import math
from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_vda5050.messages import Headers, encode
from m2pem_plugin_vda5050.simulator.agv import Agv, AgvSpec
from m2pem_plugin_vda5050.simulator.factsheet import factsheet
from m2pem_plugin_vda5050.simulator.motion import Chassis
from vda_world import schemas

SPEC = AgvSpec(
    "agv1", "m2pem", "agv1", "2.1.0", "hall", chassis=Chassis(2.0), actions={"pick": 2.0}
)
STEP_S = 0.05


class Vehicle:
    """A vehicle without a broker; each state is validated."""

    def __init__(self, spec: AgvSpec = SPEC) -> None:
        self.said: list[str] = []
        self.agv = Agv(spec, self.said.append)
        self._headers = Headers("m2pem", "agv1")
        self._schemas = schemas()

    @property
    def state(self) -> dict[str, Any]:
        body = json.loads(encode(self.agv.state(self._headers, 1_800_000_000_000_000)))
        problems = [error.message for error in self._schemas["state"].iter_errors(body)]
        assert problems == []
        return dict(body)

    @property
    def errors(self) -> list[str]:
        return [error["errorType"] for error in self.state["errors"]]

    def send(self, topic: str, body: dict[str, Any]) -> None:
        self.agv.receive(topic, json.dumps(body).encode())

    def instant(self, type_: str, id_: str, **values: Any) -> None:
        parameters = [{"key": key, "value": value} for key, value in values.items()]
        action = {"actionType": type_, "actionId": id_, "blockingType": "NONE"}
        self.send("instantActions", header(actions=[{**action, "actionParameters": parameters}]))

    def status(self, id_: str) -> str:
        states = {each["actionId"]: each["actionStatus"] for each in self.state["actionStates"]}
        return str(states.get(id_, ""))

    def go_on(self, true: Callable[[dict[str, Any]], bool], within_s: float = 120.0) -> None:
        """Let time pass until the state is so."""
        for _ in range(round(within_s / STEP_S)):
            if true(self.state):
                return
            self.agv.step(STEP_S)
        raise AssertionError(self.state)


def header(**more: Any) -> dict[str, Any]:
    fixed = {"headerId": 0, "timestamp": "2026-11-26T16:00:00.00Z", "version": "2.1.0"}
    return {**fixed, "manufacturer": "m2pem", "serialNumber": "agv1", **more}


def order(
    *places: tuple[float, float], base: int = 99, first: int = 0, **more: Any
) -> dict[str, Any]:
    """An order along places; `base`: so many of them are released; `first`: the first's number."""
    nodes = [
        {
            "nodeId": f"n{first + number}",
            "sequenceId": 2 * (first + number),
            "released": number < base,
            "nodePosition": {"x": x, "y": y, "mapId": "hall"},
            "actions": [],
        }
        for number, (x, y) in enumerate(places)
    ]
    edges = [
        {
            "edgeId": f"e{first + number}",
            "sequenceId": 2 * (first + number) + 1,
            "released": number + 1 < base,
            "startNodeId": f"n{first + number}",
            "endNodeId": f"n{first + number + 1}",
            "actions": [],
        }
        for number in range(len(places) - 1)
    ]
    return header(**{"orderId": "o1", "orderUpdateId": 0, "nodes": nodes, "edges": edges, **more})


def is_done(state: dict[str, Any]) -> bool:
    return not state["nodeStates"] and not state["driving"]


def test_it_drives_an_order_node_by_node() -> None:
    vehicle = Vehicle()
    vehicle.send("order", order((0, 0), (5, 0), (5, 5)))
    state = vehicle.state
    assert (state["orderId"], state["lastNodeId"], len(state["nodeStates"])) == ("o1", "n0", 2)
    vehicle.go_on(lambda state: state["lastNodeSequenceId"] == 2)
    vehicle.go_on(is_done)
    position = vehicle.state["agvPosition"]
    assert (position["x"], position["y"]) == pytest.approx((5, 5), abs=0.15)
    assert vehicle.state["lastNodeId"] == "n2"
    assert vehicle.errors == []


def test_it_stops_at_the_end_of_the_base_until_an_update_comes() -> None:
    vehicle = Vehicle()
    vehicle.send("order", order((0, 0), (3, 0), (6, 0), base=2))
    vehicle.go_on(lambda state: state["lastNodeId"] == "n1" and not state["driving"])
    assert [node["released"] for node in vehicle.state["nodeStates"]] == [False]
    assert vehicle.state["newBaseRequest"]
    vehicle.send("order", order((3, 0), (6, 0), first=1, orderUpdateId=1))
    assert vehicle.state["orderUpdateId"] == 1
    vehicle.go_on(is_done)
    assert vehicle.state["lastNodeSequenceId"] == 4


def broken(**changes: Any) -> dict[str, Any]:
    return {**order((0, 0), (5, 0)), **changes}


def with_node(number: int, **changes: Any) -> dict[str, Any]:
    made = order((0, 0), (5, 0))
    made["nodes"][number] |= changes
    return made


LOAD = [{"key": "stationType", "value": "floor"}, {"key": "loadType", "value": "EPAL"}]
PICK = {
    **{"actionType": "pick", "actionId": "a1", "blockingType": "HARD"},
    "actionParameters": LOAD,
}


@pytest.mark.parametrize(
    ("body", "error"),
    [
        (broken(edges=[]), "validationError"),
        (broken(nodes=[]), "validationError"),
        (broken(orderId=7), "validationError"),
        (broken(serialNumber="agv2"), "validationError"),
        (broken(manufacturer="other"), "validationError"),
        (with_node(1, sequenceId=3), "validationError"),
        (with_node(1, sequenceId=4), "validationError"),
        (with_node(0, released=False), "validationError"),
        (with_node(1, released=False), "validationError"),
        (with_node(1, nodeId="elsewhere"), "validationError"),
        (with_node(1, nodePosition={"x": 1, "y": 2, "mapId": "cellar"}), "orderError"),
        (with_node(1, actions=[{**PICK, "actionType": "fly"}]), "orderError"),
        (with_node(1, actions=[{**PICK, "actionParameters": LOAD[:1]}]), "orderError"),
        (with_node(1, actions=[{**PICK, "blockingType": "MAYBE"}]), "validationError"),
        (order((9, 0), (5, 0)), "noRouteError"),
        ({}, "validationError"),
    ],
)
def test_a_wrong_order_is_refused_until_a_right_one_comes(body: dict[str, Any], error: str) -> None:
    vehicle = Vehicle()
    vehicle.send("order", body)
    assert vehicle.errors == [error]
    assert vehicle.state["orderId"] == ""
    vehicle.agv.step(1.0)
    assert vehicle.errors == [error], "it is reported until an order is accepted"
    vehicle.send("order", order((0, 0), (1, 0)))
    assert (vehicle.errors, vehicle.state["orderId"]) == ([], "o1")


def test_fields_that_it_cannot_use_are_refused() -> None:
    vehicle = Vehicle()
    body = order((0, 0), (5, 0))
    body["edges"][0]["corridor"] = {"leftWidth": 1.0, "rightWidth": 1.0}
    vehicle.send("order", body)
    (error,) = vehicle.state["errors"]
    assert (error["errorType"], error["errorLevel"]) == ("orderError", "WARNING")
    references = {each["referenceKey"]: each["referenceValue"] for each in error["errorReferences"]}
    assert references == {"orderId": "o1", "orderUpdateId": "0", "edgeId": "e0"}


def test_another_order_is_refused_while_one_is_executed() -> None:
    vehicle = Vehicle()
    vehicle.send("order", order((0, 0), (5, 0)))
    vehicle.send("order", order((0, 0), (1, 0), orderId="o2"))
    assert (vehicle.errors, vehicle.state["orderId"]) == (["orderError"], "o1")
    vehicle.go_on(is_done)
    vehicle.send("order", order((5, 0), (6, 0), orderId="o2"))
    assert (vehicle.errors, vehicle.state["orderId"]) == ([], "o2")


def test_an_order_that_comes_twice_has_one_effect() -> None:
    vehicle = Vehicle()
    for _ in range(2):
        vehicle.send("order", order((0, 0), (5, 0)))
    assert (vehicle.errors, len(vehicle.said)) == ([], 1)
    vehicle.go_on(is_done)
    vehicle.send("order", order((0, 0), (5, 0)))
    assert (vehicle.errors, vehicle.state["nodeStates"]) == ([], [])


def test_updates_that_do_not_fit_are_refused_and_the_order_goes_on() -> None:
    vehicle = Vehicle()
    vehicle.send("order", order((0, 0), (3, 0), (6, 0), base=2, orderUpdateId=5))
    vehicle.send("order", order((0, 0), (3, 0), orderUpdateId=4))
    assert vehicle.errors == ["orderUpdateError"]
    vehicle.send("order", order((6, 0), (9, 0), first=2, orderUpdateId=6))
    assert vehicle.errors == ["orderUpdateError"]
    assert vehicle.state["orderUpdateId"] == 5
    vehicle.go_on(lambda state: state["lastNodeId"] == "n1")


def test_a_cancel_ends_the_order_when_it_stands() -> None:
    vehicle = Vehicle()
    body = order((0, 0), (9, 0))
    body["nodes"][1]["actions"] = [PICK]
    vehicle.send("order", body)
    vehicle.go_on(lambda state: state["velocity"]["vx"] > 1.5)
    vehicle.instant("cancelOrder", "c1")
    assert vehicle.status("c1") == "RUNNING"
    assert vehicle.state["nodeStates"], "it still moves"
    vehicle.go_on(lambda state: not state["driving"])
    assert (vehicle.status("c1"), vehicle.status("a1")) == ("FINISHED", "FAILED")
    assert (vehicle.state["nodeStates"], vehicle.state["orderId"]) == ([], "o1")
    vehicle.instant("cancelOrder", "c2")
    assert (vehicle.status("c2"), vehicle.errors) == ("FAILED", ["noOrderToCancel"])


def test_a_pause_keeps_the_order() -> None:
    vehicle = Vehicle()
    vehicle.send("order", order((0, 0), (9, 0)))
    vehicle.go_on(lambda state: state["velocity"]["vx"] > 1.0)
    vehicle.instant("startPause", "p1")
    assert vehicle.state["paused"]
    vehicle.go_on(lambda state: not state["driving"])
    assert vehicle.status("p1") == "FINISHED"
    assert len(vehicle.state["nodeStates"]) == 1
    vehicle.instant("stopPause", "p2")
    vehicle.go_on(is_done)


def test_an_action_of_a_node_is_done_there() -> None:
    vehicle = Vehicle()
    body = order((0, 0), (3, 0))
    parameters = [*LOAD, {"key": "loadId", "value": "pallet7"}]
    body["nodes"][1]["actions"] = [{**PICK, "actionParameters": parameters}]
    vehicle.send("order", body)
    assert vehicle.status("a1") == "WAITING"
    vehicle.go_on(is_done)
    vehicle.go_on(lambda _: vehicle.status("a1") == "RUNNING")
    assert vehicle.state["loads"] == []
    vehicle.go_on(lambda _: vehicle.status("a1") == "FINISHED")
    assert vehicle.state["loads"] == [{"loadType": "EPAL", "loadId": "pallet7"}]


def test_an_unknown_instant_action_fails_and_says_so() -> None:
    vehicle = Vehicle()
    vehicle.instant("fly", "x1")
    assert (vehicle.status("x1"), vehicle.errors) == ("FAILED", ["instantActionError"])
    vehicle.send("instantActions", {"actions": 7})
    assert "validationError" in vehicle.errors


def test_a_position_can_be_told() -> None:
    vehicle = Vehicle()
    vehicle.instant("initPosition", "i1", x=3.0, y=4.0, theta=math.pi, mapId="hall", lastNodeId="n")
    position = vehicle.state["agvPosition"]
    assert (position["x"], position["y"]) == (3.0, 4.0)
    assert vehicle.status("i1") == "FINISHED"


def test_in_manual_mode_orders_are_cleared_and_refused() -> None:
    vehicle = Vehicle()
    vehicle.send("order", order((0, 0), (9, 0)))
    vehicle.agv.set_mode("MANUAL")
    assert vehicle.state["nodeStates"] == []
    vehicle.send("order", order((0, 0), (9, 0), orderId="o2"))
    assert vehicle.errors == ["orderError"]


def test_the_factsheet_is_valid() -> None:
    body = json.loads(factsheet(SPEC, Headers("m2pem", "agv1").of("factsheet", 0)))
    assert [error.message for error in schemas()["factsheet"].iter_errors(body)] == []
