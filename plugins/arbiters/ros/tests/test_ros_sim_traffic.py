"""How a good m2pem node is made a bad one: lies, floods and deafness."""

from typing import Any

import pytest
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus
from m2pem_plugin_ros.simulator.faults import TrafficFaults
from m2pem_plugin_ros.simulator.traffic import NodeTrafficFilter


class Publisher:
    """Notes what is published."""

    def __init__(self) -> None:
        self.said: list[Any] = []

    def publish(self, message: Any) -> None:
        self.said.append(message)


@pytest.fixture
def problems() -> TrafficFaults:
    return TrafficFaults()


@pytest.fixture
def gate(problems: TrafficFaults) -> NodeTrafficFilter:
    return NodeTrafficFilter(problems)


@pytest.fixture
def publisher(gate: NodeTrafficFilter) -> Publisher:
    publisher = Publisher()
    gate.made(publisher, "behavior_status")
    gate.send(publisher, "behavior_status", status(BehaviorStatus.RUNNING))
    return publisher


def status(state: int) -> BehaviorStatus:
    return BehaviorStatus(id="b1", number=2, state=state)


def test_without_troubles_everything_passes_as_it_is(
    gate: NodeTrafficFilter, publisher: Publisher
) -> None:
    gate.step(10.0, 1.0)
    assert publisher.said == [status(BehaviorStatus.RUNNING)]
    assert gate.accepts("command", BehaviorCommand(verb=BehaviorCommand.START))


def test_a_liar_ends_twice_and_otherwise(
    gate: NodeTrafficFilter, publisher: Publisher, problems: TrafficFaults
) -> None:
    problems.lies = True
    gate.send(publisher, "behavior_status", status(BehaviorStatus.SUCCEEDED))
    *_, true, false = publisher.said
    assert (true.id, true.state) == ("b1", BehaviorStatus.SUCCEEDED)
    assert (false.id, false.number, false.state) == ("b1", 3, BehaviorStatus.FAILED)


def test_a_liar_tells_of_behaviors_that_nobody_gave_it(
    gate: NodeTrafficFilter, publisher: Publisher, problems: TrafficFaults
) -> None:
    problems.lies = True
    for seconds in range(20):
        gate.step(float(seconds), 1.0)
    lies = publisher.said[1:]
    assert len(lies) == 20
    assert len({each.id for each in lies}) == 20
    assert all(each.id != "b1" for each in lies)
    assert {BehaviorStatus.RUNNING, BehaviorStatus.SUCCEEDED} <= {each.state for each in lies}


def test_a_flood_comes_at_its_rate(
    gate: NodeTrafficFilter, publisher: Publisher, problems: TrafficFaults
) -> None:
    problems.flood_per_s = 5000.0
    for _ in range(50):
        gate.step(0.0, 0.02)
    assert len(publisher.said) == pytest.approx(5001, abs=1)
    assert {"b1"} < {each.id for each in publisher.said}


def test_a_flood_needs_nothing_that_was_said_before(
    gate: NodeTrafficFilter, problems: TrafficFaults
) -> None:
    publisher, problems.flood_per_s = Publisher(), 100.0
    gate.made(publisher, "behavior_status")
    gate.step(0.0, 0.1)
    assert len(publisher.said) == 10


def test_a_deaf_node_hears_of_nothing_new(gate: NodeTrafficFilter, problems: TrafficFaults) -> None:
    problems.deaf = True
    assert not gate.accepts("command", BehaviorCommand(verb=BehaviorCommand.START))
    assert gate.accepts("command", BehaviorCommand(verb=BehaviorCommand.CANCEL))
    assert gate.accepts("target", object())


def test_a_dead_or_silent_node_says_nothing_and_a_silent_one_drives_on(
    gate: NodeTrafficFilter, publisher: Publisher, problems: TrafficFaults
) -> None:
    problems.silent, problems.flood_per_s = True, 100.0
    gate.step(0.0, 1.0)
    gate.send(publisher, "vehicle_status", "word")
    assert len(publisher.said) == 1
    gate.send(publisher, "cmd_vel", "drive")
    assert publisher.said[1:] == ["drive"]
    gate.closed = True
    gate.send(publisher, "cmd_vel", "drive")
    assert len(publisher.said) == 2
    assert not gate.accepts("command", BehaviorCommand(verb=BehaviorCommand.CANCEL))
