#!/usr/bin/env bash
# Program: mavkit 0.3.0. Date: 2026-11-30.
# Expected: a vehicle is an autopilot, MAV_COMP_ID_AUTOPILOT1 or a component whose HEARTBEAT has an autopilot other than
#   MAV_AUTOPILOT_INVALID (MAVLink, "Heartbeat/Connection Protocol"); its commands go there.
# Seen: it takes the HEARTBEAT of a camera of the vehicle (MAV_TYPE_CAMERA, MAV_AUTOPILOT_INVALID) for the vehicle's, in
#   whichever order they come, and sends ARM and all other commands to the camera.
# Matters: it cannot command vehicles that have a camera; the camera refuses.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile mavkit==0.3.0 pymavlink==2.4.50

cat > try.py <<'EOF'
import asyncio
import socket
from mavkit import Vehicle
from pymavlink.dialects.v20 import common

def frames(camera_first):
    autopilot = common.MAVLink(None, srcSystem=1, srcComponent=1)
    camera = common.MAVLink(None, srcSystem=1, srcComponent=100)
    beats = [(autopilot, (2, 12, 81, 0, 3)), (camera, (30, 8, 0, 0, 4))]
    for mav, fields in reversed(beats) if camera_first else beats:
        yield common.MAVLink_heartbeat_message(fields[0], fields[1], fields[2], fields[3], fields[4], 3).pack(mav)

async def target(camera_first):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.setblocking(False)
        loop, parser = asyncio.get_running_loop(), common.MAVLink(None)
        parser.robust_parsing = True

        async def beat():
            while True:
                for frame in frames(camera_first):
                    vehicle.sendto(frame, ("127.0.0.1", port))
                    await asyncio.sleep(0.05)
                await asyncio.sleep(0.5)

        beating = asyncio.create_task(beat())
        made = await asyncio.wait_for(Vehicle.connect_udp(f"127.0.0.1:{port}"), 20)
        arming = asyncio.ensure_future(made.arm(False))
        try:
            while True:
                data = await asyncio.wait_for(loop.sock_recv(vehicle, 2048), 20)
                for message in parser.parse_buffer(data) or ():
                    if message.get_type() == "COMMAND_LONG" and message.command == 400:
                        return message.target_component
        finally:
            arming.cancel()
            beating.cancel()

for first in (False, True):
    print("camera first" if first else "autopilot first", asyncio.run(target(first)), flush=True)
import os
os._exit(0)
EOF
diff <(timeout 100 venv/bin/python try.py) - <<'EOF'
autopilot first 100
camera first 100
EOF
echo "as seen: mavkit commands the camera in place of the autopilot"
