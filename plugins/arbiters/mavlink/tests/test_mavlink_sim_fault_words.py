"""Faults in words, as on the command line."""

import pytest
from click.testing import CliRunner
from m2pem_plugin_mavlink.simulator.command_line import mavlink
from m2pem_plugin_mavlink.simulator.faults import GRAMMAR, plan
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec
from test_mavlink_sim_faults import World

from m2pem.api.faults import FaultError

parse = GRAMMAR.parse


def test_vehicles_times_and_what_happens_are_read() -> None:
    fault = parse("1, 3: cut link at 40 s for 600 s")
    assert (fault.targets, fault.at_s, fault.for_s) == (("1", "3"), 40.0, 600.0)
    assert parse("all: lose gps").targets is None
    assert parse("lose gps at 1.5s").at_s == 1.5


def happening(text: str) -> World:
    world = World()
    plan(parse(text), world.faults)
    world.run(2)
    return world


def test_a_link_is_cut_at_a_time_after_arming_and_for_a_time() -> None:
    world = World().armed()
    plan(parse("cut link at 5 s for 10 s"), world.faults)
    world.run(4)
    assert world.sent
    world.run(2)
    world.sent.clear()
    world.run(8)
    assert not world.sent
    world.run(2)
    assert world.sent


def test_the_others_do_what_they_say() -> None:
    assert happening("battery low").autopilot.battery.percent == 6
    assert happening("battery 12.5 %").autopilot.battery.percent == 12
    assert not happening("lose gps").autopilot.estimator.ready
    assert happening("refuse command 400").command(400, 1) == 4
    assert happening("camera full").autopilot.injected_faults.camera_full
    world = happening('refuse arming "Gyros: not today"')
    world.command(176, 1, 4)
    assert world.command(400, 1) == 4
    assert world.texts() == ["Arm: Gyros: not today"]


def test_somebody_else_changes_the_mode() -> None:
    world = World().armed()
    plan(parse("mode loiter at 3 s"), world.faults)
    world.run(2)
    assert world.autopilot.modes.mode.name == "GUIDED"
    world.run(2)
    assert world.autopilot.modes.mode.name == "LOITER"


def test_what_was_begun_ends() -> None:
    world = happening("refuse command 400 for 1 s")
    world.command(176, 1, 4)
    assert world.command(400, 1) == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1: cut lnik at 4 s", r"'cut lnik' is no action. Actions: cut link; battery low"),
        ("", "'' is no action"),
        ("x: cut link", "'x' are no vehicles: say their system ids, such as 1 or 1,2, or all"),
        ("battery low for 3 s", "'battery low' has no end; leave 'for ... s' out"),
        ("battery 140 %", "a battery has at most 100 %"),
        ("mode loiter", "say when, such as 'mode loiter at 40 s'"),
        ("cut link at noon", "'cut link at noon' is no action"),
    ],
)
def test_what_is_no_fault_is_told_with_what_would_be_right(text: str, said: str) -> None:
    with pytest.raises(FaultError) as error:
        parse(text)
    assert said in str(error.value)
    assert repr(text) in str(error.value)


def test_a_simulator_knows_its_vehicles_and_their_modes() -> None:
    simulator = Simulator([VehicleSpec(), VehicleSpec(system=4)])
    with pytest.raises(FaultError, match="there is no vehicle 2; there are: 1, 4"):
        simulator.plan([parse("2: cut link")])
    with pytest.raises(FaultError, match=r"vehicle 1 has no mode 'AUTO\.RTL'; it has: STABILIZE"):
        simulator.plan([parse("mode auto.rtl at 1 s")])
    simulator.plan([parse("4: cut link for 9 s")])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--fault", "1: cut lnik"], "is no action"),
        (["--fault", "9: cut link"], "there is no vehicle 9"),
        (["--set", "FS_GCS_ENABEL=1"], "did you mean FS_GCS_ENABLE?"),
        (["--set", "FS_GCS_ENABLE=on"], "is not NAME=VALUE"),
        (["--firmware", "px4", "--planes", "1"], "a plane with PX4 is not simulated"),
    ],
)
def test_the_command_line_says_what_is_wrong(options: list[str], said: str) -> None:
    result = CliRunner().invoke(mavlink, options)
    assert result.exit_code == 2
    assert said in result.output
