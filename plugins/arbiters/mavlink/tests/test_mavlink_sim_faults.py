"""Faults of simulated vehicles, made on request: bad links, refusals, other hands."""

from random import Random

import pytest
from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.faults import Direction, Faults, LinkFaults, every, share
from m2pem_plugin_mavlink.simulator.faults.link import FaultyWire, frames_in, message_id
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_mavlink.simulator.missions.plan import MISSION, Item
from m2pem_plugin_mavlink.simulator.server import VehiclePort
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec
from pymavlink.dialects.v20 import ardupilotmega as dialect

PEER = ("127.0.0.1", 1)
ARM = dialect.MAV_CMD_COMPONENT_ARM_DISARM


def frame(number: int) -> bytes:
    """A frame that says its number, from 0 to 65535."""
    message = dialect.MAVLink_mission_item_reached_message(number)
    packed: bytes = message.pack(dialect.MAVLink(None, 1, 1))
    return packed


class Line:
    """A wire, and the numbers that come out of it."""

    def __init__(self, seed: str = "", **faults) -> None:
        self.data: list[bytes] = []
        self.wire = FaultyWire(lambda data, _: self.data.append(data), Random(seed))
        self.wire.faults = LinkFaults(**faults)

    def send(self, count: int, now_s: float = 0.0) -> list[int]:
        for number in range(count):
            self.wire.carry(frame(number), PEER, now_s)
        return self.numbers()

    def numbers(self) -> list[int]:
        parser = dialect.MAVLink(None)
        parser.robust_parsing = True
        messages = [m for data in self.data for m in parser.parse_buffer(data) or ()]
        return [m.seq for m in messages if m.get_type() != "BAD_DATA"]


def test_a_good_wire_hands_everything_over_at_once() -> None:
    assert Line().send(20) == list(range(20))


@pytest.mark.parametrize("first", [0, 1, 2])
def test_of_every_n_frames_one_is_lost(first: int) -> None:
    line = Line(drop=every(3, first))
    assert line.send(9) == [n for n in range(9) if n % 3 != first]
    assert line.wire.lost == 3


def test_a_share_is_lost_and_always_the_same_one() -> None:
    lost = 1000 - len(Line("a", drop=share(0.2)).send(1000))
    assert 150 < lost < 250
    assert Line("a", drop=share(0.2)).send(50) == Line("a", drop=share(0.2)).send(50)
    assert Line("a", drop=share(0.2)).send(50) != Line("b", drop=share(0.2)).send(50)


def test_frames_come_twice() -> None:
    assert Line(duplicate=every(2)).send(4) == [0, 0, 1, 2, 2, 3]


def test_a_frame_is_overtaken_by_the_next() -> None:
    assert Line(reorder=every(3)).send(6) == [1, 0, 2, 4, 3, 5]


def test_a_frame_that_is_not_overtaken_comes_all_the_same() -> None:
    line = Line(reorder=every(1))
    assert line.send(1) == []
    line.wire.step(0.4)
    assert line.numbers() == []
    line.wire.step(0.6)
    assert line.numbers() == [0]


def test_frames_come_late_and_in_order() -> None:
    line = Line(delay_s=2.0)
    assert line.send(3, 10.0) == []
    line.wire.step(11.9)
    assert line.numbers() == []
    line.wire.step(12.0)
    assert line.numbers() == [0, 1, 2]


def test_one_bit_of_a_spoiled_frame_is_wrong() -> None:
    line = Line(corrupt=every(2))
    line.send(10)
    wrong = [
        sum(bin(a ^ b).count("1") for a, b in zip(data, frame(n), strict=True))
        for n, data in enumerate(line.data)
    ]
    assert wrong == [1, 0] * 5
    assert set(line.numbers()) <= set(range(10))


def test_only_the_messages_that_are_named_are_concerned() -> None:
    line = Line(drop=every(1), only={dialect.MAVLINK_MSG_ID_HEARTBEAT})
    assert line.send(3) == [0, 1, 2]


def test_a_cut_wire_loses_everything_even_what_was_under_way() -> None:
    line = Line(delay_s=1.0)
    line.send(2, 0.0)
    line.wire.cut_until_s = 10.0
    line.send(2, 0.5)
    line.wire.step(5.0)
    assert line.numbers() == []
    assert line.wire.lost == 4
    line.send(1, 10.0)
    line.wire.step(11.0)
    assert line.numbers() == [0]


def test_the_frames_of_a_datagram_are_told_apart() -> None:
    old = dialect.MAVLink_mission_item_reached_message(7).pack(
        dialect.MAVLink(None, 1, 1), force_mavlink1=True
    )
    parts = [frame(1), old, frame(2), b"junk" + frame(3)]
    assert list(frames_in(b"".join(parts))) == parts
    assert [message_id(each) for each in parts] == [46, 46, 46, None]
    assert list(frames_in(frame(1)[:7])) == [frame(1)[:7]]


@pytest.mark.parametrize("wrong", [lambda: every(0), lambda: every(3, 3), lambda: share(1.1)])
def test_rates_that_make_no_sense_are_refused(wrong) -> None:
    with pytest.raises(ValueError, match=r"frames|share"):
        wrong()


# --- a vehicle's faults ---------------------------------------------------------------------------


