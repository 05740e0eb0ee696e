"""Faults of simulated vehicles, made on request: cut links, refusals, other ground stations."""

import pytest
from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.faults import Faults
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_mavlink.simulator.server import VehiclePort
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec
from pymavlink.dialects.v20 import ardupilotmega as dialect

PEER = ("127.0.0.1", 1)
ARM = dialect.MAV_CMD_COMPONENT_ARM_DISARM


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


def test_a_link_is_cut_in_both_directions_until_it_is_restored() -> None:
    world = World()
    world.run(3)
    world.faults.cut_link()
    world.sent.clear()
    assert world.command(512, 0) is None
    world.run(1000)
    assert not world.sent
    world.faults.restore_link()
    world.run(2)
    assert world.sent
    assert world.command(512, 0) == 0


def test_satellites_are_lost_and_found() -> None:
    world = World()
    world.run(5)
    world.faults.lose_gps()
    world.run(3)
    assert not world.autopilot.estimator.ready
    world.faults.find_gps()
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


def test_another_ground_station_changes_the_mode() -> None:
    world = World().armed()
    world.faults.take_over("LOITER")
    assert world.autopilot.modes.mode.name == "LOITER"
    with pytest.raises(ValueError, match="no mode 'FOO'; there are: STABILIZE, "):
        world.faults.take_over("FOO")


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
