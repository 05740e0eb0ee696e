from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

SET, REQUEST = 511, 512


def heard(bench: Bench, id_: int) -> int:
    return sum(m.get_msgId() == id_ for m in bench.received)


def test_nothing_but_the_heartbeat_is_sent_unasked() -> None:
    bench = Bench()
    bench.run(30)
    kinds = {m.get_type() for m in bench.received}
    assert kinds == {"HEARTBEAT", "TIMESYNC", "HOME_POSITION", "GPS_GLOBAL_ORIGIN"}
    assert heard(bench, 0) in (30, 31)


def test_a_message_comes_as_often_as_asked_for() -> None:
    bench = Bench()
    assert bench.command(SET, 33, 200_000) == 0
    bench.run(20)
    assert 99 <= heard(bench, 33) <= 102
    assert bench.command(SET, 33, -1) == 0
    bench.received.clear()
    bench.run(5)
    assert heard(bench, 33) == 0


def test_faster_than_the_loop_is_denied_with_a_text() -> None:
    copter, rover = Bench(), Bench(Kind.ROVER)
    assert copter.command(SET, 30, 2_500) == 2
    assert copter.texts()
    assert copter.command(SET, 30, 5_000) == 0
    assert rover.command(SET, 30, 20_000) == 2
    assert rover.command(SET, 30, 25_000) == 0


def test_an_unknown_message_is_denied() -> None:
    bench = Bench()
    assert bench.command(SET, 9999, 1_000_000) == 2
    assert bench.command(REQUEST, 9999) == 4
    assert bench.command(SET, float("nan"), 1) == 2


def test_each_peer_has_its_own_streams() -> None:
    bench = Bench()
    bench.autopilot.meet("other")
    assert bench.command(SET, 33, 100_000, peer="other") == 0
    bench.run(5)
    assert heard(bench, 33) == 0


def test_every_report_can_be_requested() -> None:
    bench = Bench(parameters={"FENCE_ENABLE": 1}).airborne()
    for id_ in bench.autopilot.streams.makers:
        assert bench.report(id_).get_msgId() == id_


def test_a_data_stream_of_ardupilot_sets_the_intervals_of_its_messages() -> None:
    bench = Bench()
    position, all_, attitude = 6, 0, 30
    bench.tell(dialect.MAVLink_request_data_stream_message(1, 1, position, 5, 1))
    bench.run(20)
    assert 99 <= heard(bench, 33) <= 102
    assert heard(bench, attitude) == 0
    bench.tell(dialect.MAVLink_request_data_stream_message(1, 1, all_, 2, 1))
    bench.received.clear()
    bench.run(10)
    assert 19 <= heard(bench, 33) <= 22
    assert 19 <= heard(bench, attitude) <= 22
    bench.tell(dialect.MAVLink_request_data_stream_message(1, 1, all_, 0, 0))
    bench.received.clear()
    bench.run(5)
    assert heard(bench, 33) == heard(bench, attitude) == 0