class World:
    """A vehicle on a port without a socket; `sent`: what it sent to its ground station."""

    def __init__(self, **options) -> None:
        self.port = VehiclePort(Autopilot(VehicleSpec(estimator_s=1.0, **options)))
        self.sent: list[bytes] = []
        self.port.outward.deliver = lambda data, _: self.sent.append(data)
        self.faults = Faults(self.port)
        self.autopilot = self.port.autopilot
        self.autopilot.meet(PEER)

    def run(self, seconds: float) -> None:
        until_s = self.autopilot.now_s + seconds
        while self.autopilot.now_s < until_s - 1e-9:
            self.port.step(self.autopilot.now_s + 0.1)
            self.faults.step()

    def command(self, command: int, *params: float) -> int | None:
        """Through the wires; None: no answer."""
        padded = [*params, *[0.0] * (7 - len(params))]
        message = dialect.MAVLink_command_long_message(1, 1, command, 0, *padded)
        self.sent.clear()
        self.port.datagram_received(message.pack(dialect.MAVLink(None, 255, 190)), PEER)
        self.port.flush()
        acks = [m for m in self.heard() if m.get_type() == "COMMAND_ACK"]
        return acks[0].result if acks else None

    def heard(self) -> list:
        return [m for data in self.sent for m in dialect.MAVLink(None).parse_buffer(data)]

    def texts(self) -> list[str]:
        return [m.text for m in self.heard() if m.get_type() == "STATUSTEXT"]

    def armed(self) -> "World":
        self.run(2)
        assert self.command(176, 1, 4) == 0
        assert self.command(ARM, 1) == 0
        return self


def test_a_link_is_cut_for_a_while_in_both_directions() -> None:
    world = World()
    world.run(3)
    world.faults.cut_link(seconds=10)
    world.sent.clear()
    assert world.command(512, 0) is None
    world.run(9)
    assert not world.sent
    world.run(3)
    assert world.command(512, 0) == 0
    assert world.faults.lost_frames > 9


def test_directions_are_bad_by_themselves() -> None:
    world = World()
    world.run(2)
    world.faults.set_link(Direction.SENT, drop=every(1))
    assert world.command(176, 1, 4) is None
    assert world.autopilot.modes.mode.name == "GUIDED"
    world.faults.repair_link()
    world.faults.set_link(Direction.RECEIVED, drop=every(1))
    assert world.command(176, 1, 5) is None
    assert world.autopilot.modes.mode.name == "GUIDED"
    world.run(3)
    assert world.sent


def test_a_link_for_good_is_cut_until_it_is_restored() -> None:
    world = World()
    world.faults.cut_link()
    world.run(1000)
    assert not world.sent
    world.faults.restore_link()
    world.run(2)
    assert world.sent


def test_satellites_are_lost_for_a_while() -> None:
    world = World()
    world.run(5)
    world.faults.lose_gps(seconds=4)
    world.run(3)
    assert not world.autopilot.estimator.ready
    world.run(2)
    assert world.autopilot.estimator.ready


def test_arming_is_refused_with_a_text_even_after_a_reboot() -> None:
    world = World()
    world.run(2)
    world.faults.refuse_arming("Compass not calibrated")
    world.command(dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    world.run(6)
    assert world.command(176, 1, 4) == 0
    assert world.command(ARM, 1) == 4
    assert world.texts() == ["Arm: Compass not calibrated"]
    world.faults.allow_arming()
    assert world.command(ARM, 1) == 0


def test_a_command_is_refused_ignored_or_refused_a_few_times() -> None:
    world = World()
    world.run(2)
    world.faults.refuse_command(176, Result.TEMPORARILY_REJECTED, "Not now", times=2)
    assert world.command(176, 1, 4) == 1
    assert world.texts() == ["Not now"]
    assert world.command(176, 1, 4) == 1
    assert world.command(176, 1, 4) == 0
    world.faults.refuse_command(ARM, None)
    assert world.command(ARM, 1) is None
    assert not world.autopilot.arming.armed
    world.faults.allow_command(ARM)
    assert world.command(ARM, 1) == 0


def test_somebody_else_changes_the_mode_or_the_mission() -> None:
    world = World().armed()
    world.faults.take_over("LOITER")
    assert world.autopilot.modes.mode.name == "LOITER"
    with pytest.raises(ValueError, match="no mode 'FOO'; there are: STABILIZE, "):
        world.faults.take_over("FOO")
    world.faults.replace_mission(
        [Item(0, 16, 0, 0, 0, 0, 0, 0, 0), Item(6, 22, 0, 0, 0, 0, 0, 0, 5)]
    )
    assert len(world.autopilot.plans[MISSION]) == 2


def test_the_battery_is_set() -> None:
    world = World()
    world.faults.set_battery()
    assert world.autopilot.battery.percent == 6
    world.faults.set_battery(3.0)
    assert world.autopilot.battery.left == 1.0


def test_something_happens_so_long_after_the_first_arming() -> None:
    world, done = World(parameters={"DISARM_DELAY": 0}), []
    world.faults.after_arming(4, lambda _: done.append(world.autopilot.now_s))
    world.run(20)
    assert not done
    world.armed()
    armed_s = world.autopilot.now_s
    world.run(3)
    world.command(ARM, 0)
    world.command(ARM, 1)
    world.run(2)
    assert done == [pytest.approx(armed_s + 4, abs=0.15)]
    world.faults.after_arming(6, lambda _: done.append(world.autopilot.now_s))
    world.run(2)
    assert done[1] == pytest.approx(armed_s + 6, abs=0.15)
