from m2pem_plugin_mavlink.protocol.messages import message_type
from m2pem_plugin_mavlink.vehicle.identity import Firmware
from m2pem_plugin_mavlink.vehicle.streams import RequestedStreams, telemetry_streams

FAST, SLOW = 30, 242


def granted(now_s: float = 0.0) -> RequestedStreams:
    streams = RequestedStreams({FAST: 0.25, SLOW: 2.0})
    for id_ in (FAST, SLOW):
        streams.requested(id_, now_s)
    return streams


def test_all_is_asked_for_at_first_and_not_again_while_it_comes() -> None:
    assert RequestedStreams({FAST: 0.25, SLOW: 2.0}).due({}, 0.0) == [FAST, SLOW]
    assert granted().due({FAST: 99.8, SLOW: 98.0}, 100.0) == []


def test_what_has_stopped_is_asked_for_again() -> None:
    streams = granted()
    assert streams.due({FAST: 10.0, SLOW: 10.0}, 14.0) == []
    assert streams.due({FAST: 10.0, SLOW: 10.0}, 16.0) == [FAST]
    assert streams.due({FAST: 10.0, SLOW: 10.0}, 19.0) == [FAST, SLOW]
    streams.requested(FAST, 16.0)
    assert streams.due({FAST: 10.0, SLOW: 15.0}, 20.0) == []
    assert streams.due({FAST: 10.0, SLOW: 15.0}, 22.0) == [FAST]


def test_what_never_came_is_given_time() -> None:
    assert granted().due({FAST: 99.9}, 100.0) == []


def test_what_was_refused_is_not_asked_for_until_the_next_boot() -> None:
    streams = granted()
    streams.refused.add(SLOW)
    assert streams.due({}, 100.0) == []
    streams.forget()
    assert streams.due({}, 101.0) == [FAST, SLOW]


def test_what_was_not_answered_is_asked_for_again() -> None:
    streams = granted()
    streams.unanswered(SLOW)
    assert streams.due({FAST: 0.9}, 1.0) == [SLOW]


def test_each_autopilot_is_asked_for_its_own_messages() -> None:
    ekf, estimator = message_type("EKF_STATUS_REPORT").id, message_type("ESTIMATOR_STATUS").id
    assert ekf in telemetry_streams(Firmware.ARDUPILOT)
    assert estimator in telemetry_streams(Firmware.PX4)
    assert ekf not in telemetry_streams(Firmware.PX4)
