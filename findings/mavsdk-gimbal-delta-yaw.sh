#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (gimbal), with pymavlink 2.4.50 in the part of the vehicle. Date: 2026-11-29.
# Expected: GIMBAL_DEVICE_ATTITUDE_STATUS carries delta_yaw, from which a receiver calculates the attitude in the other
#   frame: "q_earth = q_delta_yaw * q_vehicle" (common.xml). With a yaw of 30 degrees in the vehicle frame (flag 32) and
#   a delta_yaw of 45, euler_angle_north has yaw 75.
# Seen: delta_yaw is not read. The other frame is NaN until an ATTITUDE message has arrived (ATTITUDE_QUATERNION is not
#   used either), and then follows from the yaw of that message: here 90, so 120 instead of 75.
# Matters: where the camera looks on the map is NaN on a link without ATTITUDE, and late while the vehicle turns.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile mavsdk==4.1.0 pymavlink==2.4.50 numpy==2.4.6

cat > try.py <<'EOF'
import os, socket, threading, time
from math import nan, radians
os.environ["MAVLINK20"] = "1"
from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.gimbal import Gimbal
from pymavlink import mavutil
from pymavlink.quaternion import QuaternionBase

log_subscribe(lambda *_: True)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
    probe.bind(("127.0.0.1", 0))
    port = probe.getsockname()[1]
station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
station.add_any_connection(f"udpin://127.0.0.1:{port}")
vehicle = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=1)
send, yaw_deg, states = vehicle.mav, [], []

def fly():
    q = [float(v) for v in QuaternionBase([0, 0, radians(30)]).q]
    while not states or states[-1] != "over":
        send.heartbeat_send(2, 12, 81, 0, 4)
        send.gimbal_manager_information_send(0, 0x3FFFF, 1, -0.5, 0.5, -1.5, 0.5, -3.1, 3.1)
        for yaw in yaw_deg:
            send.attitude_send(0, 0, 0, radians(yaw), 0, 0, 0)
        send.gimbal_device_attitude_status_send(0, 0, 0, 32, q, nan, nan, nan, 0, radians(45), nan, 1)
        while (got := vehicle.recv_match(type="COMMAND_LONG", blocking=False)) is not None:
            send.command_ack_send(got.command, 0)
        time.sleep(0.1)

flying = threading.Thread(target=fly)
flying.start()
gimbal, got = Gimbal(station.first_autopilot(20)), []
gimbal.subscribe_attitude(lambda value, *_: got.append((value.euler_angle_forward.yaw_deg, value.euler_angle_north.yaw_deg)))

def settled(condition):
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline and not (got and condition(got[-1][1])):
        time.sleep(0.1)
    return "forward {:.0f} north {:.0f}".format(*got[-1])

print("no ATTITUDE:", settled(lambda north: True))
yaw_deg.append(90)
print("ATTITUDE 90:", settled(lambda north: north == north))
states.append("over")
flying.join()
station.destroy()
EOF
diff <(timeout 90 venv/bin/python try.py) - <<'EOF'
no ATTITUDE: forward 30 north nan
ATTITUDE 90: forward 30 north 120
EOF
echo "as seen: delta_yaw is not read"
