import math
import random

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import GCS, Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect


def test_what_it_does_not_know_is_unsupported() -> None:
    assert Bench().command(31_999) == 3
    assert Bench().command(dialect.MAV_CMD_DO_ORBIT) == 3


def test_messages_to_others_are_ignored() -> None:
    bench = Bench()
    for system, component in ((2, 1), (1, 154)):
        message = dialect.MAVLink_command_long_message(system, component, 400, 0, 1, *[0] * 6)
        assert bench.tell(message) == []


def test_the_answer_names_who_asked() -> None:
    message = dialect.MAVLink_command_long_message(1, 1, 400, 0, 0, *[0] * 6)
    (ack,) = Bench().tell(message, system=42, component=7)
    assert (ack.target_system, ack.target_component) == (42, 7)


def test_a_confirmed_repetition_is_answered_but_not_done_again() -> None:
    bench = Bench()
    for confirmation in (0, 1, 2):
        assert bench.command(183, 9, 1500, confirmation=confirmation) == 0
    assert bench.autopilot.log.counts["servo"] == 1
    assert bench.command(183, 9, 1500) == 0
    assert bench.autopilot.log.counts["servo"] == 2


def test_a_refused_command_is_tried_again_when_it_is_repeated() -> None:
    bench = Bench(estimator_s=20)
    bench.run(12)
    bench.command(176, 1, 4)
    assert bench.command(400, 1) == 4
    bench.run(9)
    assert bench.command(400, 1, confirmation=1) == 0


def test_servos_relays_and_the_gripper_are_set() -> None:
    bench = Bench()
    assert bench.command(183, 9, 1700) == 0
    assert bench.command(181, 2, 1) == 0
    assert bench.command(211, 1, 0) == 0
    payload = bench.autopilot.payload
    assert (payload.servos_us, payload.relays, payload.gripped) == ({9: 1700}, {2: True}, False)


def test_outputs_of_motors_and_relays_that_are_not_there_fail() -> None:
    bench = Bench()
    assert bench.command(183, 1, 1700) == 4
    assert bench.command(181, 9, 1) == 4
    assert bench.command(211, 1, 5) == 2


def test_numbers_that_are_none_are_denied() -> None:
    bench = Bench()
    assert bench.command(183, math.nan, math.nan) == 2
    assert bench.command(181, math.inf, 1) == 2


def test_a_reboot_is_silence_and_a_new_start_with_the_plan_and_parameters_kept() -> None:
    bench = Bench()
    bench.run(10)
    bench.autopilot.parameters["RTL_ALT"] = 3000
    assert bench.command(246, 1) == 0
    bench.run(0.1)
    bench.received.clear()
    bench.run(1.5)
    assert bench.received == []
    bench.run(2)
    assert bench.received
    assert not bench.autopilot.estimator.ready
    assert bench.autopilot.parameters["RTL_ALT"] == 3000
    assert bench.autopilot.since_boot_s < 3


def test_an_armed_vehicle_does_not_reboot() -> None:
    assert Bench().ready().command(246, 1) == 4


@pytest.mark.parametrize("kind", list(Kind))
def test_whatever_comes_breaks_nothing(kind: Kind) -> None:
    bench = Bench(kind, estimator_s=0)
    bench.run(1)
    bench.command(176, 1, bench.guided)
    bench.command(400, 1)
    for id_ in bench.autopilot.streams.makers:
        assert bench.command(511, id_, 500_000) == 0
    chance = random.Random(5)
    numbers = [0, 1, 2, 255, -1, 4, 22, 400]
    floats = [0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 1e30, 47.4, 8.5]
    for message in _anything(chance, numbers, floats, 1500):
        bench.autopilot.receive(message, GCS, bench.autopilot.now_s)
        bench.run(0.1)
    assert math.isfinite(sum(bench.autopilot.position))


def _anything(
    chance: random.Random, numbers: list[int], floats: list[float], count: int
) -> list[object]:
    """Messages with fields of all sorts, for this vehicle, as a parser would hand them over."""
    taken = [76, 75, 84, 86, 44, 73, 39, 47, 45, 43, 40, 51, 41, 38, 20, 21, 23, 66, 11, 111, 4]
    made: list[object] = []
    while len(made) < count:
        type_ = dialect.mavlink_map[chance.choice(taken)]
        fields = []
        for name, kind in zip(type_.fieldnames, type_.fieldtypes, strict=True):
            if name in ("target_system", "target_component"):
                fields.append(1)
            elif kind == "char":
                fields.append(bytes(chance.choices(range(256), k=4)))
            elif kind in ("float", "double"):
                fields.append(chance.choice(floats))
            else:
                fields.append(chance.choice(numbers) % 128)
        if type_ in (dialect.mavlink_map[76], dialect.mavlink_map[75]):
            known = [400, 22, 192, 178, 115, 183, 179, 193, 194, 511, 512, 176, 300, 224, 16, 20]
            fields[type_.fieldnames.index("command")] = chance.choice(known)
        frame = type_(*fields).pack(dialect.MAVLink(None, 255, 190))
        parser = dialect.MAVLink(None)
        parser.robust_parsing = True
        made += [m for m in parser.parse_buffer(frame) or () if m.get_type() != "BAD_DATA"]
    return made
