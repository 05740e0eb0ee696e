"""A first script with pymavlink, in the steps and calls of ArduPilot's and mavlink.io's guides: it
knows nothing of m2pem. Run it with a connection, such as `udpin:127.0.0.1:14550`."""

import sys
import time
from typing import Any

from pymavlink import mavutil

mavlink = mavutil.mavlink
HIGH_M = 8.0
POSITION_ONLY = 0b110111111000


def acknowledged(master: Any, command: int) -> None:
    """As the guides wait for a command: until its acknowledgement comes."""
    while True:
        answer = master.recv_match(type="COMMAND_ACK", blocking=True, timeout=20)
        assert answer is not None, f"no acknowledgement of {command}"
        if answer.command == command:
            result = mavlink.enums["MAV_RESULT"][answer.result]
            assert answer.result == mavlink.MAV_RESULT_ACCEPTED, f"{command}: {result.name}"
            return


def position(master: Any) -> Any:
    return master.recv_match(type="GLOBAL_POSITION_INT", blocking=True, timeout=20)


def set_mode(master: Any, name: str) -> None:
    number = master.mode_mapping()[name]
    custom = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    master.mav.set_mode_send(master.target_system, custom, number)
    acknowledged(master, mavlink.MAV_CMD_DO_SET_MODE)


def upload(master: Any, items: list[tuple[int, int, int, float]], as_int: bool) -> None:
    target = master.target_system, master.target_component
    master.waypoint_clear_all_send()
    cleared = master.recv_match(type="MISSION_ACK", blocking=True, timeout=20)
    assert cleared.type == mavlink.MAV_MISSION_ACCEPTED
    master.waypoint_count_send(len(items))
    requests = ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"]
    while True:
        answer = master.recv_match(type=requests, blocking=True, timeout=20)
        if answer.get_type() == "MISSION_ACK":
            assert answer.type == mavlink.MAV_MISSION_ACCEPTED, f"mission: {answer.type}"
            return
        command, latitude, longitude, high_m = items[answer.seq]
        head = answer.seq, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, command, 0, 1, 0, 0, 0, 0
        if as_int:
            master.mav.mission_item_int_send(*target, *head, latitude, longitude, high_m)
        else:
            master.mav.mission_item_send(*target, *head, latitude / 1e7, longitude / 1e7, high_m)


def download(master: Any, ask: str) -> list[tuple[int, int, int, float]]:
    target = master.target_system, master.target_component
    master.mav.mission_request_list_send(*target)
    count = master.recv_match(type="MISSION_COUNT", blocking=True, timeout=20).count
    items = []
    for number in range(count):
        getattr(master.mav, ask)(*target, number)
        item = master.recv_match(type="MISSION_ITEM_INT", blocking=True, timeout=20)
        items.append((item.command, item.x, item.y, item.z))
    master.mav.mission_ack_send(*target, mavlink.MAV_MISSION_ACCEPTED)
    return items


def main(connection: str) -> None:
    master = mavutil.mavlink_connection(connection)
    master.wait_heartbeat()
    print(f"heartbeat of {master.target_system}/{master.target_component}")
    all_streams = mavlink.MAV_DATA_STREAM_ALL
    target = master.target_system, master.target_component
    master.mav.request_data_stream_send(*target, all_streams, 10, 1)

    master.mav.param_request_read_send(*target, b"MAV_SYS_ID", -1)
    value = master.recv_match(type="PARAM_VALUE", blocking=True, timeout=20)
    assert value.param_value == master.target_system
    master.param_fetch_all()
    while value.param_index != value.param_count - 1:
        value = master.recv_match(type="PARAM_VALUE", blocking=True, timeout=20)
    print("parameters read")

    start = position(master)
    takeoff, waypoint = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT
    near = start.lat + 2000, start.lon + 2000
    items = [
        (waypoint, start.lat, start.lon, 0.0),  # item 0 is the home position, as to ArduPilot
        (takeoff, start.lat, start.lon, HIGH_M),
        (waypoint, *near, HIGH_M),
    ]
    for as_int in (False, True):
        upload(master, items, as_int)
        for ask in ("mission_request_send", "mission_request_int_send"):
            read = download(master, ask)
            # The float of MISSION_ITEM keeps a place to a metre.
            for (command, *place, _), (own, *own_place, _) in zip(read, items, strict=True):
                assert command == own, (read, items)
                assert all(abs(a - b) < 100 for a, b in zip(place, own_place, strict=True))
    print("mission uploaded and read")

    set_mode(master, "GUIDED")
    while master.flightmode != "GUIDED":
        master.recv_match(type="HEARTBEAT", blocking=True, timeout=20)
    master.arducopter_arm()
    acknowledged(master, mavlink.MAV_CMD_COMPONENT_ARM_DISARM)
    master.motors_armed_wait()
    master.mav.command_long_send(*target, takeoff, 0, 0, 0, 0, 0, 0, 0, HIGH_M)
    acknowledged(master, takeoff)
    while position(master).relative_alt < HIGH_M * 950:
        pass
    print("taken off")

    east = start.lon + 5000
    frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
    master.mav.set_position_target_global_int_send(
        0, *target, frame, POSITION_ONLY, start.lat, east, HIGH_M, *[0] * 8
    )
    while abs(position(master).lon - east) > 200:
        pass
    while master.flightmode != "GUIDED":
        master.recv_match(type="HEARTBEAT", blocking=True, timeout=20)
    print("gone there")

    set_mode(master, "AUTO")
    while abs(position(master).lat - near[0]) > 200:
        pass
    print("mission flown")
    set_mode(master, "LAND")
    master.motors_disarmed_wait()
    assert position(master).relative_alt < 500
    print("landed")


if __name__ == "__main__":
    began_s = time.monotonic()
    main(sys.argv[1])
    print(f"done in {time.monotonic() - began_s:.0f} s")
