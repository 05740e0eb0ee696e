#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (camera), with pymavlink 2.4.50 in the part of the vehicle and of the camera. Date: 2026-11-29.
# Expected: MAV_CMD_IMAGE_START_CAPTURE (2000), param4: a sequence number "starting from 1" for a single picture, and 0
#   for a series (common.xml), so that a camera can tell a repeated command from a new one.
# Seen: the first take_photo() has number 0, which means "no number"; the second has 1; a series that follows has 2, where
#   it has to be 0, and the next single picture 3.
# Matters: a camera that compares the number with the last one, 0 at power-up, drops the first picture as a repetition.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile mavsdk==4.1.0 pymavlink==2.4.50

cat > try.py <<'EOF'
import os, socket, threading, time
os.environ["MAVLINK20"] = "1"
from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.camera import Camera
from pymavlink import mavutil

log_subscribe(lambda *_: True)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
    probe.bind(("127.0.0.1", 0))
    port = probe.getsockname()[1]
station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
station.add_any_connection(f"udpin://127.0.0.1:{port}")
vehicle, device = (
    mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=c) for c in (1, 100))
pictures, over = [], threading.Event()
text = lambda name: list(name.ljust(32, b"\0"))

def fly():
    while not over.is_set():
        vehicle.mav.heartbeat_send(2, 12, 81, 0, 4)
        device.mav.heartbeat_send(30, 8, 0, 0, 4)
        while (got := device.recv_match(type="COMMAND_LONG", blocking=False)) is not None:
            if got.target_component != 100:
                continue
            if got.command == 2000:
                pictures.append(f"interval {got.param2:g} total {got.param3:g} number {got.param4:g}")
            device.mav.command_ack_send(got.command, 0)
            if got.command == 512 and got.param1 == 259:
                device.mav.camera_information_send(0, text(b"V"), text(b"M"), 1, 4.5, 6.2, 4.6, 4000, 3000, 0, 2, 0, b"")
        time.sleep(0.05)

flying = threading.Thread(target=fly)
flying.start()
try:
    camera = Camera(station.first_autopilot(20))
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and not camera.camera_list().cameras:
        time.sleep(0.1)
    camera.take_photo(100)
    camera.take_photo(100)
    camera.start_photo_interval(100, 2.0)
    camera.stop_photo_interval(100)
    camera.take_photo(100)
finally:
    over.set()
    flying.join()
print(*dict.fromkeys(pictures), sep="\n")
station.destroy()
EOF
diff <(timeout 90 venv/bin/python try.py) - <<'EOF'
interval 0 total 1 number 0
interval 0 total 1 number 1
interval 2 total 0 number 2
interval 0 total 1 number 3
EOF
echo "as seen: the first picture has number 0, and a series has a number"
